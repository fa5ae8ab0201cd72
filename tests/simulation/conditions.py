"""Tasks and conditions that the simulation's tests run."""

import numpy as np

from qbumpers.assistants import make_assistant, register_assistant
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import make_condition
from qbumpers.tasks import TabularTask, cliff_walking, make_task
from qbumpers.values import TabularValues
from tests.assistants.own_rules import (
    NoOptions,
    TakeBackOptions,
    follow_signs,
    no_sign,
    remember_signs,
    take_back,
)

BUMPERS = ("stochastic-q-bumpers", {"alpha": 0.7, "second": True})
MISLED = ("stochastic-q-bumpers", {"alpha": 0.6, "v_min": -3.0, "p_max": 0.9, "clip": False})
THRESHOLDS = ("local-q-thresholding", {"alpha": 0.0195, "second": True})


def on_the_cliff(assistant, *, episodes=12, **settings):
    name, options = assistant
    return make_condition(
        cliff_walking(), make_assistant(name, **options), episodes=episodes, **settings
    )


def taken_back(*, tolerance=1.5, **settings):
    """On the cliff with a rule that undoes, registered for this test."""
    register_assistant("take-back", TakeBackOptions, needs=("undo",))(take_back)
    return on_the_cliff(("take-back", {"tolerance": tolerance}), **settings)


def on_slippery_ice(**settings):
    task = make_task("FrozenLake-v1", discount=0.95, episode_limit=40, is_slippery=True)
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.8, v_min=-0.1)
    learner = QLearner(discount=0.95)
    return make_condition(task, assistant, episodes=40, learner=learner, **settings)


def in_a_random_world(assistant=MISLED, *, seen=None, **settings):
    """Nine states, three actions, three outcomes of each, several starts; values that mislead.

    Task, values and learner each have a discount of their own. `seen` is what the assistant sees of
    each state, int [9].
    """
    generator = np.random.default_rng(20190722)
    shape = (9, 3, 3)
    probability = generator.dirichlet(np.ones(3), shape[:2])
    probability[:4, :, 1] = 0  # an impossible outcome between two possible ones
    probability /= probability.sum(axis=2, keepdims=True)
    start = np.zeros(9)
    start[[1, 4, 6]] = 0.5, 0.25, 0.25
    task = TabularTask(
        name="random world",
        next_state=generator.integers(0, 9, shape),
        probability=probability,
        reward=generator.normal(size=shape),
        terminated=generator.random(shape) < 0.05,
        start=start,
        discount=0.9,
        episode_limit=25,
        success=generator.random(shape) < 0.1,
        crash=generator.random(shape) < 0.1,
        seen=seen,
    )
    told = 9 if seen is None else max(seen) + 1
    table = generator.normal(2, 1, (9, 3))[:told]
    values = TabularValues(table, 0.7, task.name, "drawn at random")
    learner = QLearner(
        discount=0.8,
        epsilon=Schedule(0.9, 0.1, 0.5),
        learning_rate=Schedule(0.5, 0.2, 1.0),
        initial_value=1.5,
    )
    usual = {"learner": learner, "perception": "transition-disruption", "penalty": 0.75}
    return make_condition(
        task,
        make_assistant(assistant[0], **assistant[1]),
        values=values,
        episodes=30,
        **{**usual, **settings},
    )


PAIRS = np.array([4, 0, 0, 1, 1, 2, 2, 3, 3])
"""States of the random world that look alike to the assistant."""


def half_seen(**settings):
    """A random world of whose states pairs look alike, with a rule that goes by what it is told.

    The rule stays registered.
    """
    register_assistant("signs", NoOptions, start=no_sign, observe=remember_signs)(follow_signs)
    return in_a_random_world(("signs", {}), seen=PAIRS, **settings)
