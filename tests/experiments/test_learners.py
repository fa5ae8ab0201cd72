"""Several learners in one experiment: sweeps, ids, and that each gets its own simulation."""

from itertools import product

import polars as pl
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.errors import RequestError
from qbumpers.experiments import work
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import MANY_CELLS, load_experiment, make_experiment
from qbumpers.experiments.store import load
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import simulate
from qbumpers.tasks import cliff_walking
from tests.experiments.examples import BUMPERS, ids_of, run_into, settings, write_toml
from tests.narrowing import present

NONE = [{"name": "none"}]


def learners_of(*learners):
    experiment = make_experiment(settings(assistants=NONE, learners=list(learners)))
    return [(named.condition, named.learner_id) for named in experiment.conditions()]


def test_a_listed_field_is_swept_over_with_the_last_one_fastest():
    swept = {"perception": ["observant", "transition"], "penalty": [2.0, 1.0], "initial_value": 3.0}
    experiment = make_experiment(settings(learners=[swept]))
    found = [(each.perception, each.penalty) for each in experiment.learners]
    assert found == list(product(["observant", "transition"], [2.0, 1.0]))
    assert {each.learner(1.0).initial_value for each in experiment.learners} == {3.0}


def test_every_assistant_meets_every_learner_learner_by_learner():
    learners = [{"perception": ["transition", "observant"]}]
    assistants = ["none", "stochastic-q-bumpers/alpha=0.3", "stochastic-q-bumpers/alpha=0.7"]
    assert ids_of(learners=learners) == [
        f"{assistant}@perception={perception}"
        for perception, assistant in product(["transition", "observant"], assistants)
    ]


def test_a_learner_alone_is_not_in_the_ids():
    learner = {"perception": "observant", "penalty": 3.0, "epsilon": {"end": 0.1}}
    assert learners_of(learner) == [("none", "q-learning")]


@pytest.mark.parametrize(
    ("learners", "apart"),
    [
        ([{"perception": ["observant", "transition"]}],
         ["perception=observant", "perception=transition"]),
        ([{"penalty": 2}, {"penalty": 2.5}], ["penalty=2", "penalty=2.5"]),
        ([{"initial_value": -1.0, "penalty": [0.0, 0.1]}, {"penalty": 0.1}],
         ["initial_value=-1,penalty=0", "initial_value=-1,penalty=0.1",
          "initial_value=0,penalty=0.1"]),
        ([{"epsilon": [{"end": 0.1}, {"start": 0.5, "fraction": 1}]}],
         ["epsilon=1..0.1..0.9", "epsilon=0.5..0.02..1"]),
    ],
)  # fmt: skip
def test_ids_hold_what_tells_learners_apart_and_nothing_else(learners, apart):
    expected = [(f"none@{text}", f"q-learning/{text}") for text in apart]
    assert learners_of(*learners) == expected


@pytest.mark.parametrize("learners", [[{}, {}], [{"penalty": [1, 1.0]}]])
def test_a_learner_that_occurs_twice_is_refused(learners):
    with pytest.raises(RequestError, match=r"condition none.* occurs 2 times; keep one"):
        learners_of(*learners)


def test_learners_are_read_from_toml_and_written_back_one_by_one(tmp_path):
    learners = [{"perception": ["observant", "disruption"], "penalty": 2.0}, {"discount": 0.5}]
    path = write_toml(tmp_path / "many.toml", learners=learners, assistants=NONE, trials=1)
    experiment = load_experiment(path)
    assert len(experiment.learners) == 3
    folder = run_into(tmp_path / "out", learners=learners, assistants=NONE, trials=1)
    assert load_experiment(folder / "experiment.toml") == experiment


def test_each_learner_gets_its_own_rows_as_simulated_alone(tmp_path):
    schedule = {"start": 0.8, "end": 0.1, "fraction": 0.5}
    learners = [
        {"perception": ["transition", "transition-disruption"], "penalty": 7.5},
        {"discount": 0.9, "epsilon": schedule, "learning_rate": schedule, "initial_value": -3.0},
    ]
    folder = run_into(tmp_path, learners=learners, assistants=[{**BUMPERS, "alpha": 0.3}])
    results = load(folder)
    ids = ids_of(learners=learners, assistants=[{**BUMPERS, "alpha": 0.3}])
    made = [
        ("transition", 7.5, QLearner()),
        ("transition-disruption", 7.5, QLearner()),
        ("transition", 1.0, QLearner(0.9, Schedule(**schedule), Schedule(**schedule), -3.0)),
    ]
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.3, second=True)
    for name, (perception, penalty, learner) in zip(ids, made, strict=True):
        outcomes = simulate(
            cliff_walking(), assistant, learner=learner, perception=perception, penalty=penalty,
            episodes=4, trials=5, seed=3,
        ).outcomes  # fmt: skip
        rows = results.episodes.filter(pl.col("condition") == name)
        for column in ("assisted_return", "unassisted_return", "overrides"):
            assert rows[column].to_list() == getattr(outcomes, column).ravel().tolist()
        assert rows["learner"].unique().to_list() == ["q-learning/" + name.partition("@")[2]]
        assert rows["alpha"].unique().to_list() == [0.3]
    assert present(results.states)["condition"].unique(maintain_order=True).to_list() == ids


def test_conditions_of_equal_content_are_simulated_once(tmp_path, monkeypatch):
    """A discount left out and the task's own make two names for one content."""
    done = []
    simulated = work.run_condition
    monkeypatch.setattr(
        work, "run_condition", lambda *_, **given: done.append(1) or simulated(*_, **given)
    )
    learners = [{"perception": "observant"}, {"perception": "observant", "discount": 1.0}]
    folder = run_into(tmp_path, learners=learners, assistants=NONE)
    assert len(done) == 1
    first, second = (
        rows.drop("condition", "learner")
        for rows in load(folder).episodes.partition_by("condition", maintain_order=True)
    )
    assert first.height == 5 * 4
    assert first.equals(second)


@pytest.mark.parametrize("field", ["perception", "penalty", "epsilon"])
def test_an_empty_list_is_refused(field):
    with pytest.raises(RequestError, match=rf"learner: {field} = \[\]; at least one value"):
        make_experiment(settings(learners=[{field: []}]))


def test_no_learner_at_all_is_refused():
    with pytest.raises(RequestError, match=r"learners = \[\]: .*at least 1"):
        make_experiment(settings(learners=[]))


TYPOS = {
    "experiment": ({"retentoin": 5}, r"retentoin = 5: unknown field \(did you mean 'retention'"),
    "experiment, old name": (
        {"learner": {"perception": "observant"}},
        r"learner = \{.*\}: unknown field \(did you mean 'learners'",
    ),
    "task": (
        {"task": {"name": "cliff-walking", "discout": 0.9}},
        r"task\.discout = 0\.9: unknown field \(did you mean 'discount'",
    ),
    "second learner": (
        {"learners": [{}, {"penatly": 2.0}]},
        r"learners\.1\.penatly = 2\.0: unknown field \(did you mean 'penalty'",
    ),
    "listed field": (
        {"learners": [{"perceptoin": ["observant", "transition"]}]},
        r"learners\.0\.perceptoin = 'observant': unknown field \(did you mean 'perception'",
    ),
    "schedule": (
        {"learners": [{"learning_rate": {"strat": 0.5}}]},
        r"learners\.0\.learning_rate\.strat = 0\.5: unknown field \(did you mean 'start'",
    ),
    "assistant": (
        {"assistants": [{"name": "stochastic-q-bumpers", "alpha": 0.5, "vmin": 0.0}]},
        r"'vmin' \(did you mean 'v_min'",
    ),
    "perception in a list": (
        {"learners": [{"perception": ["transition", "observent"]}]},
        r"learners\.perception 'observent' \(did you mean 'observant'",
    ),
}


@pytest.mark.parametrize(("changes", "message"), TYPOS.values(), ids=list(TYPOS))
def test_a_typo_in_any_table_is_named_with_what_was_meant(tmp_path, changes, message):
    path = write_toml(tmp_path / "typo.toml", **changes)
    with pytest.raises(RequestError, match=rf"experiment file .*typo\.toml: .*{message}"):
        load_experiment(path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"retention": -1}, r"retention = -1: .*greater than or equal to 0"),
        ({"retention": 2.0}, r"retention = 2\.0: .*integer"),
        ({"criterion": float("nan")}, r"criterion = nan: .*finite"),
        ({"common_random_numbers": 1}, r"common_random_numbers = 1: .*boolean"),
        ({"learners": {"perception": "observant"}}, r"learners = \{.*\}: .*list"),
        ({"learners": ["q-learning"]}, r"learners\.0 = 'q-learning': .*LearnerDesign"),
    ],
)
def test_wrong_values_of_the_new_fields_are_refused(changes, message):
    with pytest.raises(RequestError, match=message):
        make_experiment(settings(**changes))


def grid(assistants, **changes):
    alphas = [number / assistants for number in range(assistants)]
    swept = {"name": "local-q-thresholding", "alpha": alphas}
    return settings(assistants=[swept], episodes=50_000, **changes)  # one trial a cell


def test_many_cells_must_be_asked_for():
    make_experiment(grid(100, trials=MANY_CELLS // 100))
    with pytest.raises(RequestError, match=r"100 conditions, together 10,100 cells of work; more "
                       r"than 10,000 must be asked for with --yes"):  # fmt: skip
        make_experiment(grid(100, trials=MANY_CELLS // 100 + 1))
    asked = make_experiment(grid(100, trials=MANY_CELLS // 100 + 1), large=True)
    assert asked.condition_count() == 100


def test_learners_count_towards_the_cells():
    swept = {"perception": ["transition", "observant"], "penalty": [1.0, 2.0, 3.0]}
    with pytest.raises(RequestError, match=r"60 conditions, together 10,020 cells"):
        make_experiment(grid(10, trials=167, learners=[swept]))


def test_episodes_alone_count_towards_the_cells():
    """Cells hold fewer trials if learners go on unassisted: the same cells as the run will have."""
    changes = {"episodes": 10, "retention": 49_990, "assistants": NONE}
    with pytest.raises(RequestError, match=r"1 conditions?, together 10,001 cells"):
        make_experiment(settings(trials=MANY_CELLS + 1, **changes))


def test_a_count_of_conditions_is_that_of_the_conditions():
    experiment = make_experiment(
        settings(
            learners=[{"perception": ["transition", "observant"]}, {"discount": 0.5}],
            assistants=[
                *NONE,
                {"name": "local-q-thresholding", "alpha": [0.1, 0.2], "second": [True, False]},
                {**BUMPERS, "alpha": [0.5]},
            ],
        )
    )
    assert experiment.condition_count() == len(experiment.conditions()) == 3 * (1 + 4 + 1)


def test_a_grid_too_large_for_any_memory_is_counted_and_refused():
    options = {
        "alpha": [n / 1000 for n in range(1000)],
        "v_min": [-float(n) for n in range(1000)],
        "p_max": [n / 2000 for n in range(1000, 2000)],
    }
    with pytest.raises(RequestError, match=r"1,000,000,000 conditions"):
        make_experiment(settings(assistants=[{"name": "stochastic-q-bumpers", **options}]))


def test_a_learner_and_its_discount_reach_the_plan():
    learners = [{"perception": "observant", "discount": [0.5, 0.75]}]
    plan = make_plan(make_experiment(settings(learners=learners, assistants=NONE, retention=2)))
    found = [plan.conditions[content] for _, content in plan.named]
    assert [each.learner.discount for each in found] == [0.5, 0.75]
    assert {(each.perception, each.retention) for each in found} == {("observant", 2)}
