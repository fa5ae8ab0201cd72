"""In files: tables of perception and motor noise, several kinds of learners, rules over rules."""

from typing import Any, NamedTuple

import polars as pl
import pytest

from qbumpers.assistants import register_assistant
from qbumpers.errors import RequestError
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.experiments.store import load
from qbumpers.learners import Motor, Perception, PowerLaw, Sarsa
from tests.assistants.own_rules import watch
from tests.experiments.examples import cells_of, ids_of, run_into, settings

NONE = [{"name": "none"}]
OVER = {
    "name": "budget",
    "per_episode": [1, 5],
    "of": {"name": "stochastic-q-bumpers", "alpha": [0.2, 0.4]},
}


def ids_of_learners(*learners):
    return [each.partition("@")[2] for each in ids_of(learners=list(learners), assistants=NONE)]


def test_tables_of_a_learner_reach_its_condition():
    learner = {
        "perception": {"notices": 0.3, "credits": "proposed", "penalty": 0.5},
        "motor": {"slip": 0.1, "lag": 0.2},
        "forgetting": 0.1,
    }
    plan = make_plan(make_experiment(settings(learners=[learner], assistants=NONE)))
    [condition] = plan.conditions.values()
    assert condition.perceived() == Perception(0.3, "proposed", 0.5)
    assert condition.motor == Motor(0.1, 0.2)
    assert condition.forgetting == 0.1


@pytest.mark.parametrize(
    ("learners", "apart"),
    [
        ([{"perception": ["observant", {"notices": 0.3}]}],
         ["perception=observant", "perception={notices=0.3}"]),
        ([{"perception": {"notices": [0.3, 0.5], "penalty": 0.5}}],
         ["perception={notices=0.3,penalty=0.5}", "perception={notices=0.5,penalty=0.5}"]),
        ([{"perception": [{}, {"credits": "nothing"}]}],
         ["perception={notices=1}", "perception={notices=1,credits=nothing}"]),
        ([{"motor": [{"slip": [0.1, 0.2]}, {"lag": 0.3}]}],
         ["motor=0.1..0", "motor=0.2..0", "motor=0..0.3"]),
        ([{}, {"motor": {"slip": 0.1}}], ["motor=0..0", "motor=0.1..0"]),
        ([{"forgetting": [0.0, 0.1]}], ["forgetting=0", "forgetting=0.1"]),
        ([{"forgetting": [0.02, {"decay": [0.5, 0.2]}]}],
         ["forgetting=0.02", "forgetting={decay=0.5}", "forgetting={decay=0.2}"]),
        ([{"name": ["q-learning", "sarsa"]}], ["name=q-learning", "name=sarsa"]),
    ],
)  # fmt: skip
def test_tables_are_swept_over_and_told_in_ids(learners, apart):
    assert ids_of_learners(*learners) == apart
    experiment = make_experiment(settings(learners=learners, assistants=NONE))
    assert make_experiment(experiment.model_dump(exclude_none=True)) == experiment


@pytest.mark.parametrize(
    ("learner", "message"),
    [
        ({"perception": {"notices": 1.5}}, r"perception\.notices = 1\.5: .*equal to 1"),
        ({"perception": {"notes": 0.5}}, r"perception\.notes = 0\.5: .*mean 'notices'"),
        ({"perception": {"credits": "mine"}}, r"perception\.credits = 'mine': .*'proposed'"),
        ({"perception": 3}, r"learners\.perception = 3; a name or a table with notices, credits"),
        ({"perception": {"notices": []}}, r"learner: perception: notices = \[\]; at least one"),
        ({"motor": {"slpi": 0.1}}, r"motor\.slpi = 0\.1: unknown field \(did you mean 'slip'"),
        ({"motor": {"lag": 2}}, r"motor\.lag = 2: .*less than or equal to 1"),
        ({"forgetting": 1.5}, r"forgetting = 1\.5: .*less than or equal to 1"),
        (
            {"forgetting": "all"},
            r"learners\.forgetting = 'all'; a share in \[0, 1\] or a table with decay",
        ),
        ({"forgetting": {"decay": 0.0}}, r"forgetting\.decay = 0\.0: .*greater than 0"),
        ({"forgetting": {"decya": 0.5}}, r"forgetting\.decya = 0\.5: .*mean 'decay'"),
    ],
)
def test_what_is_wrong_in_a_table_is_named(learner, message):
    with pytest.raises(RequestError, match=message):
        make_experiment(settings(learners=[learner]))


@pytest.mark.slow
def test_a_power_law_of_forgetting_reaches_its_condition_and_is_read_back(tmp_path):
    learners = [{"forgetting": {"decay": 0.3}}, {"forgetting": {}}]
    plan = make_plan(make_experiment(settings(learners=learners, assistants=NONE)))
    found = [condition.forgetting for condition in plan.conditions.values()]
    assert found == [PowerLaw(0.3), PowerLaw(0.5)]
    folder = run_into(tmp_path, learners=learners, assistants=NONE, trials=1)
    assert load(folder).experiment == load_experiment(folder / "experiment.toml")
    assert load(folder).episodes["learner"].unique(maintain_order=True).to_list() == [
        "q-learning/forgetting={decay=0.3}",
        "q-learning/forgetting={decay=0.5}",
    ]


def test_sarsa_runs_beside_q_learning_and_goes_on_where_it_was(tmp_path):
    changes: dict[str, Any] = {
        "learners": [{"name": "q-learning"}, {"name": "sarsa"}],
        "assistants": NONE,
    }
    folder = run_into(tmp_path / "out", trials=2, **changes)
    results = load(folder)
    assert ids_of(**changes) == ["none@name=q-learning", "none@name=sarsa"]
    assert results.episodes["learner"].unique(maintain_order=True).to_list() == [
        "q-learning",
        "sarsa",
    ]
    plan, reports = make_plan(make_experiment(settings(trials=3, **changes))), []
    assert [type(c.learner) for c in plan.conditions.values()][1] is Sarsa
    run_experiment(plan, folder, report=reports.append)
    assert [report.trials for report in reports] == [4, 5, 6]
    first, second = (
        rows["assisted_return"].to_list()
        for rows in load(folder).episodes.partition_by("learner", maintain_order=True)
    )
    assert first != second


def test_rules_over_rules_are_swept_over_in_both_tables_and_read_back(tmp_path):
    experiment = make_experiment(settings(assistants=[OVER]))
    ids = [
        f'budget/of={{name="stochastic-q-bumpers",alpha={alpha}}},per_episode={number}'
        for number in (1, 5)
        for alpha in (0.2, 0.4)
    ]
    assert [named.condition for named in experiment.conditions()] == ids
    assert experiment.condition_count() == 4
    folder = run_into(tmp_path, assistants=[OVER], trials=1)
    results = load(folder)
    assert results.experiment == load_experiment(folder / "experiment.toml")
    alphas = results.episodes.group_by("condition", maintain_order=True).agg(pl.first("alpha"))
    assert dict(alphas.iter_rows()) == dict(zip(ids, [0.2, 0.4] * 2, strict=True))
    most = results.episodes.group_by("condition", maintain_order=True).agg(pl.max("overrides"))
    found = zip(most["overrides"], [1, 1, 5, 5], strict=True)
    assert all(number <= limit for number, limit in found)
    assert len(cells_of(folder)) == 4 * 2


def test_a_rule_is_over_each_of_several_rules():
    bumpers = OVER["of"]
    over = {"name": "budget", "per_episode": 2, "of": ["maximal", bumpers]}
    assert ids_of(assistants=[over]) == [
        'budget/of={name="maximal"},per_episode=2',
        'budget/of={name="stochastic-q-bumpers",alpha=0.2},per_episode=2',
        'budget/of={name="stochastic-q-bumpers",alpha=0.4},per_episode=2',
    ]


class Limits(NamedTuple):
    limits: tuple[float, ...] = (0.0, 1.0)


def test_an_option_that_is_a_tuple_is_a_list_in_files_and_swept_over_as_a_list_of_lists(
    own_registry, tmp_path
):
    register_assistant("watch", Limits)(watch)
    one = make_experiment(settings(assistants=[{"name": "watch", "limits": [0.5, 2.0, 3.0]}]))
    assert [named.assistant.options.limits for named in one.conditions()] == [(0.5, 2.0, 3.0)]
    many = [{"name": "watch", "limits": [[0.5, 2.0], [1.0, 4.0]]}]
    assert ids_of(assistants=many) == ["watch/limits=0.5-2", "watch/limits=1-4"]
    folder = run_into(tmp_path, assistants=many, trials=1)
    assert load(folder).experiment == make_experiment(settings(assistants=many, trials=1))
