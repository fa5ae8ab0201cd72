"""Gymnasium's FrozenLake and Taxi as tasks whose map, chance, discount and limit are fixed."""

from dataclasses import replace
from typing import Any

import gymnasium

from qbumpers.tasks.tabular import TabularTask

LAKE_DISCOUNT, TAXI_DISCOUNT = 0.99, 1.0


def frozen_lake() -> TabularTask:
    """Cross a slippery lake with holes, 4 x 4 cells: FrozenLake-v1 of Gymnasium.

    Of actions left, down, right and up each leads where it says 1 time in 3, and to either side 1
    time in 3. Reaching the goal brings 1, a hole nothing, and both the end.

    Returns:
        The task, with Gymnasium's limit of 100 steps; the goal is its success, a hole its crash.
    """
    return _fixed("frozen-lake", "FrozenLake-v1", LAKE_DISCOUNT, map_name="4x4", is_slippery=True)


def frozen_lake_8x8() -> TabularTask:
    """Cross a slippery lake with holes, 8 x 8 cells: FrozenLake8x8-v1 of Gymnasium.

    As `frozen_lake`.

    Returns:
        The task, with Gymnasium's limit of 200 steps; the goal is its success, a hole its crash.
    """
    return _fixed(
        "frozen-lake-8x8", "FrozenLake8x8-v1", LAKE_DISCOUNT, map_name="8x8", is_slippery=True
    )


def taxi() -> TabularTask:
    """Pick a passenger up and drop them off where they want to go: Taxi-v4 of Gymnasium.

    Every action costs 1, picking up or dropping off in the wrong place 10, and the right drop-off
    brings 20 and the end (Dietterich 2000).

    Returns:
        The task, with Gymnasium's limit of 200 steps; the right drop-off is its success.
    """
    return replace(_fixed("taxi", "Taxi-v4", TAXI_DISCOUNT), crash=None)


def _fixed(name: str, environment: str, discount: float, **arguments: Any) -> TabularTask:
    made = gymnasium.make(environment, disable_env_checker=True, **arguments)
    return replace(TabularTask.from_gymnasium(made, discount=discount), name=name)
