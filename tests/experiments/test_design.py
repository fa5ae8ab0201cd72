"""Experiments as data: from TOML to conditions with readable, unique ids."""

from itertools import product

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.assistants import make_assistant
from qbumpers.experiments.design import AssistantDesign, condition_id
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.learners.q_learning import scheduled
from tests.experiments.examples import ids_of, settings


def design_of(name, **options):
    return AssistantDesign.model_validate({"name": name, **options})


EVERYTHING = """
name = "my-lake_2.0"
reproduces = "cliff-walking"
values = "q-learning"
trials = 7
episodes = 9
retention = 3
criterion = -20
common_random_numbers = true
seed = 11

[task]
name = "FrozenLake-v1"
discount = 0.9
episode_limit = 30
arguments = { is_slippery = true, map_name = "8x8" }

[[learners]]
name = "q-learning"
perception = "observant"
discount = 0.8
epsilon = { start = 0.9, end = 0.1, fraction = 0.5 }
learning_rate = { start = 0.7, end = 0.2, fraction = 0.25 }
initial_value = -1.5
penalty = 2.5

[[assistants]]
name = "none"

[[assistants]]
name = "stochastic-q-bumpers"
alpha = [0.2, 1]
second = [true, false]
p_max = 0.9
"""


def ids(*assistants):
    return ids_of(assistants=list(assistants))


def test_every_field_is_read_from_toml(tmp_path):
    path = tmp_path / "experiment.toml"
    path.write_text(EVERYTHING, encoding="utf-8")
    experiment = load_experiment(path)
    assert experiment.name == "my-lake_2.0"
    assert experiment.reproduces == "cliff-walking"
    assert experiment.values == "q-learning"
    assert (experiment.trials, experiment.episodes, experiment.seed) == (7, 9, 11)
    assert (experiment.retention, experiment.common_random_numbers) == (3, True)
    assert experiment.criterion == -20.0
    task, [learner] = experiment.task, experiment.learners
    assert (task.name, task.discount, task.episode_limit) == ("FrozenLake-v1", 0.9, 30)
    assert task.arguments == {"is_slippery": True, "map_name": "8x8"}
    assert (learner.name, learner.perception) == ("q-learning", "observant")
    made = learner.learner(task_discount=0.9)
    assert tuple(made.epsilon) == (0.9, 0.1, 0.5)
    assert tuple(made.learning_rate) == (0.7, 0.2, 0.25)
    assert (made.discount, made.initial_value, learner.penalty) == (0.8, -1.5, 2.5)


def test_what_is_written_reads_back_as_the_same_experiment(tmp_path):
    path = tmp_path / "experiment.toml"
    path.write_text(EVERYTHING, encoding="utf-8")
    experiment = load_experiment(path)
    again = tmp_path / "again.toml"
    again.write_text(tomli_w.dumps(experiment.model_dump(exclude_none=True)), encoding="utf-8")
    assert load_experiment(again) == experiment


def test_the_defaults_are_the_papers_learner():
    experiment = make_experiment(
        {"name": "x", "task": "cliff-walking", "assistants": [{"name": "none"}]}
    )
    [design] = experiment.learners
    learner = design.learner(task_discount=1.0)
    assert (design.name, design.perception, design.penalty) == ("q-learning", "transition", 1.0)
    assert (experiment.retention, experiment.criterion) == (0, None)
    assert experiment.common_random_numbers is False
    assert (experiment.trials, experiment.episodes, experiment.values) == (100, 100, "exact")
    assert (learner.discount, learner.initial_value) == (1.0, 0.0)
    for schedule in (learner.epsilon, learner.learning_rate):
        # 1 -> 0.02 over the first 90 of 100 episodes.
        by_episode = [scheduled(schedule, episode, 100) for episode in (0, 45, 89, 90, 99)]
        assert by_episode == pytest.approx([1.0, 0.51, 1 - 0.98 * 89 / 90, 0.02, 0.02])


def test_a_learner_has_the_tasks_discount_unless_told_otherwise():
    assert make_experiment(settings()).learners[0].learner(0.75).discount == 0.75
    own = make_experiment(settings(learners=[{"discount": 0.5}]))
    assert own.learners[0].learner(0.75).discount == 0.5


def test_a_task_by_its_name_alone_is_a_task_without_arguments():
    by_name = make_experiment(settings(task="cliff-walking"))
    assert by_name == make_experiment(settings(task={"name": "cliff-walking"}))


def test_listed_options_are_swept_with_the_last_one_fastest():
    design = design_of(
        "stochastic-q-bumpers", alpha=[0.4, 0.2], v_min=-5.0, second=[True, False], p_max=[0.9]
    )
    made = [assistant.options for assistant in design.assistants()]
    assert [(o.alpha, o.second) for o in made] == list(product([0.4, 0.2], [True, False]))
    assert {(o.v_min, o.p_max) for o in made} == {(-5.0, 0.9)}


def test_the_order_of_the_options_in_the_file_is_the_order_of_the_sweep():
    design = design_of("local-q-thresholding", second=[True, False], alpha=[0.4, 0.2])
    made = [(a.options.second, a.options.alpha) for a in design.assistants()]
    assert made == list(product([True, False], [0.4, 0.2]))


def test_an_id_holds_the_name_and_the_options_without_default():
    assert ids({"name": "stochastic-q-bumpers", "alpha": 0.7}) == ["stochastic-q-bumpers/alpha=0.7"]
    assert ids({"name": "none"}, {"name": "maximal"}) == ["none", "maximal"]


@pytest.mark.parametrize(
    ("alpha", "written"),
    [(1, "1"), (1.0, "1"), (0.0, "0"), (0.0195, "0.0195"), (1e-5, "1e-05"), (0.1 + 0.2, None)],
)
def test_numbers_in_ids_are_short_and_exact(alpha, written):
    [name] = ids({"name": "local-q-thresholding", "alpha": alpha})
    digits = name.removeprefix("local-q-thresholding/alpha=")
    assert digits == (written or repr(alpha))
    assert float(digits) == alpha


def test_an_option_that_is_the_same_for_all_of_a_kind_stays_out_of_their_ids():
    swept = {"name": "stochastic-q-bumpers", "alpha": [0.2, 0.4], "second": True, "p_max": 0.9}
    assert ids(swept) == ["stochastic-q-bumpers/alpha=0.2", "stochastic-q-bumpers/alpha=0.4"]


def test_an_option_that_varies_among_a_kind_is_in_its_ids_and_in_no_others():
    assert ids(
        {"name": "local-q-thresholding", "alpha": 0.2},
        {"name": "stochastic-q-bumpers", "alpha": 0.2, "second": [True, False]},
        {"name": "stochastic-q-bumpers", "alpha": 0.3},
    ) == [
        "local-q-thresholding/alpha=0.2",
        "stochastic-q-bumpers/alpha=0.2,second=true",
        "stochastic-q-bumpers/alpha=0.2,second=false",
        "stochastic-q-bumpers/alpha=0.3,second=false",
    ]


@given(
    alphas=st.lists(st.floats(0, 1).map(abs), min_size=1, max_size=6, unique=True),
    seconds=st.lists(st.booleans(), min_size=1, max_size=2, unique=True),
)
def test_ids_are_unique_and_say_what_they_stand_for(alphas, seconds):
    design = design_of("local-q-thresholding", alpha=alphas, second=seconds)
    assistants = design.assistants()
    names = [condition_id(assistant, assistants) for assistant in assistants]
    assert len(set(names)) == len(alphas) * len(seconds)
    for name, assistant in zip(names, assistants, strict=True):
        options = dict(part.split("=") for part in name.partition("/")[2].split(","))
        assert float(options["alpha"]) == assistant.options.alpha
        assert (
            options.get("second", str(seconds[0]).lower()) == str(assistant.options.second).lower()
        )


def test_assistants_are_those_of_the_registry():
    [named] = make_experiment(
        settings(assistants=[{"name": "stochastic-q-bumpers", "alpha": 0.7, "clip": False}])
    ).conditions()
    assert named.assistant == make_assistant("stochastic-q-bumpers", alpha=0.7, clip=False)
