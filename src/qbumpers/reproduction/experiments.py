"""The settings of published experiments, whole or smaller, and what repeats a run of them."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from qbumpers.errors import RequestError, unknown_name
from qbumpers.experiments.design import REPRODUCTIONS, Experiment
from qbumpers.experiments.sources import make_experiment

DEFAULT = "figures"
"""The profile of every published experiment in which its figures come out."""


def package_of(name: str) -> str:
    """Name of the package that holds a published experiment, for example "cliff-walking"."""
    return f"qbumpers.reproduction.{name.replace('-', '_')}"


def profiles(name: str) -> list[str]:
    """Profiles of a published experiment, the default first.

    Args:
        name: one of `REPRODUCTIONS`, for example "cliff-walking".

    Returns:
        For example "figures" and "text".
    """
    names = [file.name.removesuffix(".toml") for file in _profiles_folder(name).iterdir()]
    return sorted(names, key=lambda profile: (profile != DEFAULT, profile))


def reproduction(
    name: str,
    profile: str = DEFAULT,
    *,
    alphas: Sequence[float] | None = None,
    quick: bool = False,
    **changes: Any,
) -> Experiment:
    """A published experiment, or a smaller version of it.

    Versions that could not continue in the folder of the published one have a name of their own,
    and so another output folder.

    Args:
        name: one of `REPRODUCTIONS`, for example "cliff-walking".
        profile: see `profiles`.
        alphas: of every assistant that has one, in place of the published ones.
        quick: whether to run a version of a few minutes; `alphas` and `changes` apply to it too.
        **changes: of fields, for example `trials=20`; None leaves a field as it is.

    Returns:
        The experiment.

    Raises:
        RequestError: if a name is unknown, a change is wrong, or there is no quick version.
    """
    if name not in REPRODUCTIONS:
        raise unknown_name("reproduction", name, REPRODUCTIONS)
    if profile not in profiles(name):
        raise unknown_name("profile", profile, profiles(name))
    published = _settings(name, profile)
    shorter = published.pop("quick", None)
    if quick and shorter is None:
        raise RequestError(f"quick: {name} has no quick version; --trials makes it shorter")
    settings = overlaid(published, shorter) if quick else dict(published)
    settings.update({field: value for field, value in changes.items() if value is not None})
    if alphas is not None:
        settings["assistants"] = [
            {**each, "alpha": list(alphas)} if "alpha" in each else each
            for each in settings["assistants"]
        ]
    settings["name"] = _version_name(published, shorter if quick else None, settings, alphas)
    return make_experiment(settings, f"{name}, profile {profile}", large=True)


_OF_THIS_RUN = {"name", "trials", "seed", "criterion", "retention", "common_random_numbers"}


def deviations(experiment: Experiment) -> list[str]:
    """What makes an experiment another one than the published one that it reproduces.

    More or fewer learners, other random numbers, and how results are read do not.

    Args:
        experiment: that reproduces one.

    Returns:
        Words on each field that differs from the nearest profile; empty if it is the paper's.
    """
    name = experiment.reproduces or ""
    found = [_different(experiment, reproduction(name, profile)) for profile in profiles(name)]
    return min(found, key=len)


def _different(experiment: Experiment, published: Experiment) -> list[str]:
    words = []
    for field in experiment.__class__.model_fields:
        now, then = getattr(experiment, field), getattr(published, field)
        if field not in _OF_THIS_RUN and now != then:
            plain = isinstance(now, int | str)
            words.append(f"{field} = {now!r}, not {then!r}" if plain else f"other {field}")
    return words


def command(experiment: Experiment) -> str:
    """The command that repeats an experiment; empty if it is no profile of a published one."""
    name = experiment.reproduces
    if name is None:
        return ""
    for profile in profiles(name):
        repeated = reproduction(name, profile, trials=experiment.trials, seed=experiment.seed)
        if repeated == experiment:
            size = f"--trials {experiment.trials} --seed {experiment.seed}"
            return f"qbumpers reproduce {name} --profile {profile} {size}"
    return ""


def overlaid(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with others laid over them.

    Args:
        base: settings; tables in it are overlaid in their turn, and so are lists of as many tables.
        changes: what is different.

    Returns:
        Both together.
    """
    return {**base, **{field: _changed(base.get(field), new) for field, new in changes.items()}}


def _changed(old: Any, new: Any) -> Any:
    if isinstance(old, dict) and isinstance(new, dict):
        return overlaid(old, new)
    tables = isinstance(old, list) and isinstance(new, list) and len(old) == len(new)
    if tables and all(isinstance(each, dict) for each in (*old, *new)):
        return [overlaid(*pair) for pair in zip(old, new, strict=True)]
    return new


def _settings(name: str, profile: str) -> dict[str, Any]:
    """What the file of a profile says, laid over the profile that it builds on."""
    text = (_profiles_folder(name) / f"{profile}.toml").read_text(encoding="utf-8")
    settings = tomllib.loads(text)
    base = settings.pop("builds_on", None)
    return settings if base is None else overlaid(_settings(name, base), settings)


def _version_name(
    published: Mapping[str, Any],
    shorter: Mapping[str, Any] | None,
    settings: Mapping[str, Any],
    alphas: Sequence[float] | None,
) -> str:
    """The name of a version: what distinguishes it from the published experiment comes last."""
    parts = [published["name"], *([] if shorter is None else ["quick"])]
    usual = published if shorter is None else shorter
    if settings["episodes"] != usual["episodes"]:
        parts.append(f"episodes-{settings['episodes']}")
    if alphas is not None:
        parts.append("-".join(["alphas", *(f"{alpha:g}" for alpha in alphas)]))
    if settings.get("values") != published.get("values"):
        parts.append("values-" + re.sub(r"[^\w.-]", "-", Path(settings["values"]).stem))
    return "-".join(parts)


def _profiles_folder(name: str) -> Traversable:
    return resources.files(package_of(name)) / "profiles"
