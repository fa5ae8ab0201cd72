"""Tabular Q-learning with epsilon-greedy exploration and the paper's schedules (Section 4.2)."""

from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.learners.epsilon_greedy import epsilon_greedy, epsilon_greedy_policy, greedy
from qbumpers.learners.interface import Rates, Shape, Table, Transition
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled
from qbumpers.random_streams import draw


class QLearner(NamedTuple):
    """A tabular Q-learner (Watkins 1989).

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


@compiled
def start(settings: QLearner, shape: Shape, stream: np.ndarray) -> Table:
    """A table in which every action has the initial value."""
    values = np.full((shape.states, len(shape.width)), settings.initial_value)
    return Table(values, shape.width)


@compiled
def begin(settings: QLearner, memory: Table, episode: int, episodes: int) -> Rates:
    """Exploration and step size of an episode."""
    return Rates(
        scheduled(settings.epsilon, episode, episodes),
        scheduled(settings.learning_rate, episode, episodes),
    )


@compiled
def choose(settings: QLearner, memory: Table, state: int, rates: Rates, stream: np.ndarray) -> int:
    """An epsilon-greedy action."""
    values = row(memory.values, state, memory.width)
    return epsilon_greedy(values, rates.epsilon, draw(stream), draw(stream))


@compiled
def policy(settings: QLearner, memory: Table, state: int, rates: Rates, out: np.ndarray) -> None:
    """The probabilities of `choose`."""
    epsilon_greedy_policy(row(memory.values, state, memory.width), rates.epsilon, out)


@compiled
def prefer(settings: QLearner, memory: Table, state: int, tie: float) -> int:
    """A greedy action."""
    return greedy(row(memory.values, state, memory.width), tie)


@compiled
def q_update(old: float, reward: float, next_value: float, learning_rate: float) -> float:
    """The new value of an action: old + rate * (reward + next_value - old).

    Args:
        old: value of the credited action.
        reward: as perceived.
        next_value: discounted value of the next state; 0 if it is terminal.
        learning_rate: step size in [0, 1].

    Returns:
        The new value, in reward units.
    """
    return old + learning_rate * (reward + next_value - old)


@compiled
def best_future(memory: Any, transition: Transition, discount: float) -> float:
    """Discounted value of the best action where a step led; 0 after an end.

    Args:
        memory: with action values, `values` float64 [S, A] and their `width`, as in `Shape`.
        transition: the step.
        discount: gamma of the learner's own values.

    Returns:
        The value, in reward units.
    """
    if transition.terminated:
        return 0.0
    return discount * best_value(row(memory.values, transition.next_state, memory.width))


@compiled
def learn(
    settings: QLearner, memory: Table, transition: Transition, rates: Rates, stream: np.ndarray
) -> None:
    """Move the credited action towards its reward and the best value of where it led."""
    future = best_future(memory, transition, settings.discount)
    values = row(memory.values, transition.state, memory.width)
    values[transition.action] = q_update(
        values[transition.action], transition.reward, future, rates.learning_rate
    )


register_learner(
    "q-learning", QLearner, start=start, begin=begin, choose=choose, prefer=prefer, policy=policy,
    learn=learn,
)  # fmt: skip
