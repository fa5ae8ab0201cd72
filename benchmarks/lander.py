"""Steps of the lunar lander for simulators, against Gymnasium's class: the same numbers, sooner.

Both take the actions of the same episodes. Times are of the processor, which a busy machine
disturbs less than the clock on the wall.
"""

import functools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.envs.box2d.lunar_lander import LunarLander, heuristic
from measuring import Row, Timed, alternate, compared, is_quick, show

from qbumpers.tasks.lunar_lander.stepper import Lander

SEED = 0
UNIT = "us"
_LIMIT = 1000
_ERRORS = 0.1  # of the landing pilot's actions, which are taken at random instead


def episodes(pilot: bool, steps: int) -> list[list[int]]:
    """Actions of whole episodes.

    Args:
        pilot: whether a pilot lands, now and then clumsily; otherwise actions are random.
        steps: of all episodes together, at least.

    Returns:
        A list of actions for each episode.
    """
    environment, generator = LunarLander(), np.random.default_rng(0)
    played: list[list[int]] = []
    while sum(map(len, played)) < steps:
        observation, _ = environment.reset(seed=SEED)
        played.append([])
        ended = False
        while not ended and len(played[-1]) < _LIMIT:
            action = int(generator.integers(4))
            if pilot and generator.random() >= _ERRORS:
                action = int(heuristic(environment, observation))
            played[-1].append(action)
            observation, _, ended, _, _ = environment.step(action)
    return played


def step_time(
    reset: Callable[[], Any], step: Callable[[int], Any], played: list[list[int]]
) -> Timed:
    """Microseconds per step, resets not counted.

    Args:
        reset: starts an episode.
        step: takes an action.
        played: actions of each episode.

    Returns:
        What measures it.
    """

    def timed(_: int) -> float:
        seconds = 0.0
        for actions in played:
            reset()
            begin = time.process_time()
            for action in actions:
                step(action)
            seconds += time.process_time() - begin
        return seconds / sum(map(len, played)) * 1e6

    return timed


def reset_time(reset: Callable[[], Any], times: int) -> Timed:
    """Microseconds per reset."""

    def timed(_: int) -> float:
        begin = time.process_time()
        for _ in range(times):
            reset()
        return (time.process_time() - begin) / times * 1e6

    return timed


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark."""
    rounds, steps = (3, 2_000) if quick else (15, 10_000)
    lander, original = Lander(SEED), LunarLander()
    begin_original = functools.partial(original.reset, seed=SEED)
    timed = {"reset": reset_time(lander.reset, steps // 40)}
    timed["reset, Gymnasium"] = reset_time(begin_original, steps // 40)
    for name, pilot in {"step, random actions": False, "step, landing": True}.items():
        played = episodes(pilot, steps)
        timed[name] = step_time(lander.reset, lander.step, played)
        timed[f"{name}, Gymnasium"] = step_time(begin_original, original.step, played)
    alternate(timed, 1)  # the first steps of a process are slow
    times = alternate(timed, rounds)
    return [
        compared(
            f"lunar lander, {name}", times[name], UNIT,
            "Gymnasium's class", times[f"{name}, Gymnasium"],
        )
        for name in ("step, random actions", "step, landing", "reset")
    ]  # fmt: skip


if __name__ == "__main__":
    show("Lunar lander", measure(is_quick(__doc__)))
