"""Where a participant is in the study: a fold of what happened to them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from qbumpers.study.design.assignment import Progress, Seat, Yoke
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import (
    AnyPart,
    Block,
    Comprehension,
    Consent,
    Debriefing,
    DeviceCheck,
    Sitting,
)
from qbumpers.study.flow.tables import Event

DAY, HOUR, MINUTE = 86_400.0, 3600.0, 60.0
"""In seconds."""


class Standing(NamedTuple):
    """Where a participant is.

    Attributes:
        parts: ids of the study's parts in this participant's order.
        place: of the present part among them.
        number: of the page; it goes up with whatever leads to another page.
        wrong: failed attempts at the present comprehension check.
        outcome: how the study ended for them; empty while it goes on.
        condition: its name; empty before the assignment.
        order: number of the order of counterbalanced parts.
        partner: whom they are yoked to; empty for nobody.
        yoke: what they have of that one; None for nobody.
        sitting: number of the present sitting, from 0.
        attempt: how often the sittings were begun again so far.
        reached: when the present part was reached, in seconds since 1970.
        heard: when they were last heard of, likewise.
        page: what the page was that they last came with.
    """

    parts: tuple[str, ...]
    place: int = 0
    number: int = 0
    wrong: int = 0
    outcome: str = ""
    condition: str = ""
    order: int = 0
    partner: str = ""
    yoke: Yoke | None = None
    sitting: int = 0
    attempt: int = 0
    reached: float = 0.0
    heard: float = 0.0
    page: str = ""

    def part(self, study: Study) -> AnyPart:
        """The present part."""
        return study.part(self.parts[self.place])


def standing(study: Study, events: Iterable[Event]) -> Standing:
    """Where a participant is.

    Args:
        study: that they take part in.
        events: everything that happened to them, in order.
    """
    found = Standing(tuple(study.orders()[0]))
    for event in events:
        found = after(study, found, event)
    return found


def after(study: Study, before: Standing, event: Event) -> Standing:
    """Where a participant is after one more event.

    Args:
        study: that they take part in.
        before: where they were.
        event: what happened.
    """
    heard = before._replace(heard=event.time)
    change = _CHANGES.get(event.kind)
    return change(study, heard, event) if change else heard


def _arrived(study: Study, before: Standing, event: Event) -> Standing:
    return before._replace(page=event.content["page"], reached=before.reached or event.time)


def _assigned(study: Study, before: Standing, event: Event) -> Standing:
    content: Mapping[str, Any] = event.content
    yoke = _yoke(content) if content["partner"] else None
    return before._replace(
        parts=tuple(study.orders()[int(content["order"])]),
        condition=content["condition"],
        order=content["order"],
        partner=content["partner"],
        yoke=yoke,
    )


def _yoke(content: Mapping[str, Sequence[int]]) -> Yoke:
    return Yoke(tuple(content["lengths"]), tuple(content["overrides"]))


def _answered(study: Study, before: Standing, event: Event) -> Standing:
    part = study.part(event.content["part"])
    verdict = verdict_on(part, event.content["content"], before.wrong)
    found = before._replace(number=before.number + 1)
    if verdict == "again":
        return found._replace(wrong=before.wrong + 1)
    if verdict != "next":
        return found._replace(outcome=verdict)
    sitting = before.sitting + isinstance(part, Sitting)
    return found._replace(place=before.place + 1, wrong=0, reached=event.time, sitting=sitting)


def _restarted(study: Study, before: Standing, event: Event) -> Standing:
    first = first_place(study, before)
    return before._replace(
        place=first, number=before.number + 1, wrong=0, attempt=before.attempt + 1,
        reached=event.time,
    )  # fmt: skip


def _ended(study: Study, before: Standing, event: Event) -> Standing:
    return before._replace(outcome=event.content["outcome"], number=before.number + 1)


_CHANGES: Mapping[str, Callable[[Study, Standing, Event], Standing]] = {
    "arrived": _arrived,
    "assigned": _assigned,
    "answered": _answered,
    "restarted": _restarted,
    "ended": _ended,
}


def verdict_on(part: AnyPart, content: Mapping[str, Any], wrong: int) -> str:
    """What follows from an answer.

    Args:
        part: that was answered.
        content: of the answer.
        wrong: failed attempts at it before.

    Returns:
        "next"; "again"; or the outcome with which the study ends.
    """
    if isinstance(part, Consent):
        return "next" if content["agree"] else "no_consent"
    if isinstance(part, DeviceCheck):
        return "next" if device_suits(part, content) else "screened_out"
    if isinstance(part, Comprehension):
        if all(content.get(question.id) == question.answer for question in part.questions):
            return "next"
        return "again" if wrong + 1 < part.attempts else "failed"
    return "complete" if isinstance(part, Debriefing) else "next"


def device_suits(check: DeviceCheck, measured: Mapping[str, Any]) -> bool:
    """Whether a device is as a study needs it.

    Args:
        check: what is needed.
        measured: `keyboard`, whether a key was pressed; `width` in pixels; `refresh` per second, 0
            if it is not known; `latency`, in milliseconds.
    """
    return bool(
        (measured["keyboard"] or not check.keyboard)
        and measured["width"] >= check.least_width
        and (measured["refresh"] >= check.least_refresh or not measured["refresh"])
        and measured["latency"] <= check.most_latency
    )


def first_place(study: Study, now: Standing) -> int:
    """The place of the part with which the present sitting begins, consent left out."""
    before = [
        place
        for place, name in enumerate(now.parts[: now.place])
        if isinstance(study.part(name), Sitting | Consent)
    ]
    return before[-1] + 1 if before else 0


def needs_assignment(study: Study, now: Standing) -> bool:
    """Whether the present part is one before which a participant must be assigned."""
    if now.condition or now.outcome:
        return False
    part = now.part(study)
    if isinstance(part, Block) and part.phase != "practice":
        return True
    return any(part.id in group for group in study.counterbalance)


def window(study: Study, now: Standing) -> tuple[float, float] | None:
    """When the next sitting can be begun, in seconds since 1970; None if they wait for none."""
    part = now.part(study)
    if now.outcome or not isinstance(part, Sitting):
        return None
    opens = now.reached + part.after_days * DAY
    return opens, opens + part.within_days * DAY


Return = Literal["on", "open", "wait", "restart", "late", "blocked"]


def returning(study: Study, now: Standing, time: float, page: str, heard: float) -> Return:
    """What becomes of a participant who comes back.

    Args:
        study: that they take part in.
        now: where they are.
        time: the present one, in seconds since 1970.
        page: with which they come.
        heard: when they were last heard of, in seconds since 1970.

    Returns:
        "on", they go on; "open", the next sitting begins, "wait", it is too early for it, or
        "late", too late; "restart", the sitting begins again; "blocked", they are refused.
    """
    if now.outcome:
        return "on"
    waiting = window(study, now)
    if waiting is not None:
        opens, closes = waiting
        return "wait" if time < opens else "open" if time <= closes else "late"
    if page == now.page or now.place == first_place(study, now):
        return "on"
    if time - heard > study.returning.within_hours * HOUR:
        return "blocked"
    policies: dict[str, Return] = {"resume": "on", "restart": "restart", "block": "blocked"}
    return policies[study.returning.policy]


def seat_of(study: Study, participant: str, now: Standing, time: float, heard: float) -> Seat:
    """A participant as the assignment sees them.

    Args:
        study: that they take part in.
        participant: identifier.
        now: where they are.
        time: the present one, in seconds since 1970.
        heard: when they were last heard of, likewise.
    """
    trained = [place for place, name in enumerate(now.parts) if _is_training(study.part(name))]
    waiting = window(study, now)
    progress: Progress = "ongoing"
    if now.outcome == "complete" or (waiting is not None and time <= waiting[1]):
        progress = "complete"  # a sitting is over, and the next one may still come
    elif now.outcome or waiting is not None:
        progress = "ended"
    is_trained = now.place > max(trained, default=len(now.parts)) or now.outcome == "complete"
    return Seat(participant, now.condition, now.order, progress, heard, is_trained, now.partner)


def _is_training(part: AnyPart) -> bool:
    return isinstance(part, Block) and part.phase == "training"


def training_of(study: Study) -> list[Block]:
    """The blocks in which the assistant helps."""
    return [part for part in study.parts if isinstance(part, Block) and part.phase == "training"]


def attempts_at(parts: Sequence[str], study: Study, events: Iterable[Event]) -> dict[str, int]:
    """Under which attempt each block was finished; a block that was not is left out.

    Args:
        parts: ids.
        study: that they are of.
        events: of a participant, in order.
    """
    found: dict[str, int] = {}
    now = Standing(tuple(study.orders()[0]))
    for event in events:
        if event.kind == "answered" and event.content["part"] in parts:
            found[event.content["part"]] = now.attempt
        now = after(study, now, event)
    return found
