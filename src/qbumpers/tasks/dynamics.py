"""A tabular task as loops step through it, compiled or not."""

from typing import NamedTuple

import numpy as np

from qbumpers.compilation import compiled_apart, inlined

TERMINATED, SUCCESS, CRASH, TRUNCATED, LIMIT = 1, 2, 4, 8, 16
"""Bits of the events of a step.

TRUNCATED if an environment stops by itself, not at its end; LIMIT if the step limit is reached.
"""

ENDS = TERMINATED | TRUNCATED | LIMIT
"""The bits that tell the end of an episode."""


class Dynamics(NamedTuple):
    """A task laid out flat: outcome k of action a in state s is at index (s A + a) K + k.

    Attributes:
        next_state: int64 [S A K].
        reward: float64 [S A K].
        cumulative: float64 [S A K], probability of this outcome or an earlier one.
        events: uint8 [S A K], bits TERMINATED, SUCCESS and CRASH.
        actions: A.
        outcomes: K.
        start_states: int64 [N], where episodes start.
        start_cumulative: float64 [N].
        episode_limit: steps after which an episode is truncated.
    """

    next_state: np.ndarray
    reward: np.ndarray
    cumulative: np.ndarray
    events: np.ndarray
    actions: int
    outcomes: int
    start_states: np.ndarray
    start_cumulative: np.ndarray
    episode_limit: int


@inlined
def sample(cumulative: np.ndarray, first: int, count: int, chance: float) -> int:
    """Index of the outcome that `chance` falls on.

    Args:
        cumulative: float64, cumulative probabilities; those in question end at 1.
        first: index of the first outcome in question.
        count: how many there are.
        chance: uniform in [0, 1).

    Returns:
        An index in [first, first + count).
    """
    index = first
    while index < first + count - 1 and chance >= cumulative[index]:
        index += 1
    return index


@inlined
def first_state(dynamics: Dynamics, chance: float) -> int:
    """The state that an episode starts in; `chance` is uniform in [0, 1)."""
    return dynamics.start_states[
        sample(dynamics.start_cumulative, 0, len(dynamics.start_states), chance)
    ]


@inlined
def transition(dynamics: Dynamics, state: int, action: int, chance: float) -> int:
    """Index of what follows an action; `chance` is uniform in [0, 1)."""
    first = (state * dynamics.actions + action) * dynamics.outcomes
    return sample(dynamics.cumulative, first, dynamics.outcomes, chance)


@compiled_apart
def finite(reward: float, observation: np.ndarray) -> bool:
    """Whether a reward and every number of an observation [D] are finite."""
    found = np.isfinite(reward)
    for i in range(len(observation)):
        found = found and np.isfinite(observation[i])
    return found
