"""Tables of a study's data, with what each column means: the data dictionary comes from here."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Questionnaire
from qbumpers.study.outcomes.flags import flags_of, reaction_times
from qbumpers.study.outcomes.reading import Participant

MEASURES = ("pretest", "probes", "posttest", "retention", "transfer", "gain")
"""Of participants: mean scores of unassisted episodes, and posttest minus pretest."""


class Column(NamedTuple):
    """A column.

    Attributes:
        name: the same in all tables in which it means the same.
        description: what it holds.
        unit: of its numbers; empty if they have none.
    """

    name: str
    description: str
    unit: str = ""


class Table(NamedTuple):
    """A table.

    Attributes:
        name: of its file.
        description: what a row is.
        columns: in order.
        rows: a value for each column; None if it is unknown.
    """

    name: str
    description: str
    columns: Sequence[Column]
    rows: Sequence[Mapping[str, Any]]


_PARTICIPANT = Column("participant", "identifier of the participant, made up by the study")
_PART = Column("part", "id of the part of the study")
_TIME = Column("time", "when it happened, since 1970-01-01 UTC", "s")
_EPISODE = Column("episode", "number of the episode in its block, from 0")
_BLOCK = [
    Column("block", "id of the block"),
    Column("phase", "what the block is for"),
    _EPISODE,
]


def tables_of(study: Study, participants: Sequence[Participant]) -> list[Table]:
    """Every table of a study's data.

    Args:
        study: that they took part in.
        participants: what is recorded of them.
    """
    makers: list[Callable[[Study, Sequence[Participant]], Table]] = [
        _participants, _questionnaires, _episodes, _steps, _events, _attributions, _flags,
    ]  # fmt: skip
    return [make(study, participants) for make in makers]


def _participants(study: Study, participants: Sequence[Participant]) -> Table:
    factors = ["condition", *(factor.name for factor in study.factors)]
    columns = [
        _PARTICIPANT,
        Column("came", "when the participant came, since 1970-01-01 UTC", "s"),
        Column("duration", "from coming to the last event", "s"),
        Column("outcome", "how the study ended for the participant; empty while it goes on"),
        Column("assigned_to", "the condition, levels joined by /"),
        *(Column(f"level_{name}", f"level of the factor {name}") for name in factors),
        Column("order", "number of the order of counterbalanced parts"),
        Column("partner", "whom the participant is yoked to; empty for nobody"),
        Column("reloads", "how often the page was loaded again"),
        Column("reaction_time", "median time from a state to the press that answered it", "ms"),
        *(
            Column(
                f"mean_{name}",
                "mean score of posttest minus that of pretest"
                if name == "gain"
                else f"mean score of the unassisted episodes of {name}",
                "reward units",
            )
            for name in MEASURES
        ),
    ]
    conditions = {condition.name: condition for condition in study.all_conditions()}
    rows: list[dict[str, Any]] = []
    for each in participants:
        condition = conditions.get(each.now.condition)
        times = reaction_times(each)
        rows.append({
            "participant": each.name,
            "came": each.came,
            "duration": each.events[-1].time - each.came if each.events else 0.0,
            "outcome": each.now.outcome,
            "assigned_to": each.now.condition,
            **{f"level_{name}": condition.levels[name] if condition else None for name in factors},
            "order": each.now.order if condition else None,
            "partner": each.now.partner,
            "reloads": max(0, sum(event.kind == "arrived" for event in each.events) - 1),
            "reaction_time": float(sorted(times)[len(times) // 2]) if len(times) else None,
            **{f"mean_{name}": _known(each.measure(name)) for name in MEASURES},
        })  # fmt: skip
    return Table("participants", "a row per participant", columns, rows)


def _known(number: float) -> float | None:
    return None if number != number else number


def _questionnaires(study: Study, participants: Sequence[Participant]) -> Table:
    asked = [part for part in study.parts if isinstance(part, Questionnaire)]
    columns = [_PARTICIPANT]
    for part in asked:
        columns += [Column(f"{part.id}_{item.id}", item.text) for item in part.all_items()]
        if part.instrument == "nasa-tlx":
            columns.append(
                Column(f"{part.id}_score", "raw NASA-TLX: mean of its six scales", "0 to 100")
            )
    rows: list[dict[str, Any]] = []
    for each in participants:
        row: dict[str, Any] = {"participant": each.name}
        for part in asked:
            event = each.answers().get(part.id)
            content: Mapping[str, Any] = event.content["content"] if event else {}
            row |= {f"{part.id}_{item.id}": content.get(item.id) for item in part.all_items()}
            if part.instrument == "nasa-tlx" and content:
                scales = [content[item.id] for item in part.all_items()[:6]]
                row[f"{part.id}_score"] = sum(scales) / len(scales)
        rows.append({column.name: row.get(column.name) for column in columns})
    return Table("questionnaires", "a row per participant", columns, rows)


def _episodes(study: Study, participants: Sequence[Participant]) -> Table:
    columns = [
        _PARTICIPANT,
        *_BLOCK,
        Column("assisted", "whether the condition's assistant could help"),
        Column("assistant", "name of the assistant's rule"),
        Column("score", "sum of the rewards, undiscounted", "reward units"),
        Column("length", "steps", "steps"),
        Column("overrides", "steps that were overridden", "steps"),
        Column("success", "whether the task announced a success"),
        Column("crash", "whether the task announced a crash"),
    ]
    rows = [
        {
            "participant": each.name,
            "block": block.block,
            "phase": block.phase,
            "episode": episode.number,
            "assisted": episode.choice.assisted,
            "assistant": episode.choice.acting[0],
            "score": episode.total,
            "length": episode.length,
            "overrides": episode.overrides,
            "success": episode.success,
            "crash": episode.crash,
        }
        for each in participants
        for block in each.blocks
        for episode in block.episodes
    ]
    return Table("episodes", "a row per episode of a block that was finished", columns, rows)


_STEP_COLUMNS = (
    Column("proposed", "number of the action that the participant proposed"),
    Column("executed", "number of the action that was executed"),
    Column("overridden", "whether the assistant overrode the proposal"),
    Column("undone", "whether the state was taken back"),
    Column("probability", "of overriding, before the coin"),
    Column("coin", "in [0, 1), decided whether to override"),
    Column("tie", "in [0, 1), chose among equally good actions"),
    Column("projected_return", "what the assistant expected of the proposal", "reward units"),
    Column("reward", "of the step", "reward units"),
    Column("device", "with which the action was proposed"),
    Column("shown", "when the state was shown, by the page's clock", "ms"),
    Column("pressed", "when the action was pressed, by the page's clock", "ms"),
    Column("received", "when the server received it, since 1970-01-01 UTC", "s"),
    Column("applied", "when it was applied, since 1970-01-01 UTC", "s"),
)


def _steps(study: Study, participants: Sequence[Participant]) -> Table:
    columns = [
        _PARTICIPANT, *_BLOCK, Column("step", "number of the step in its episode, from 0"),
        Column("state", "number of the state, or what was observed, joined by spaces"),
        *_STEP_COLUMNS,
    ]  # fmt: skip
    rows = [row for each in participants for row in _steps_of(each)]
    return Table("steps", "a row per step of a block that was finished", columns, rows)


def _steps_of(participant: Participant) -> Iterator[dict[str, Any]]:
    for block in participant.blocks:
        number = 0
        for episode, steps in enumerate(block.steps):
            for place, step in enumerate(steps):
                fields = step._asdict()
                state: Any = step.state
                numbers = state if isinstance(state, int) else " ".join(map(str, state.tolist()))
                yield {
                    "participant": participant.name,
                    "block": block.block,
                    "phase": block.phase,
                    "episode": episode,
                    "step": place,
                    "state": numbers,
                    **{c.name: fields[c.name] for c in _STEP_COLUMNS if c.name in fields},
                    **block.times[number],
                }
                number += 1


def _events(study: Study, participants: Sequence[Participant]) -> Table:
    columns = [
        _PARTICIPANT, _TIME, Column("event", "what happened"), _PART,
        Column("page_shown", "when the page was shown, by its clock", "ms"),
        Column("page_answered", "when it was answered, likewise", "ms"),
    ]  # fmt: skip
    rows = [
        {
            "participant": each.name,
            "time": event.time,
            "event": event.kind,
            "part": event.content.get("part"),
            "page_shown": event.content.get("shown"),
            "page_answered": event.content.get("at"),
        }
        for each in participants
        for event in each.events
    ]
    return Table("events", "a row per entry of the log", columns, rows)


def _attributions(study: Study, participants: Sequence[Participant]) -> Table:
    columns = [
        _PARTICIPANT, _PART, Column("step_of_block", "number of the step in its block, from 0"),
        Column("was", "who it was: me, or the assistant"),
        Column("said", "who the participant said that it was: me, assistant or unsure"),
    ]  # fmt: skip
    rows: list[dict[str, Any]] = []
    for each in participants:
        steps = {
            (block.session, number): step
            for block in each.blocks
            for number, step in enumerate(step for steps in block.steps for step in steps)
        }
        for event in each.events:
            key = (str(event.content.get("session")), int(event.content.get("number") or 0))
            if event.kind == "attributed" and key in steps:
                rows.append({
                    "participant": each.name,
                    "part": event.content["part"],
                    "step_of_block": event.content["number"],
                    "was": "assistant" if steps[key].overridden else "me",
                    "said": event.content["answer"],
                })  # fmt: skip
    return Table("attributions", 'a row per answer to "was that you?"', columns, rows)


def _flags(study: Study, participants: Sequence[Participant]) -> Table:
    columns = [
        _PARTICIPANT, Column("flag", "kind of what is unusual"),
        Column("reason", "what is unusual, in words"),
    ]  # fmt: skip
    rows = [flag._asdict() for each in participants for flag in flags_of(study, each)]
    return Table("flags", "a row per flag; a flag rejects nobody", columns, rows)
