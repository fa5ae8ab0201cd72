"""What simulations find: outcomes by episode, counts by state, and records of single steps."""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.decisions import Step


class Outcomes(NamedTuple):
    """What happened, by trial and episode.

    Attributes:
        assisted_return: float64 [T, E], undiscounted, of the assisted training episode.
        unassisted_return: float64 [T, E], of the greedy unassisted episode that follows it.
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


class TrialMeans(NamedTuple):
    """Means of each trial over its training episodes: float64 [T], see `Outcomes`.

    Attributes:
        assisted_return: of the assisted episodes.
        unassisted_return: of the greedy unassisted ones.
        assisted_length: in steps.
        unassisted_length: in steps.
        overrides: in steps.
    """

    assisted_return: np.ndarray
    unassisted_return: np.ndarray
    assisted_length: np.ndarray
    unassisted_length: np.ndarray
    overrides: np.ndarray


def trial_means(outcomes: Outcomes, training: int) -> TrialMeans:
    """Means of each trial.

    Args:
        outcomes: by trial and episode.
        training: how many of the episodes, from the first one on, are training.
    """
    return TrialMeans(
        *(getattr(outcomes, name)[:, :training].mean(axis=1) for name in TrialMeans._fields)
    )


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


class Script(NamedTuple):
    """Recorded proposals and noise, to be played again instead of drawing new ones: arrays [N]."""

    proposed: np.ndarray
    coin: np.ndarray
    tie: np.ndarray


class Sinks(NamedTuple):
    """What a simulation fills, and what it plays again.

    Attributes:
        outcomes: `Outcomes` of arrays [T, E].
        counts: `StateCounts`, added to; or None.
        record: `Step` of arrays [N], as many as there can be steps of training, filled; or None.
        script: `Script` to be played again; or None.
    """

    outcomes: Any
    counts: Any
    record: Any
    script: Any


def room_for_steps(most: int, state: np.ndarray, actions: int) -> Step:
    """A table of steps to be filled.

    Args:
        most: N, how many steps it can hold.
        state: a state as the table keeps it: int64 [], or float32 [D].
        actions: A.

    Returns:
        `Step` of arrays [N].
    """
    whole = {name: np.zeros(most, np.int64) for name in ("episode", "proposed", "executed")}
    real = {name: np.zeros(most) for name in ("probability", "coin", "tie", "reward")}
    return Step(
        **whole,
        **real,
        credited=np.zeros(most, np.int64),
        undone=np.zeros(most, np.bool_),
        overridden=np.zeros(most, np.bool_),
        projected_return=np.zeros(most),
        values=np.zeros((most, actions)),
        state=np.zeros((most, *state.shape), state.dtype),
        next_state=np.zeros((most, *state.shape), state.dtype),
        events=np.zeros(most, np.uint8),
    )


class Simulation(NamedTuple):
    """What a simulation found.

    Attributes:
        outcomes: by trial and episode, arrays [T, E].
        counts: by state, over all trials; None if observations are vectors.
    """

    outcomes: Outcomes
    counts: StateCounts | None

    @property
    def steps(self) -> int:
        """Steps that the learners took, assisted and unassisted."""
        return int(self.outcomes.assisted_length.sum() + self.outcomes.unassisted_length.sum())


def joined(blocks: list[Simulation]) -> Simulation:
    """Blocks of trials, one after another."""
    outcomes = Outcomes(*map(np.concatenate, zip(*(b.outcomes for b in blocks), strict=True)))
    counts = [block.counts for block in blocks if block.counts is not None]
    if not counts:
        return Simulation(outcomes, None)
    sums = map(np.sum, zip(*counts, strict=True), (0, 0, 0))
    return Simulation(outcomes, StateCounts(*sums))
