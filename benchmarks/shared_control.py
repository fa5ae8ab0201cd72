"""What SharedControl.step adds to a step of the environment, in microseconds and as a ratio.

Times are of the processor, which a busy machine disturbs less than the clock on the wall.
"""

import time
from typing import Any

import gymnasium
import numpy as np
from measuring import Row, Target, Timed, alternate, compared, is_quick, show
from simulation import ASSISTANTS

from qbumpers import SharedControl, make_task, solve

TASK = "qbumpers/CliffWalking-v0"
CEILING = Target(15)
UNIT = "us"


def step_time(environment: gymnasium.Env[Any, Any], actions: list[int]) -> Timed:
    """Microseconds per step, resets not counted.

    Args:
        environment: to be stepped through.
        actions: of one round, over as many episodes as they last for.

    Returns:
        What measures it, given the number of the round.
    """

    def timed(seed: int) -> float:
        remaining, seconds = actions.copy(), 0.0
        environment.reset(seed=seed)
        while remaining:
            begin = time.process_time()
            _play(environment, remaining)
            seconds += time.process_time() - begin
            environment.reset()
        return seconds / len(actions) * 1e6

    return timed


def _play(environment: gymnasium.Env[Any, Any], actions: list[int]) -> None:
    """Take actions off the list until the episode or the list ends."""
    while actions:
        _, _, terminated, truncated, _ = environment.step(actions.pop())
        if terminated or truncated:
            return


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark."""
    rounds, steps = (2, 2_000) if quick else (15, 10_000)
    task = make_task("cliff-walking")
    values = solve(task)
    actions = np.random.default_rng(0).integers(0, task.actions, steps).tolist()
    timed = {"bare": step_time(gymnasium.make(TASK), actions)}
    for name, assistant in ASSISTANTS.items():
        environment = SharedControl(gymnasium.make(TASK), assistant, values)
        timed[name] = step_time(environment, actions)
    alternate(timed, 1)  # the first steps of a process are slow
    times = alternate(timed, rounds)
    bare = times.pop("bare")
    return [row for name, wrapped in times.items() for row in _rows(name, wrapped, bare)]


def _rows(name: str, wrapped: list[float], bare: list[float]) -> list[Row]:
    added = [step - alone for step, alone in zip(wrapped, bare, strict=True)]
    title = f"SharedControl.step, {name}"
    return [
        compared(title, wrapped, UNIT, "bare environment", bare),
        compared("  of it added", added, UNIT, "bare environment", bare, CEILING),
    ]


if __name__ == "__main__":
    show("Shared control", measure(is_quick(__doc__)))
