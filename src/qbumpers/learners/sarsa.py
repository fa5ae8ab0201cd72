"""SARSA (Rummery and Niranjan 1994; Sutton and Barto 2018, Section 6.4).

It learns from its own next action, so that its values contain its exploration.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.epsilon_greedy import epsilon_greedy
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.q_learning import q_update
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled
from qbumpers.random_streams import draw

_NONE = -1


class Sarsa(NamedTuple):
    """A tabular learner of SARSA; its fields are those of `QLearner`.

    Attributes:
        discount: gamma of the learner's own values, in (0, 1].
        epsilon: probability of a random action, by episode.
        learning_rate: step size, by episode.
        initial_value: what every action in every state is worth at first, in reward units.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    epsilon: Schedule = Schedule()
    learning_rate: Schedule = Schedule()
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class SarsaMemory(NamedTuple):
    """The memory of a learner of SARSA.

    Attributes:
        values: float64 [S, A], its action values.
        width: as in `Shape`.
        next_choice: int64 [2], the state in which an action was chosen ahead, and that action; -1
            if none was.
    """

    values: np.ndarray
    width: tuple[int, ...]
    next_choice: np.ndarray


@compiled
def start(settings: Sarsa, shape: Shape, stream: np.ndarray) -> SarsaMemory:
    """A table in which every action has the initial value, and nothing chosen ahead."""
    values = np.full((shape.states, len(shape.width)), settings.initial_value)
    return SarsaMemory(values, shape.width, np.full(2, _NONE))


@compiled
def begin(settings: Sarsa, memory: SarsaMemory, episode: int, episodes: int) -> Rates:
    """Exploration and step size of an episode; what was chosen ahead in the last one is dropped."""
    memory.next_choice[0] = _NONE
    return Rates(
        scheduled(settings.epsilon, episode, episodes),
        scheduled(settings.learning_rate, episode, episodes),
    )


@compiled
def choose(
    settings: Sarsa, memory: SarsaMemory, state: int, rates: Rates, stream: np.ndarray
) -> int:
    """The action chosen ahead in this state; an epsilon-greedy one if none was."""
    ahead = memory.next_choice[0] == state
    memory.next_choice[0] = _NONE
    if ahead:
        return memory.next_choice[1]
    values = row(memory.values, state, memory.width)
    return epsilon_greedy(values, rates.epsilon, draw(stream), draw(stream))


@compiled
def learn(
    settings: Sarsa, memory: SarsaMemory, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Choose the next action, and move the credited one towards its reward and that one's value."""
    future = 0.0
    if not transition.terminated:
        following = row(memory.values, transition.next_state, memory.width)
        next_action = transition.next_action
        if next_action < 0:
            next_action = epsilon_greedy(following, rates.epsilon, draw(stream), draw(stream))
        memory.next_choice[0] = transition.next_state
        memory.next_choice[1] = next_action
        future = settings.discount * following[next_action]
    values = row(memory.values, transition.state, memory.width)
    values[transition.action] = q_update(
        values[transition.action], transition.reward, future, rates.learning_rate
    )


register_learner(
    "sarsa", Sarsa, start=start, begin=begin, choose=choose, prefer=q_learning.prefer,
    policy=q_learning.policy, learn=learn,
)  # fmt: skip
