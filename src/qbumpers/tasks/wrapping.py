"""Wrappers around a Gymnasium environment: which of them decide what its steps give."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
from gymnasium import wrappers

from qbumpers.errors import RequestError
from qbumpers.tasks.announcing import Announced

WATCHING = {
    wrappers.PassiveEnvChecker,
    wrappers.OrderEnforcing,
    wrappers.TimeLimit,
    wrappers.RecordEpisodeStatistics,
    wrappers.RecordVideo,
    wrappers.HumanRendering,
    Announced,
}
"""Wrappers that leave steps as they are, and go on whether or not a step is taken back."""

_HARMLESS = {*WATCHING, wrappers.RenderCollection}
_HARMLESS_ELSEWHERE = ("stable_baselines3.common.monitor.Monitor",)

_OF_REWARDS = (wrappers.TransformReward, wrappers.ClipReward)


def layers(environment: Any) -> Iterator[gymnasium.Env[Any, Any]]:
    """The environment as it is given, and what it wraps, from the outside in."""
    while isinstance(environment, gymnasium.Wrapper):
        yield environment
        environment = environment.env
    yield environment


def altering_wrappers(environment: Any) -> list[Any]:
    """The wrappers that may change what a step gives, beside the step limit.

    Args:
        environment: with any wrappers.

    Returns:
        All but those of Gymnasium that only watch, count or draw, Stable-Baselines3's Monitor, and
        classes that leave `step` and `reset` as they are; from the outside in.
    """
    around = [layer for layer in layers(environment) if isinstance(layer, gymnasium.Wrapper)]
    return [layer for layer in around if not _is_harmless(type(layer))]


def _is_harmless(kind: type[gymnasium.Wrapper[Any, Any, Any, Any]]) -> bool:
    # A class of its own may do anything, whatever it is derived from.
    if kind in _HARMLESS or f"{kind.__module__}.{kind.__qualname__}" in _HARMLESS_ELSEWHERE:
        return True
    return kind.step is gymnasium.Wrapper.step and kind.reset is gymnasium.Wrapper.reset


def step_limit(environment: Any) -> int | None:
    """Steps after which the first of Gymnasium's TimeLimit wrappers truncates; None without one."""
    limits = [
        layer._max_episode_steps  # Gymnasium has no public name for it
        for layer in layers(environment)
        if isinstance(layer, wrappers.TimeLimit)
    ]
    stated = environment.spec.max_episode_steps if environment.spec else None
    return min(limits, default=stated)


def followed_reward(environment: Any, name: str) -> Callable[[float], float]:
    """What the wrappers of an environment make of a reward of its transition table.

    Args:
        environment: with any wrappers.
        name: of the environment, for the message.

    Returns:
        The functions of its TransformReward and ClipReward wrappers, the innermost first.

    Raises:
        RequestError: naming a wrapper whose effect on a transition table is not known; from the
            function, if one of the wrappers' fails.
    """
    altering = altering_wrappers(environment)
    for layer in altering:
        if type(layer) not in _OF_REWARDS:
            raise RequestError(
                f"environment {name}: what wrapper {type(layer).__name__} does to its transition "
                "table is not known; leave the wrapper out, or give the table with it by "
                "TabularTask.from_table"
            )

    def followed(reward: float) -> float:
        """What the wrappers make of a reward of the table."""
        changed = reward
        for layer in reversed(altering):
            try:
                changed = float(layer.func(changed))
            except Exception as error:
                raise RequestError(
                    f"environment {name}: wrapper {type(layer).__name__} fails at the reward "
                    f"{reward!r}: {error}"
                ) from error
        return changed

    return followed
