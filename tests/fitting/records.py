"""Short records to be explained."""

import functools

import numpy as np

from qbumpers import make_assistant
from qbumpers.decisions import Step
from qbumpers.learners import Schedule, make_learner
from qbumpers.simulation import make_condition, record

ASSISTANT = make_assistant("stochastic-q-bumpers", alpha=0.5)
EPSILON, RATE = 0.2, 0.3


def constant(number):
    return Schedule(number, number, 0.0)


@functools.cache
def walked(learner, perception="transition", trial=0, episodes=10, assistant=ASSISTANT):
    """A trial at Cliff Walking of a learner with constant numbers."""
    settings = make_learner(learner)
    schedules = {"epsilon": constant(EPSILON), "learning_rate": constant(RATE)}
    known = {name: value for name, value in schedules.items() if name in settings._fields}
    condition = make_condition(
        "cliff-walking", assistant, learner=settings._replace(**known), perception=perception,
        episodes=episodes,
    )  # fmt: skip
    return record(condition, trial=trial)


def part(steps, count):
    """The first steps of a record."""
    return Step(*(column[:count] for column in steps))


def bandit(proposed):
    """Choices in a single state, each an episode; action 0 gives 1, action 1 nothing."""
    proposed = np.asarray(proposed)
    none = np.zeros(len(proposed))
    whole = none.astype(np.int64)
    return Step(
        episode=np.arange(len(proposed)), state=whole, proposed=proposed, executed=proposed,
        undone=whole.astype(bool), credited=proposed, overridden=whole.astype(bool),
        probability=none, coin=none, tie=none, values=np.zeros((len(proposed), 2)),
        projected_return=none, reward=np.where(proposed == 0, 1.0, 0.0), next_state=whole,
        events=whole + 1,
    )  # fmt: skip
