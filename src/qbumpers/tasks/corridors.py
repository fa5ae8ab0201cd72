"""Corridors of a few steps, a tabular task and a vector task: for checks that take no time."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.tasks.dynamics import SUCCESS, TERMINATED
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.vector import VectorTask

_APART = np.array([[0, 2, 1, 4], [2, 0, 1, 4], [1, 1, 0, 4], [4, 4, 4, 0]], float)


@functools.cache
def slippery_corridor() -> TabularTask:
    """Five cells and four actions: back, on (slips back 1 time in 4), stay, and back to the start.

    Every step costs 1; the last cell ends the episode with 10. As many actions as Cliff Walking
    has, so that loops are compiled once for both. Staying does nothing, and actions are as far
    apart as they lead, in cells; back to the start is as far from all others as can be.
    """
    transition = np.zeros((5, 4, 5))
    for cell in range(5):
        back, on = max(cell - 1, 0), min(cell + 1, 4)
        transition[cell, 0, back] += 1
        transition[cell, 1, on] += 0.75
        transition[cell, 1, back] += 0.25
        transition[cell, 2, cell] += 1
        transition[cell, 3, 0] += 1
    reward = np.full((5, 4, 5), -1.0)
    reward[:, :, 4] = 10
    last = np.arange(5) == 4
    task = TabularTask.from_arrays(
        transition, reward, last, start=0, discount=0.95, episode_limit=12, name="corridor",
        success=last,
    )  # fmt: skip
    return replace(task, no_op=2, action_distance=_APART)


class _Corridor:
    """A place in [0, 1] to be moved to its end."""

    def reset(self, chance: float) -> np.ndarray:
        self._place = 0.3 * chance
        return self._seen()

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        self._place = min(max(self._place + (0.2 if action else -0.1), 0.0), 1.0)
        arrived = self._place >= 1
        return self._seen(), 10.0 if arrived else -1.0, (TERMINATED | SUCCESS) * arrived

    def _seen(self) -> np.ndarray:
        return np.array([self._place, 1 - self._place], np.float32)

    def snapshot(self) -> float:
        return self._place

    def restore(self, snapshot: float) -> None:
        self._place = snapshot


def vector_corridor() -> VectorTask:
    """A corridor whose place is observed as two numbers."""
    return VectorTask(
        name="vector-corridor", make_stepper=_Corridor, make_environment=_no_environment,
        observation_size=2, actions=2, discount=0.9, episode_limit=12, settings={},
        has_success=True, has_crash=False, undoable=True, no_op=0,
    )  # fmt: skip


def _no_environment(render_mode: str | None = None) -> Any:
    raise RequestError("task vector-corridor: it is for checks alone and has no pictures")
