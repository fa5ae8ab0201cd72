"""Successes and crashes that an environment tells in `info`."""

import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from qbumpers.tasks.dynamics import CRASH, SUCCESS

SUCCESS_KEYS = ("success", "is_success")
CRASH_KEYS = ("crash", "crashed")
"""Keys of `info` that are known, in the order in which they are looked for."""

_EPISODES, _STEPS = 5, 1_000  # at most, that are looked through for keys


class Keys(NamedTuple):
    """Which keys of `info` tell a success and a crash."""

    success: str = SUCCESS_KEYS[0]
    crash: str = CRASH_KEYS[0]

    def settings(self) -> dict[str, str]:
        """JSON-like; nothing of the usual ones."""
        pairs = zip(("success_key", "crash_key"), self, Keys(), strict=True)
        return {field: key for field, key, usual in pairs if key != usual}


def events_told(info: Mapping[str, Any]) -> int:
    """Bits SUCCESS and CRASH of `qbumpers.tasks.dynamics` that a step's `info` tells.

    Args:
        info: of which the first of `SUCCESS_KEYS` and of `CRASH_KEYS` that is there counts.
    """
    success, crash = (
        next((bool(info[key]) for key in keys if key in info), False)
        for keys in (SUCCESS_KEYS, CRASH_KEYS)
    )
    return SUCCESS * success | CRASH * crash


class Announced(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Tells successes and crashes by the usual keys of `info`, in whatever keys they come.

    Args:
        env: any environment.
        keys: that it has.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], keys: Keys) -> None:
        RecordConstructorArgs.__init__(self, keys=keys)
        super().__init__(env)
        self._keys = Keys(*keys)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, self._told(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take an action."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, self._told(info)

    def _told(self, info: dict[str, Any]) -> dict[str, Any]:
        pairs = zip(Keys(), self._keys, strict=True)
        return {**info, **{usual: bool(info.get(key)) for usual, key in pairs if key != usual}}


class Found(NamedTuple):
    """What an environment tells: by which keys, and whether it tells successes and crashes."""

    keys: Keys
    success: bool
    crash: bool


def found_keys(name: str, environment: Any, success: str | None, crash: str | None) -> Found:
    """Which keys of `info` tell successes and crashes.

    Args:
        name: of the environment, for the warning.
        environment: with numbered actions; up to 5 random episodes and 1,000 steps are played.
        success: key that was asked for; None for the first of `SUCCESS_KEYS` that is shown.
        crash: the same of `CRASH_KEYS`.

    Warns:
        UserWarning: if a key was asked for that is not shown.
    """
    shown = _keys_shown(environment)
    chosen: list[str | None] = []
    for asked, known in ((success, SUCCESS_KEYS), (crash, CRASH_KEYS)):
        if asked is not None and asked not in shown:
            warnings.warn(
                f"task {name!r}: info had no key {asked!r} in {_STEPS:,} random steps or fewer; it "
                f"had: {', '.join(sorted(map(str, shown))) or 'none'}",
                stacklevel=3,
            )
        chosen.append(asked or next((key for key in known if key in shown), None))
    keys = Keys(*(key or usual for key, usual in zip(chosen, Keys(), strict=True)))
    return Found(keys, *(key is not None for key in chosen))


def _keys_shown(environment: Any) -> set[str]:
    """Keys that `info` has at any step of random episodes: some show one only at their end."""
    shown: set[str] = set()
    generator, steps = np.random.default_rng(0), 0
    space = environment.action_space
    for episode in range(_EPISODES):
        _, info = environment.reset(seed=episode)
        shown |= {*info}
        over = False
        while not over and steps < _STEPS:
            action = int(space.start + generator.integers(int(space.n)))
            *_, terminated, truncated, info = environment.step(action)
            shown |= {*info}
            steps += 1
            over = bool(terminated or truncated)
        if steps >= _STEPS or (shown & {*SUCCESS_KEYS} and shown & {*CRASH_KEYS}):
            break
    return shown
