"""What runs on a card: one trial in each thread, by the loops of `qbumpers.simulation.loops`."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda

from qbumpers.borrowing import read_only
from qbumpers.compilation import inlined
from qbumpers.simulation.cuda.layout import Space, open_scratch, own_part
from qbumpers.simulation.loops import (
    Assistance,
    LearnerStack,
    Minds,
    TrialStreams,
    begin_streams,
    run_episodes,
)
from qbumpers.simulation.outcomes import Sinks, StateCounts
from qbumpers.tasks.dynamics import Dynamics

cuda: Any = numba_cuda


class Found(NamedTuple):
    """What a block of T trials finds, beside its outcomes.

    Attributes:
        totals: `StateCounts` of arrays int64 [G, S], added to.
        groups: int32 [T], of which group of trials each is.
        finished: uint8 [T], whether a trial came to its end; what is raised in one ends its thread.
    """

    totals: StateCounts
    groups: Any
    finished: Any


@inlined
def _shown(assistance: Assistance) -> Assistance:
    """An assistant with values that its rule cannot change."""
    return Assistance(
        read_only(assistance.values), read_only(assistance.others), assistance.seen,
        assistance.discount, assistance.options, assistance.width,
    )  # fmt: skip


def trial_of_thread(space: Space) -> Callable[..., None]:
    """The function that a card runs, in Python that is to be compiled for it.

    Args:
        space: near memory of each trial.
    """
    desk_words, scratch_words = space

    def run_trial(
        dynamics: Dynamics, assistance: Assistance, learner: LearnerStack, minds: Minds,
        streams: tuple[np.ndarray], retention: int, sinks: Sinks, found: Found,
    ) -> None:  # fmt: skip
        """The trial whose place in the block is the number of the thread."""
        trial = cuda.grid(1)
        if trial >= found.finished.shape[0]:
            return
        desk = cuda.local.array(desk_words, np.float64)
        scratch = cuda.local.array(scratch_words, np.float64)
        own_streams = cuda.local.array((4, 4), np.uint64)
        open_scratch(scratch)
        trial_streams = TrialStreams(streams[0], own_streams)
        begin_streams(trial_streams, trial, 0)
        own = own_part(sinks, desk, trial)
        run_episodes(
            dynamics, _shown(assistance), own_part(learner, desk, trial),
            own_part(minds, desk, trial), trial_streams, trial, retention, own, 0,
        )  # fmt: skip
        group = found.groups[trial]
        for state in range(own.counts.assisted.shape[0]):
            cuda.atomic.add(found.totals.assisted, (group, state), own.counts.assisted[state])
            cuda.atomic.add(found.totals.overridden, (group, state), own.counts.overridden[state])
            cuda.atomic.add(found.totals.unassisted, (group, state), own.counts.unassisted[state])
        found.finished[trial] = 1

    return run_trial
