"""Experiments from TOML files, from plain data, and those that are built in."""

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from qbumpers.errors import RequestError, from_validation, unknown_name
from qbumpers.experiments.cells import MANY_CELLS
from qbumpers.experiments.design import Experiment, TaskDesign, reproductions
from qbumpers.experiments.learner_designs import field_names


def make_experiment(
    settings: dict[str, Any], where: str = "experiment", *, large: bool = False
) -> Experiment:
    """An experiment from plain data, checked.

    Args:
        settings: what a TOML file would hold.
        where: for messages, for instance the path of the file.
        large: whether more than `MANY_CELLS` cells of work are meant.

    Returns:
        The experiment.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    try:
        experiment = Experiment.model_validate(settings)
    except ValidationError as error:
        raise from_validation(error, where, _field_names()) from error
    cells = experiment.condition_count() * math.ceil(experiment.trials / experiment.trials_a_cell())
    if cells > MANY_CELLS and not large:
        raise RequestError(
            f"{where}: {experiment.condition_count():,} conditions, together {cells:,} cells of "
            f"work; more than {MANY_CELLS:,} must be asked for with --yes"
        )
    try:
        experiment.conditions()
    except RequestError as error:
        raise RequestError(f"{where}: {error}") from error
    return experiment


def _field_names() -> list[str]:
    models = (Experiment, TaskDesign)
    return sorted({*field_names(), *(field for model in models for field in model.model_fields)})


def load_experiment(path: str | Path, *, large: bool = False) -> Experiment:
    """An experiment from a TOML file.

    Args:
        path: of the file.
        large: whether more than `MANY_CELLS` cells of work are meant.

    Returns:
        The experiment.

    Raises:
        RequestError: where the file cannot be read, is no TOML, or a field is wrong.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise RequestError(f"experiment file {path}: {error.strerror or error}") from error
    settings = parsed(content, f"experiment file {path}")
    settings.pop("run", None)  # what an output folder adds: version, platform, time
    return make_experiment(settings, f"experiment file {path}", large=large)


def parsed(content: bytes, where: str) -> dict[str, Any]:
    """What a TOML file says.

    Args:
        content: of the file.
        where: for the message, for instance the path of the file.

    Returns:
        Its tables.

    Raises:
        RequestError: where it is no TOML.
    """
    try:
        return tomllib.loads(content.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RequestError(f"{where}: not valid TOML: {error}") from error


DEFAULT = "figures"
"""The profile of every published experiment in which its figures come out."""


def profiles(name: str) -> list[str]:
    """Profiles of a published experiment, the default first.

    Args:
        name: for instance "cliff-walking".

    Returns:
        For instance "figures" and "text".
    """
    found = [file.name.split(".")[1] for file in _folder().iterdir() if _is_of(file, name)]
    return sorted(found, key=lambda profile: (profile != DEFAULT, profile))


def reproduction(
    name: str,
    profile: str = DEFAULT,
    *,
    alphas: Sequence[float] | None = None,
    quick: bool = False,
    **changes: Any,
) -> Experiment:
    """A published experiment, or a smaller version of it.

    Versions that could not go on where the published one was have a name of their own, and so
    another output folder.

    Args:
        name: for instance "cliff-walking".
        profile: see `profiles`.
        alphas: of every assistant that has one, in place of the published ones.
        quick: whether to run a version of a few minutes; `alphas` and `changes` hold there too.
        **changes: of fields, for instance `trials=20`; None leaves a field as it is.

    Returns:
        The experiment.

    Raises:
        RequestError: where a name is unknown, a change is wrong, or there is no quick version.
    """
    if name not in reproductions():
        raise unknown_name("reproduction", name, reproductions())
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
    text = (_folder() / f"{name}.{profile}.toml").read_text(encoding="utf-8")
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


def _folder() -> Traversable:
    return resources.files("qbumpers.experiments") / "built_in"


def _is_of(file: Traversable, name: str) -> bool:
    return file.name.startswith(f"{name}.") and file.name.endswith(".toml")
