"""A learner that copies what is executed: behavioural cloning with counts.

In every state it counts the actions that it saw executed, its own ones that nobody replaced too,
and means to do the most frequent one (the maximum-likelihood policy of behavioural cloning, Bain
and Sammut 1995, taken at its mode). It explores by epsilon; in a state in which it saw nothing all
counts are equal, and every action is alike. Rewards mean nothing to it.

It is the opposite of a learner with the perception `transition`, who takes what the assistant did
for its own doing: it must see what was executed. So its perception is `observant` if none is named,
and one that never shows it the executed action is refused. After a step that was taken back it
counts what was executed before that: an assistant that undoes shows it mistakes.
"""

from typing import NamedTuple

import numpy as np

from qbumpers.borrowing import row
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Rates, Shape, Table, Transition
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled


class Imitator(NamedTuple):
    """Copies the action that was executed most often; needs a perception that shows it.

    Attributes:
        epsilon: probability of a random action, by episode.
    """

    epsilon: Schedule = Schedule()


@compiled
def start(settings: Imitator, shape: Shape, stream: np.ndarray) -> Table:
    """Nothing counted."""
    return Table(np.zeros((shape.states, len(shape.width))), shape.width)


@compiled
def begin(settings: Imitator, memory: Table, episode: int, episodes: int) -> Rates:
    """Exploration of an episode."""
    return Rates(scheduled(settings.epsilon, episode, episodes), 0.0)


@compiled
def learn(
    settings: Imitator, memory: Table, transition: Transition, rates: Rates, stream: np.ndarray
) -> None:
    """Count the credited action."""
    counts = row(memory.values, transition.state, memory.width)
    counts[transition.action] += 1.0


register_learner(
    "imitator", Imitator, start=start, begin=begin, choose=q_learning.choose,
    prefer=q_learning.prefer, policy=q_learning.policy, learn=learn, imitates=True,
)  # fmt: skip
