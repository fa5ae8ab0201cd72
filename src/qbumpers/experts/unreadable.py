"""Why the file of a model of Stable-Baselines3 cannot be read, as far as the file tells."""

import contextlib
import importlib.metadata
import json
import re
import zipfile
import zlib
from pathlib import Path

_OLD_GYM = ("gym", "shimmy")  # what models from before version 2 need


def why_unreadable(path: Path, error: Exception) -> str:
    """A model's file and what is wrong with it, in one line.

    Args:
        path: of a file that there is.
        error: what reading it came to.
    """
    if not zipfile.is_zipfile(path):
        return f"{path}: not a DQN of Stable-Baselines3 (it is no zip file, or was cut short)"
    members = _small_members(path)
    version, policy = _version_in(members), _policy_in(members)
    saved = f"{path}: saved by Stable-Baselines3 {version or 'of unknown version'}"
    missing = error.name or str(error) if isinstance(error, ImportError) else ""
    if any(name in missing.lower() for name in _OLD_GYM):
        return (
            f"{saved}, which used gym, where now there is Gymnasium; to read it, install gym and "
            "shimmy, or train it anew with version 2 or newer"
        )
    if policy and not policy.startswith("stable_baselines3.dqn."):
        return f"{path}: not a DQN of Stable-Baselines3 (its policy comes from {policy})"
    if missing:
        return f"{saved}, by a program with a module {missing!r} that is not here"
    here = importlib.metadata.version("stable-baselines3")
    if _numbers_of(version) > _numbers_of(here):
        return f"{saved}, which {here} cannot read; install that version or a newer one"
    reason = (str(error) or type(error).__name__).partition("\n")[0]
    return f"{path}: not a DQN of Stable-Baselines3 ({reason})"


def _version_in(members: dict[str, bytes]) -> str:
    """The version that saved a model; empty if it does not say."""
    return members.get("_stable_baselines3_version", b"").decode(errors="replace").strip()


def _policy_in(members: dict[str, bytes]) -> str:
    """The module of a model's policy; empty if it does not say."""
    try:
        return str(json.loads(members["data"])["policy_class"]["__module__"])
    except (KeyError, ValueError, TypeError):
        return ""


def _small_members(path: Path) -> dict[str, bytes]:
    """What a model says of itself, by the name of its part; nothing of what is damaged."""
    members: dict[str, bytes] = {}
    with zipfile.ZipFile(path) as archive:
        for name in ("_stable_baselines3_version", "data"):
            with contextlib.suppress(KeyError, RuntimeError, zipfile.BadZipFile, zlib.error):
                members[name] = archive.read(name)
    return members


def _numbers_of(version: str) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", version)[:2]]
