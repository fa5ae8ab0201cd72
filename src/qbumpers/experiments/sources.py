"""Experiments from TOML files and from plain data."""

import codecs
import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from qbumpers.errors import RequestError, counted, from_validation
from qbumpers.experiments.cells import MANY_CELLS, MOST_CELLS
from qbumpers.experiments.design import Experiment, TaskDesign
from qbumpers.experiments.learner_designs import RECORDED, field_names
from qbumpers.imports import found_in


def recorded_experiment(settings: dict[str, Any], where: str) -> Experiment:
    """The experiment of a run, as its output folder notes it.

    What it names, rules, learners, tasks and files, need not be there any more.

    Args:
        settings: of the run, every field spelt out.
        where: for messages, for example the path of the file.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    try:
        return Experiment.model_validate(settings, context=RECORDED)
    except ValidationError as error:
        raise from_validation(error, where, _field_names()) from error


def make_experiment(
    settings: dict[str, Any],
    where: str = "experiment",
    *,
    large: bool = False,
    imports: Sequence[str] = (),
) -> Experiment:
    """An experiment from plain data, checked.

    Args:
        settings: what a TOML file would hold.
        where: for messages, for example the path of the file.
        large: whether more than `MANY_CELLS` cells of work are meant.
        imports: further modules that are imported first.

    Returns:
        The experiment.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    if imports:
        settings = {**settings, "imports": [*settings.get("imports", []), *imports]}
    try:
        experiment = Experiment.model_validate(settings)
    except ValidationError as error:
        raise from_validation(error, where, _field_names()) from error
    cells = experiment.condition_count() * math.ceil(experiment.trials / experiment.trials_a_cell())
    if cells > (MOST_CELLS if large else MANY_CELLS):
        refused = "is too many" if large else "must be asked for with --yes"
        raise RequestError(
            f"{where}: {counted(experiment.condition_count(), 'condition')}, together "
            f"{counted(cells, 'cell')} of work; more than "
            f"{MOST_CELLS if large else MANY_CELLS:,} {refused}"
        )
    try:
        experiment.conditions()
    except RequestError as error:
        raise RequestError(f"{where}: {error}") from error
    return experiment


def _field_names() -> list[str]:
    models = (Experiment, TaskDesign)
    return sorted({*field_names(), *(field for model in models for field in model.model_fields)})


def load_experiment(
    path: str | Path,
    *,
    large: bool = False,
    imports: Sequence[str] = (),
    changes: Mapping[str, Any] = MappingProxyType({}),
) -> Experiment:
    """An experiment from a TOML file.

    Args:
        path: where the file is; modules beside it can be imported.
        large: whether more than `MANY_CELLS` cells of work are meant.
        imports: further modules that are imported first.
        changes: what is to hold in place of fields of the file, by name.

    Returns:
        The experiment.

    Raises:
        RequestError: if the file cannot be read, is no TOML, a module cannot be imported, or a
            field is wrong.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise RequestError(f"experiment file {path}: {error.strerror or error}") from error
    settings = parsed(content, f"experiment file {path}")
    settings.pop("run", None)  # what an output folder adds: version, platform, time
    where = f"experiment file {path}"
    with found_in([Path(path).parent, Path.cwd()]):
        return make_experiment({**settings, **changes}, where, large=large, imports=imports)


def parsed(content: bytes, where: str) -> dict[str, Any]:
    """What a TOML file says.

    Args:
        content: the bytes of the file.
        where: for the message, for example the path of the file.

    Returns:
        Its tables.

    Raises:
        RequestError: if it is no TOML.
    """
    try:
        return tomllib.loads(content.decode("utf-8-sig"))  # some editors begin with a mark
    except UnicodeDecodeError as error:
        wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        found = "it is UTF-16" if wide else f"byte {error.start + 1} is not UTF-8"
        raise RequestError(f"{where}: not valid TOML: {found}; save it as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise RequestError(f"{where}: not valid TOML: {error}") from error
