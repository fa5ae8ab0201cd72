"""The imitator copies what was executed, and is never simulated without seeing it."""

import pytest

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.learners import Imitator, Perception, QLearner, dispatch, learners, register_learner
from qbumpers.learners import imitator as module
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.random_streams import trial_streams
from qbumpers.simulation import make_condition, record
from qbumpers.tasks import cliff_walking
from tests.experiments.examples import settings

STREAM = trial_streams(5, {"test": "imitator"}, range(1))[0, 0]
BLIND = [
    "transition",
    "interruption",
    "transition-disruption",
    Perception(0.0, "executed"),
    Perception(1.0, "proposed"),
]
SEEING = ["observant", "disruption", Perception(0.1, "executed")]


def test_the_most_frequent_action_is_copied_whatever_it_brought():
    learner = Imitator()
    memory = dispatch.start(learner, Shape(2, 0, (0, 0, 0)), STREAM)
    for action, reward in ((1, -100.0), (2, 50.0), (1, -100.0)):
        happened = Transition(0, action, reward, 1, False, -1)
        dispatch.learn(learner, memory, happened, Rates(0.5, 0.0), STREAM)
    assert {dispatch.prefer(learner, memory, 0, tie) for tie in (0.0, 0.9)} == {1}
    assert {dispatch.prefer(learner, memory, 1, tie) for tie in (0.0, 0.4, 0.9)} == {0, 1, 2}
    assert memory.values.tolist() == [[0, 2, 1], [0, 0, 0]]


def test_who_copies_a_perfect_assistant_does_as_well_without_it():
    found = simulate(cliff_walking(), "maximal", learner=Imitator(), trials=20, episodes=5)
    assert (found.outcomes.assisted_return == 87.0).all()
    assert (found.outcomes.unassisted_return == 87.0).all()  # 13 steps, the last one worth 99


def test_executed_actions_are_credited_if_no_perception_is_named():
    condition = make_condition(cliff_walking(), "maximal", learner=Imitator(), episodes=3)
    assert condition.perception == "observant"
    steps = record(condition, trial=0, seed=1)
    assert steps.overridden.any()
    assert (steps.credited == steps.executed).all()
    assert make_condition(cliff_walking(), "maximal", learner=QLearner()).perception == "transition"


@pytest.mark.parametrize("perception", BLIND)
def test_who_could_not_see_what_is_executed_is_refused(perception):
    with pytest.raises(RequestError, match=r"perception = .*imitator copies what was executed"):
        make_condition(
            cliff_walking(), make_assistant("maximal"), learner=Imitator(), perception=perception
        )


@pytest.mark.parametrize("perception", SEEING)
def test_who_sees_it_is_simulated(perception):
    condition = make_condition(
        cliff_walking(), "maximal", learner=Imitator(), perception=perception
    )
    assert condition.perception == perception


def test_so_it_is_in_files():
    learner = {"name": "imitator"}
    experiment = make_experiment(settings(learners=[learner, {"name": "q-learning"}]))
    assert [each.perception for each in experiment.learners] == ["observant", "transition"]
    assert make_experiment(experiment.model_dump(exclude_none=True)) == experiment
    wrong = make_experiment(settings(learners=[{**learner, "perception": "transition"}]))
    with pytest.raises(RequestError, match="perception = 'transition'; learner imitator"):
        make_plan(wrong)


def test_so_it_is_with_imitators_of_ones_own(own_registry):
    kind = register_learner(
        "own imitator", Imitator, start=module.start, begin=module.begin,
        choose=module.q_learning.choose, prefer=module.q_learning.prefer,
        policy=module.q_learning.policy, learn=module.learn, imitates=True,
    )  # fmt: skip
    assert learners()["own imitator"].imitates
    assert make_condition(cliff_walking(), "none", learner=kind()).perception == "observant"
