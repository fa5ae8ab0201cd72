"""Studies from TOML files and from plain data, and whether what they name is there."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from qbumpers.errors import RequestError, from_validation
from qbumpers.experiments.learner_designs import field_names
from qbumpers.experiments.sources import parsed
from qbumpers.imports import found_in
from qbumpers.learners import learner_type
from qbumpers.play.game import Choice, Game
from qbumpers.play.setup import Setup
from qbumpers.study.design.conditions import Factor, Level
from qbumpers.study.design.instruments import Item
from qbumpers.study.design.models import Analysis, Bonus, Recruitment, Rehearsal, Returning, Study
from qbumpers.study.design.parts import KINDS, Block, Question

EXAMPLE = Path(__file__).with_name("example.toml")
"""The study file that a new one begins as."""

_MODELS = (
    Study, Recruitment, Returning, Analysis, Bonus, Rehearsal, Factor, Level, Item, Question,
    *KINDS,
)  # fmt: skip


def make_study(settings: dict[str, Any], where: str = "study") -> Study:
    """A study from plain data, checked.

    Args:
        settings: what a TOML file would hold.
        where: for messages, for instance the path of the file.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    try:
        return Study.model_validate(settings)
    except ValidationError as error:
        known = {field for model in _MODELS for field in model.model_fields}
        raise from_validation(error, where, sorted({*known, *field_names()})) from error
    except RequestError as error:
        raise RequestError(f"{where}: {error}") from error


def load_study(path: str | Path) -> Study:
    """A study from a TOML file.

    Args:
        path: where the file is; modules beside it can be imported.

    Raises:
        RequestError: if the file cannot be read, is no TOML, or a field is wrong.
    """
    where = f"study file {path}"
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise RequestError(f"{where}: {error.strerror or error}") from error
    with found_in([Path(path).parent, Path.cwd()]):
        return make_study(parsed(content, where), where)


def write_new(path: str | Path) -> None:
    """Write a study file to begin with, with comments.

    Args:
        path: of a file that is not there yet.

    Raises:
        RequestError: if it is there, or cannot be written.
    """
    try:
        with Path(path).open("x", encoding="utf-8") as file:
            file.write(EXAMPLE.read_text(encoding="utf-8"))
    except FileExistsError as error:
        raise RequestError(
            f"study file {path}: it is there already; choose another name"
        ) from error
    except OSError as error:
        raise RequestError(f"study file {path}: {error.strerror or error}") from error


def setups_of(study: Study) -> dict[str, Setup]:
    """What is played in each block, by the block's id; blocks of one task share it.

    Raises:
        RequestError: if there is no such task, it cannot be shown, or its values are not known.
    """
    made: dict[str, Setup] = {}
    found: dict[str, Setup] = {}
    for part in study.parts:
        if not isinstance(part, Block):
            continue
        task = part.task or study.task
        values = part.values if part.task is not None else study.values
        key = f"{task.model_dump_json()} {values}"
        if key not in made:
            try:
                made[key] = Setup(
                    task.name, values, study.step_limit, discount=task.discount,
                    episode_limit=task.episode_limit, **task.arguments,
                )  # fmt: skip
            except RequestError as error:
                raise RequestError(f"block {part.id}: {error}") from error
        found[part.id] = made[key]
    return found


def check_playable(study: Study) -> dict[str, Setup]:
    """Check that every condition's assistant suits the tasks in which it helps.

    Args:
        study: as in its file.

    Returns:
        What is played in each block, see `setups_of`.

    Raises:
        RequestError: naming the condition or the learner that does not suit.
    """
    setups = setups_of(study)
    for part in study.parts:
        if not isinstance(part, Block):
            continue
        for condition in study.all_conditions() if part.phase == "training" else ():
            try:
                Game(setups[part.id], 0).begin(Choice(condition.assistant, condition.options))
            except RequestError as error:
                raise RequestError(f"condition {condition.name}: {error}") from error
        observed = "states" if setups[part.id].task.states else "vectors"
        for learner in study.rehearsal.learners:
            if learner_type(learner.name).observes != observed:
                raise RequestError(
                    f"rehearsal: learner {learner.name!r} observes {learner.observes}, and "
                    f"the task of block {part.id} gives {observed}"
                )
    return setups
