"""Conditions that need every part of what runs on a card, and rules and learners with errors."""

from typing import Any, NamedTuple

import numpy as np

from qbumpers import make_assistant, register_assistant
from qbumpers.conformance import small_tasks, small_values
from qbumpers.decisions import Decision
from qbumpers.learners import (
    Motor,
    Perception,
    PowerLaw,
    learners,
    make_learner,
    register_learner,
)
from qbumpers.learners import q_learning as q
from qbumpers.simulation import make_condition
from tests.assistants.examples import EXAMPLES

SEED = 5
OF_STATES = [name for name, learner in learners().items() if learner.observes == "states"]
LAYERS: dict[str, dict[str, Any]] = {
    "a share is forgotten": {"forgetting": 0.1, "motor": Motor(slip=0.2, lag=0.3)},
    "old practice is forgotten": {"forgetting": PowerLaw(), "retention": 1},
    "perception by chance": {"perception": Perception(0.4, "executed", 1.5)},
    "streams begin anew": {"common_random_numbers": True, "perception": "interruption"},
}


class NoOptions(NamedTuple):
    pass


class ExampleSettings(NamedTuple):
    discount: float = 1.0
    epsilon: q.Schedule = q.Schedule()
    learning_rate: q.Schedule = q.Schedule()
    initial_value: float = 0.0


def with_rule(name, **setup):
    """A small trial with a rule of the package."""
    assistant = make_assistant(name, **EXAMPLES[name])
    task = next(task for task in small_tasks(assistant) if task.states)
    given: dict[str, Any] = {
        "values": small_values(task, assistant),
        "episodes": 3,
        "retention": 1,
        **setup,
    }
    return make_condition(task, assistant, **given)


def with_learner(name, **setup):
    """A small trial at Cliff Walking with a kind of learner."""
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7)
    given: dict[str, Any] = {"learner": make_learner(name), "episodes": 3, **setup}
    return make_condition("cliff-walking", bumpers, **given)


def register_wrong_action():
    def ninth(situation, noise, options):
        return Decision(9 if noise.coin < 0.1 else situation.proposed, 0.1)

    register_assistant("wrong action", NoOptions)(ninth)
    return make_assistant("wrong action")


def register_wrong_probability():
    def double(situation, noise, options):
        return Decision(situation.proposed, 2.0 if noise.coin < 0.1 else 0.0)

    register_assistant("wrong probability", NoOptions)(double)
    return make_assistant("wrong probability")


def register_raising():
    def raising(situation, noise, options):
        if noise.coin < 0.1:
            raise ValueError("this rule has had enough")
        return Decision(situation.proposed, 0.0)

    register_assistant("raising", NoOptions)(raising)
    return make_assistant("raising")


def register_allocating():
    def allocating(situation, noise, options):
        better = situation.values > situation.values[situation.proposed]
        return Decision(situation.proposed, 0.0 if better.any() else 0.1)

    register_assistant("allocating", NoOptions)(allocating)
    return make_assistant("allocating")


def register_sorting():
    def sorting(situation, noise, options):
        return Decision(situation.proposed, 0.0 * np.sort(situation.values)[0])

    register_assistant("sorting", NoOptions)(sorting)
    return make_assistant("sorting")


def register_wrong_learner():
    def choose(settings, memory, state, rates, stream):
        return 9

    return register_learner(
        "wrong learner", ExampleSettings, start=q.start, begin=q.begin, choose=choose,
        prefer=q.prefer, policy=q.policy, learn=q.learn,
    )()  # fmt: skip


def register_drawing_learner():
    """A learner that draws what it begins with."""

    def start(settings, shape, stream):
        values = np.zeros((shape.states, len(shape.width)))
        values[0, 0] = q.draw(stream)
        return q.Table(values, shape.width)

    return register_learner(
        "drawing", ExampleSettings, start=start, begin=q.begin, choose=q.choose, prefer=q.prefer,
        policy=q.policy, learn=q.learn,
    )()  # fmt: skip


def assert_same_steps(found, expected):
    """Every step is the same; probabilities differ by the rounding of an exponential at most."""
    for field, one, other in zip(expected._fields, found, expected, strict=True):
        tolerance = 1e-12 if field == "probability" else 0.0
        np.testing.assert_allclose(one, other, rtol=0, atol=tolerance, err_msg=field)
