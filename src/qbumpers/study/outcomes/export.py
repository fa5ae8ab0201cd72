"""Exporting a study: files of an experiment, a participant in the place of a trial, and data."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import sqlalchemy as sql

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.experiments.columns import EPISODE_COLUMNS
from qbumpers.experiments.design import PARTICIPANT, Experiment, NamedCondition
from qbumpers.experiments.participants import STEPS
from qbumpers.experiments.record import CONDITIONS, Record, recorded
from qbumpers.experiments.sources import recorded_experiment
from qbumpers.experiments.steps import step_table
from qbumpers.experiments.store import EXPERIMENT, VALUES
from qbumpers.experiments.tables import EPISODES, encoded
from qbumpers.experiments.writing import described
from qbumpers.files import Folder, open_folder
from qbumpers.play.game import Episode
from qbumpers.play.setup import Setup
from qbumpers.study.design.conditions import Condition
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block
from qbumpers.study.flow.tables import EXPORTS, STUDY
from qbumpers.study.outcomes.psych_ds import write_dataset
from qbumpers.study.outcomes.reading import Participant, read_participants
from qbumpers.study.outcomes.tables import tables_of

DATASET = "dataset"
"""Folder of the Psych-DS data set in the folder of an export."""


class Exported(NamedTuple):
    """What was exported.

    Attributes:
        participants: everybody.
        reported: those of the report: complete, with every probe.
        folder: into which the files go.
    """

    participants: int
    reported: int
    folder: Path


def export_study(
    engine: sql.Engine,
    study: Study,
    setups: Mapping[str, Setup],
    folder: Path,
    *,
    noted: bool = True,
) -> Exported:
    """Write what participants did: for `load` and the report, and as a Psych-DS data set.

    In the report's files, an assisted episode of training and the probe right after it are a row;
    episodes of retention, or of the post-test if there is none, are rows of retention. Participants
    who are not complete are in the data set alone.

    Args:
        engine: as `open_records` gave it.
        study: whose records they are.
        setups: what is played in each block, by its id.
        folder: of the files; what an earlier export left there is written anew.
        noted: whether the folder is noted, so that deleting a participant reaches it.

    Returns:
        What was exported.

    Raises:
        RequestError: if nobody has come yet.
        StoreError: if a file cannot be written.
    """
    participants = read_participants(engine, study)
    if not participants:
        raise RequestError("export: nobody has taken part yet")
    with engine.connect() as connection:
        digest = connection.execute(sql.select(STUDY.c.digest)).scalar_one()
    write_dataset(folder / DATASET, study, tables_of(study, participants), digest)
    place = open_folder(folder)
    whole = [each for each in participants if each.now.outcome == "complete" and _rows(study, each)]
    if whole:
        _write_experiment(place, study, setups, whole, digest)
    else:
        for name in (EXPERIMENT, CONDITIONS, EPISODES, VALUES):
            place.remove(name)
    _write_steps(place, study, participants)
    if noted:
        _note(engine, folder)
    return Exported(len(participants), len(whole), folder)


def _note(engine: sql.Engine, folder: Path) -> None:
    """Note where data went, so that deleting a participant reaches them."""
    name = str(folder.resolve())
    with engine.begin() as connection:
        connection.execute(EXPORTS.delete().where(EXPORTS.c.folder == name))
        connection.execute(EXPORTS.insert(), {"folder": name})


def _write_steps(place: Folder, study: Study, participants: Sequence[Participant]) -> None:
    """Steps of the study's own task, for fitting."""
    own = {part.id for part in study.parts if isinstance(part, Block) and part.task is None}
    tables: dict[str, Step] = {}
    for each in participants:
        steps = [
            step._replace(episode=number)
            for number, episode in enumerate(
                steps for block in each.blocks if block.block in own for steps in block.steps
            )
            for step in episode
        ]
        if steps:
            tables[each.name] = Step(*map(np.array, zip(*steps, strict=True)))
    if tables:
        place.write(STEPS, encoded(step_table(tables)))
    else:
        place.remove(STEPS)


def _pairs(participant: Participant) -> list[tuple[Episode, Episode]]:
    """Assisted episodes of training, each with the probe right after it."""
    found: list[tuple[Episode, Episode]] = []
    for block in participant.blocks:
        if block.phase == "training":
            for first, second in zip(block.episodes, block.episodes[1:], strict=False):
                if first.choice.assisted and not second.choice.assisted:
                    found.append((first, second))
    return found


def _retained(study: Study, participant: Participant) -> list[Episode]:
    phases = {part.phase for part in study.parts if isinstance(part, Block)}
    phase = "retention" if "retention" in phases else "posttest"
    return [e for block in participant.blocks if block.phase == phase for e in block.episodes]


def _rows(study: Study, participant: Participant) -> list[dict[str, Any]]:
    """A row per pair, then a row per episode without the assistant; none without pairs."""
    pairs = _pairs(participant)
    later = [(episode, episode) for episode in _retained(study, participant)] if pairs else []
    return [
        _row(number, first, second, retention=number >= len(pairs))
        for number, (first, second) in enumerate([*pairs, *later])
    ]


def _row(number: int, first: Episode, second: Episode, *, retention: bool) -> dict[str, Any]:
    sides = {"assisted": first, "unassisted": second}
    return {
        "episode": number,
        "retention": retention,
        "overrides": first.overrides,
        **{f"{side}_return": episode.total for side, episode in sides.items()},
        **{f"{side}_length": episode.length for side, episode in sides.items()},
        **{f"{side}_success": episode.success for side, episode in sides.items()},
        **{f"{side}_crash": episode.crash for side, episode in sides.items()},
    }


def id_of(condition: Condition) -> str:
    """The id that a condition has in an experiment's files, which begins with the rule.

    Args:
        condition: of the study.

    Returns:
        For instance "stochastic-q-bumpers/condition=bumpers".
    """
    rule = "random-override" if condition.yoked_to else condition.assistant
    return f"{rule}/condition={condition.name.replace('/', '+')}"


def _named(condition: Condition) -> NamedCondition:
    """A condition of the study as an experiment has it; a yoked one is helped at random."""
    if condition.yoked_to:
        assistant = make_assistant("random-override", probability=0.0)
    else:
        assistant = make_assistant(condition.assistant, **condition.options)
    learner = _experiment({}).learners[0]
    return NamedCondition(id_of(condition), assistant, learner, PARTICIPANT)


def _experiment(settings: Mapping[str, Any]) -> Experiment:
    fixed = {
        "name": "study", "task": {"name": ""}, "values": "", "assistants": [{"name": ""}],
        "learners": [{"name": PARTICIPANT}],
    }  # fmt: skip
    return recorded_experiment({**fixed, **settings}, "experiment")


def _write_experiment(
    place: Folder,
    study: Study,
    setups: Mapping[str, Setup],
    whole: Sequence[Participant],
    digest: str,
) -> None:
    """What `load` and the report read."""
    there = {each.now.condition for each in whole}
    conditions = [c for c in study.all_conditions() if c.name in there]
    noted = [recorded(_named(condition)) for condition in conditions]
    abouts = {c.name: one for c, one in zip(conditions, noted, strict=True)}
    counts = {about.condition: 0 for about in noted}
    rows: list[dict[str, Any]] = []
    for each in whole:
        about = abouts[each.now.condition]
        trial = counts[about.condition]
        counts[about.condition] += 1
        fixed = {
            "condition": about.condition, "assistant": about.assistant, "alpha": about.alpha,
            "learner": PARTICIPANT, "trial": trial,
        }  # fmt: skip
        rows += [{**fixed, **row} for row in _rows(study, each)]
    order = list(counts)
    rows.sort(key=lambda row: (order.index(row["condition"]), row["trial"], row["episode"]))
    training = next(p for p in study.parts if isinstance(p, Block) and p.phase == "training")
    setup = setups[training.id]
    experiment = _experiment({
        "name": study.name,
        "task": (training.task or study.task).model_dump(exclude_none=True),
        "values": study.values or ("exact" if "exact" in setup.task.value_sources else "expert"),
        "assistants": [{"name": c.assistant, **c.options} for c in conditions],
        "trials": max(counts.values()),
        "episodes": max(len(_pairs(each)) for each in whole),
        "retention": max(len(_retained(study, each)) for each in whole),
    })  # fmt: skip
    values = setup.values(())
    record = Record(noted, setup.task.digest(), values.digest(), {}, setup.task.discount)
    table = pl.DataFrame(rows, infer_schema_length=None).select(*EPISODE_COLUMNS)
    place.write(VALUES, values.encoded())
    place.write(CONDITIONS, record.encoded())
    place.write(EXPERIMENT, described(experiment, study=digest).encode())
    place.write(EPISODES, encoded(table))
