"""Who is assigned to which condition: a pure function of who is there already."""

from collections import Counter
from collections.abc import Sequence
from typing import Literal, NamedTuple

from qbumpers.study.design.conditions import Condition

Progress = Literal["complete", "ongoing", "ended"]


class Seat(NamedTuple):
    """A participant who was assigned before.

    Attributes:
        participant: identifier.
        condition: name of the condition.
        order: number of the order of counterbalanced parts.
        progress: "complete", "ongoing", or "ended" before the study was complete.
        heard: when they were last heard of, in seconds.
        trained: whether their training is over, so that another one can be yoked to them.
        partner: whom they are yoked to; empty for nobody.
    """

    participant: str
    condition: str
    order: int
    progress: Progress
    heard: float
    trained: bool = False
    partner: str = ""


class Assigned(NamedTuple):
    """What a participant is assigned to.

    Attributes:
        condition: name of the condition.
        order: number of the order of counterbalanced parts.
        partner: whom they are yoked to; empty for nobody.
    """

    condition: str
    order: int
    partner: str


def assign(
    conditions: Sequence[Condition],
    orders: int,
    seats: Sequence[Seat],
    now: float,
    stale_after: float,
    draw: float,
) -> Assigned | None:
    """The least filled condition, and within it the least filled order.

    Complete participants count, and ongoing ones who were heard of lately; stale and ended ones do
    not. A yoked condition can be had only while somebody has finished the training of the condition
    that it is yoked to and nobody who counts is yoked to them yet.

    Args:
        conditions: of the study.
        orders: how many orders of parts there are, at least 1.
        seats: everybody who was assigned before.
        now: the present time, in seconds.
        stale_after: seconds after which an ongoing participant no longer counts.
        draw: in [0, 1), chooses among equals.

    Returns:
        The assignment; None if every condition is full.
    """
    counted = [seat for seat in seats if counts(seat, now, stale_after)]
    filled = Counter(seat.condition for seat in counted)
    open_to: list[tuple[Condition, str]] = []
    for condition in conditions:
        partner = _partner(condition, seats, counted)
        if partner is not None and not _is_full(condition, conditions, filled):
            open_to.append((condition, partner))
    if not open_to:
        return None
    fewest = min(filled[condition.name] for condition, _ in open_to)
    least = [each for each in open_to if filled[each[0].name] == fewest]
    # One draw makes two choices: what is left of it after the first decides the second.
    place, rest = divmod(draw * len(least), 1.0)
    condition, partner = least[int(place)]
    ordered = Counter(seat.order for seat in counted if seat.condition == condition.name)
    fewest = min(ordered[order] for order in range(orders))
    among = [order for order in range(orders) if ordered[order] == fewest]
    return Assigned(condition.name, among[int(rest * len(among))], partner)


def counts(seat: Seat, now: float, stale_after: float) -> bool:
    """Whether a participant counts as filling a condition.

    Args:
        seat: of the participant.
        now: the present time, in seconds.
        stale_after: seconds after which an ongoing participant no longer counts.
    """
    fresh = now - seat.heard <= stale_after
    return seat.progress == "complete" or (seat.progress == "ongoing" and fresh)


def _is_full(condition: Condition, conditions: Sequence[Condition], filled: Counter[str]) -> bool:
    return any(
        sum(filled[other.name] for other in conditions if other.levels[factor] == level) >= cap
        for factor, level, cap in condition.caps
    )


def _partner(condition: Condition, seats: Sequence[Seat], counted: Sequence[Seat]) -> str | None:
    """Whom a participant of a condition would be yoked to; None if nobody can be."""
    if not condition.yoked_to:
        return ""
    taken = {seat.partner for seat in counted}
    for seat in seats:
        if seat.condition == condition.yoked_to and seat.trained and seat.participant not in taken:
            return seat.participant
    return None


class Yoke(NamedTuple):
    """What a participant has of the one whom they are yoked to; no personal data.

    Attributes:
        lengths: steps of each assisted episode of the training.
        overrides: how many of them were overridden.
    """

    lengths: tuple[int, ...]
    overrides: tuple[int, ...]


class Dose(NamedTuple):
    """How much a yoked participant is helped in an episode.

    Attributes:
        overrides: how many there are at most.
        probability: with which a worse proposal is overridden until then.
    """

    overrides: int
    probability: float


def yoked_dose(yoke: Yoke, episode: int, delivered: int) -> Dose:
    """How much help an assisted episode has: as much as the partner's, at other moments.

    Overrides are owed as they were made to the partner, up to and with this episode; those that
    could not be delivered, since too few proposals were worse, are owed in the next one. With the
    probability, twice the share of the partner's steps that were overridden, they come at random
    moments, whatever the state; and most often all of them come.

    Args:
        yoke: of the partner.
        episode: number of the assisted episode, from 0; the partner's last one serves if they had
            fewer.
        delivered: overrides in the assisted episodes before.

    Returns:
        The dose; of 0 overrides if none is owed.
    """
    theirs = min(episode, len(yoke.lengths) - 1)
    owed = max(0, sum(yoke.overrides[: theirs + 1]) - delivered)
    return Dose(owed, min(1.0, 2 * owed / yoke.lengths[theirs]))
