"""What simulations find: outcomes by episode, counts by state, and records of single steps."""

from typing import NamedTuple

import numpy as np


class Outcomes(NamedTuple):
    """What happened, by trial and episode.

    Attributes:
        assisted_return: float64 [T, E], undiscounted, of the training episode with help.
        unassisted_return: float64 [T, E], of the greedy episode without help that follows it.
        assisted_length: int32 [T, E], steps.
        unassisted_length: int32 [T, E], steps.
        overrides: int32 [T, E], steps on which another action than the learner's was executed.
        assisted_events: uint8 [T, E], bits of `qbumpers.tasks.dynamics` that occurred.
        unassisted_events: uint8 [T, E].
    """

    assisted_return: np.ndarray
    unassisted_return: np.ndarray
    assisted_length: np.ndarray
    unassisted_length: np.ndarray
    overrides: np.ndarray
    assisted_events: np.ndarray
    unassisted_events: np.ndarray


class StateCounts(NamedTuple):
    """How often each state was acted in, over all trials and episodes.

    Attributes:
        assisted: int64 [S], steps of training episodes.
        overridden: int64 [S], those of them on which the learner was overridden.
        unassisted: int64 [S], steps of greedy episodes.
    """

    assisted: np.ndarray
    overridden: np.ndarray
    unassisted: np.ndarray


class Steps(NamedTuple):
    """Arrays [N] of step records, in order; `decisions.Step` says what each means.

    `state` is where the step began and `next_state` where it led, numbers [N] or vectors [N, D];
    `events` are bits of `qbumpers.tasks.dynamics`; `values` is [N, A]; `episode` counts from 0.
    """

    episode: np.ndarray
    state: np.ndarray
    next_state: np.ndarray
    events: np.ndarray
    proposed: np.ndarray
    executed: np.ndarray
    credited: np.ndarray
    overridden: np.ndarray
    probability: np.ndarray
    coin: np.ndarray
    tie: np.ndarray
    values: np.ndarray
    projected_return: np.ndarray
    reward: np.ndarray


class Script(NamedTuple):
    """Recorded proposals and noise, to be played again instead of drawing new ones: arrays [N]."""

    proposed: np.ndarray
    coin: np.ndarray
    tie: np.ndarray


class Simulation(NamedTuple):
    """What a simulation found.

    Attributes:
        outcomes: by trial and episode, arrays [T, E].
        counts: by state, over all trials; None where observations are vectors.
    """

    outcomes: Outcomes
    counts: StateCounts | None

    @property
    def steps(self) -> int:
        """Steps that the learners took, with help and without."""
        return int(self.outcomes.assisted_length.sum() + self.outcomes.unassisted_length.sum())
