"""What people played, as output folders of experiments: a participant in the place of a trial."""

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import sqlalchemy as sql

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.experiments.columns import EPISODE_COLUMNS
from qbumpers.experiments.design import PARTICIPANT, Experiment, NamedCondition, condition_id
from qbumpers.experiments.record import CONDITIONS, Record, recorded
from qbumpers.experiments.sources import recorded_experiment
from qbumpers.experiments.steps import step_table
from qbumpers.experiments.store import EXPERIMENT, VALUES, read_design
from qbumpers.experiments.tables import EPISODES, encoded
from qbumpers.experiments.writing import described
from qbumpers.files import Folder, open_folder
from qbumpers.play.game import Choice, Episode
from qbumpers.play.setup import Setup, setup_of
from qbumpers.play.stores import shown
from qbumpers.play.tables import (
    Recorded,
    open_records,
    read_moments,
    read_notes,
    read_session,
    sessions_in,
)

STEPS, PLAYED, NOTES = "steps.parquet", "played.parquet", "notes.parquet"
"""A row per step; per episode, in the order in which each participant played; per note."""


class Exported(NamedTuple):
    """What was exported of one task.

    Attributes:
        folder: into which the files go.
        task: its name.
        participants: who played it.
        episodes: that ended.
        pairs: assisted episodes that an unassisted one followed: the rows of `episodes.parquet`. If
            there are none, there is nothing that a report could compare, and no such file.
        unpaired: episodes that ended, but are in no pair.
        unfinished: episodes that did not end; their steps are exported, their returns are not.
        idle: sessions without a step.
    """

    folder: Path
    task: str
    participants: int
    episodes: int
    pairs: int
    unpaired: int
    unfinished: int
    idle: int


def export_records(records: str | Path, folder: str | Path) -> list[Exported]:
    """Write what people played as output folders of experiments.

    Args:
        records: where they are, as `open_records` takes them.
        folder: of the files, made if it is missing; if more than one task was played, of a folder
            for each, named by the task. What an earlier export left there is written anew.

    Returns:
        What was exported, a task each, in the order in which they were first played.

    Raises:
        RequestError: if there are no such records, nobody played, a task or its values are not what
            they were, or the folder holds an experiment.
        StoreError: if a file cannot be written.
    """
    engine = open_records(records, new=False)
    try:
        groups: dict[str, list[Recorded]] = {}
        for session in sessions_in(engine):
            found = read_session(engine, session)
            if found is not None:
                groups.setdefault(json.dumps(found.setup, sort_keys=True), []).append(found)
        played = [group for group in groups.values() if any(one.steps for one in group)]
        if not played:
            raise RequestError(f"{shown(records)}: nobody has played yet; there is nothing in it")
        names = list(_names(group[0].setup["task"] for group in played))
        places = [Path(folder)] if len(played) == 1 else [Path(folder) / name for name in names]
        return [_export(engine, *each) for each in zip(played, places, strict=True)]
    finally:
        engine.dispose()


def _names(tasks: Iterable[str]) -> Iterator[str]:
    """Names of folders: the same task with other arguments or values has a number."""
    seen: dict[str, int] = {}
    for task in tasks:
        name = task.replace("/", "-").replace(":", "-")
        seen[name] = seen.get(name, 0) + 1
        yield name if seen[name] == 1 else f"{name}-{seen[name]}"


class _Played(NamedTuple):
    """An episode of a participant.

    Attributes:
        trial: number of the participant.
        session: identifier of the participant.
        condition: id of the chosen assistant.
        episode: what it came to.
    """

    trial: int
    session: str
    condition: str
    episode: Episode


def _export(engine: sql.Engine, group: Sequence[Recorded], folder: Path) -> Exported:
    setup = setup_of(group[0].setup)
    difference = setup.difference(group[0].setup)
    if difference:
        raise RequestError(f"session {group[0].session}: {difference}")
    place = open_folder(folder)
    conditions = _conditions(group)
    ids = {choice: named.condition for choice, named in conditions.items()}
    played = [
        _Played(trial, one.session, ids[_chosen(episode.choice)], episode)
        for trial, one in enumerate(group)
        for episode in _episodes(one)
    ]
    pairs = list(_pairs(played))
    ended = sum(each.episode.over for each in played)
    found = Exported(
        folder=folder,
        task=setup.task.name,
        participants=sum(bool(one.steps) for one in group),
        episodes=ended,
        pairs=len(pairs),
        unpaired=ended - 2 * len(pairs),
        unfinished=len(played) - ended,
        idle=sum(not one.steps for one in group),
    )
    with place.locked():
        before = read_design(place)
        if before is not None and not before.of_participants:
            raise RequestError(f"output folder {folder} holds an experiment; choose another folder")
        _write_tables(place, engine, group, played)
        if pairs:
            _write_experiment(place, setup, conditions, pairs, found)
        else:
            for name in (EXPERIMENT, CONDITIONS, EPISODES, VALUES):
                place.remove(name)
    return found


def _conditions(group: Sequence[Recorded]) -> dict[str, NamedCondition]:
    """Every assistant that was chosen, assisting or not, by `_chosen`."""
    choices = {_chosen(played.choice): played.choice for one in group for played in one.played}
    made = {key: make_assistant(c.name, **c.options) for key, c in choices.items()}
    learner = _experiment({"learners": [{"name": PARTICIPANT}]}).learners[0]
    return {
        key: NamedCondition(
            condition_id(assistant, list(made.values())), assistant, learner, PARTICIPANT
        )
        for key, assistant in made.items()
    }


def _chosen(choice: Choice) -> str:
    return choice._replace(assisted=True).key


def _episodes(one: Recorded) -> Iterator[Episode]:
    for number, played in enumerate(one.played):
        episode = Episode(number, played.choice)
        for step in played.steps:
            episode = episode.after(step)
        yield episode


def _pairs(played: Iterable[_Played]) -> Iterator[tuple[_Played, _Played]]:
    """Each assisted episode with the unassisted one that follows it at once."""
    ended = (each for each in played if each.episode.over)
    for one, following in itertools.pairwise(ended):
        same = one.trial == following.trial
        if same and one.episode.choice.assisted and not following.episode.choice.assisted:
            yield one, following


def _write_tables(
    place: Folder, engine: sql.Engine, group: Sequence[Recorded], played: Sequence[_Played]
) -> None:
    """What everybody did."""
    steps = {one.session: _table(one) for one in group if one.steps}
    own = pl.concat(
        pl.DataFrame(moment._asdict() for moment in read_moments(engine, name)) for name in steps
    )
    about = pl.DataFrame([
        {PARTICIPANT: e.session, "episode": e.episode.number, "condition": e.condition,
         "assisted": e.episode.choice.assisted}
        for e in played
    ])  # fmt: skip
    table = step_table(steps).hstack(own)
    table = table.join(about, on=[PARTICIPANT, "episode"], how="left", maintain_order="left")
    place.write(STEPS, encoded(table))
    rows = [
        {PARTICIPANT: each.session, "trial": each.trial, "condition": each.condition,
         **_columns(each.episode)}
        for each in played
    ]  # fmt: skip
    place.write(PLAYED, encoded(pl.DataFrame(rows, infer_schema_length=None)))
    notes = pl.concat(pl.DataFrame(read_notes(engine, one.session)) for one in group)
    place.write(NOTES, encoded(notes))


def _table(one: Recorded) -> Step:
    """The steps of a participant as a table, whose episodes the participant's own count numbers."""
    columns = zip(*one.steps, strict=True)
    numbers = [n for n, played in enumerate(one.played) for _ in played.steps]
    return Step(*map(np.array, columns))._replace(episode=np.array(numbers))


def _columns(episode: Episode) -> dict[str, Any]:
    return {
        "episode": episode.number,
        "assistant": episode.choice.name,
        "options": json.dumps(episode.choice.options, sort_keys=True),
        "assisted": episode.choice.assisted,
        "return": episode.total,
        "length": episode.length,
        "overrides": episode.overrides,
        "success": episode.success,
        "crash": episode.crash,
        "ended": episode.over,
    }


def _experiment(settings: Mapping[str, Any]) -> Experiment:
    defaults = {"name": "play", "task": {"name": ""}, "values": "", "assistants": [{"name": ""}]}
    return recorded_experiment({**defaults, **settings}, "experiment")


def _write_experiment(
    place: Folder,
    setup: Setup,
    conditions: Mapping[str, NamedCondition],
    pairs: Sequence[tuple[_Played, _Played]],
    found: Exported,
) -> None:
    """What `load` and the report read."""
    there = {first.condition for first, _ in pairs}
    noted = [recorded(named) for named in conditions.values() if named.condition in there]
    rows = _rows(pairs, noted, setup.task.events)
    designs = [
        {"name": c.name, **c.options}
        for key, named in conditions.items()
        if named.condition in there
        for c in [_choice_of(key)]
    ]
    description = setup.description
    arguments = dict(description["arguments"])
    task = {f: arguments.pop(f) for f in ("discount", "episode_limit") if f in arguments}
    source = "exact" if "exact" in setup.task.value_sources else "expert"
    experiment = _experiment({
        "name": f"{setup.task.name.replace('/', '-')}-played",
        "task": {"name": description["task"], **task, "arguments": arguments},
        "values": description["values"] or source,
        "learners": [{"name": PARTICIPANT}],
        "assistants": designs,
        "trials": rows["trial"].n_unique(),
        "episodes": int(rows["episode"].max()) + 1,  # type: ignore[arg-type]
    })  # fmt: skip
    values = setup.values(())
    record = Record(noted, setup.task.digest(), values.digest(), {}, setup.task.discount)
    counts = {f"exported {f}": v for f, v in found._asdict().items() if isinstance(v, int)}
    place.write(VALUES, values.encoded())
    place.write(CONDITIONS, record.encoded())
    place.write(EXPERIMENT, described(experiment, **counts).encode())
    place.write(EPISODES, encoded(rows))


def _choice_of(key: str) -> Choice:
    name, options = json.loads(key)
    return Choice(name, options)


def _rows(
    pairs: Sequence[tuple[_Played, _Played]], noted: Sequence[Any], events: Iterable[str]
) -> pl.DataFrame:
    """A row per pair, numbered by participant and condition."""
    about = {each.condition: each for each in noted}
    counts: dict[tuple[str, int], int] = {}
    rows: list[dict[str, Any]] = []
    for first, following in pairs:
        key = (first.condition, first.trial)
        counts[key] = counts.get(key, -1) + 1
        each, sides = about[first.condition], {"assisted": first, "unassisted": following}
        rows.append({
            "condition": first.condition, "assistant": each.assistant, "alpha": each.alpha,
            "learner": PARTICIPANT, "trial": first.trial, "episode": counts[key],
            "retention": False, "overrides": first.episode.overrides,
            **{f"{side}_return": e.episode.total for side, e in sides.items()},
            **{f"{side}_length": e.episode.length for side, e in sides.items()},
            **{
                f"{side}_{event}": getattr(e.episode, event) if event in events else None
                for side, e in sides.items()
                for event in ("success", "crash")
            },
        })  # fmt: skip
    order = {condition: place for place, condition in enumerate(about)}
    rows.sort(key=lambda row: (order[row["condition"]], row["trial"], row["episode"]))
    return pl.DataFrame(rows, infer_schema_length=None).select(*EPISODE_COLUMNS)
