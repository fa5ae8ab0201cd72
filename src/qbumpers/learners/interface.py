"""What hosts and learners hand each other; `qbumpers.learners.registry` says which gets what."""

from typing import Any, NamedTuple

import numpy as np


class Shape(NamedTuple):
    """The size of what a learner learns.

    Attributes:
        states: S, numbered states; 0 if observations are vectors.
        observation_size: D, numbers of an observation; 0 if states are numbered.
        width: a tuple of A integers; its length tells the compiler the number of actions A, see
            `qbumpers.borrowing.row`.
    """

    states: int
    observation_size: int
    width: tuple[int, ...]


class Transition(NamedTuple):
    """What a learner believes happened on one step.

    Attributes:
        state: where the step began: its number, or the observation, float32 [D].
        action: the action that it credits; -1 if it learns nothing.
        reward: what it believes it received, in reward units.
        next_state: where it believes the action led.
        terminated: whether the episode ended there for good; a truncation is no end.
        next_action: the action that it proposed next, if a record tells; else -1.
    """

    state: Any
    action: int
    reward: float
    next_state: Any
    terminated: bool
    next_action: int


class Rates(NamedTuple):
    """The numbers of one episode of a learner that explores and has a step size.

    Attributes:
        epsilon: probability of a random action.
        learning_rate: step size.
    """

    epsilon: float
    learning_rate: float


class Table(NamedTuple):
    """The memory of a learner that learns a table.

    Attributes:
        values: float64 [S, A], its action values.
        width: as in `Shape`.
    """

    values: np.ndarray
    width: tuple[int, ...]
