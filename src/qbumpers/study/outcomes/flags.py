"""What is unusual about a participant, with its reason. A flag rejects nobody: a person decides."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Questionnaire
from qbumpers.study.outcomes.reading import Participant

FEWEST_TIMES = 20
"""Reaction times below which nothing is said of them."""

REGULAR, FAST, SLOW_LINK, OFTEN = 0.1, 100.0, 300.0, 5
"""Coefficient of variation of reaction times below which they are regular; median below which they
are fast, in milliseconds; round trip above which a connection is slow, likewise; how often the page
lost the focus for it to be often."""


class Flag(NamedTuple):
    """Something unusual.

    Attributes:
        participant: identifier.
        flag: its kind.
        reason: in words, with the number.
    """

    participant: str
    flag: str
    reason: str


def flags_of(study: Study, participant: Participant) -> list[Flag]:
    """What is unusual about a participant.

    Args:
        study: that they took part in.
        participant: what is recorded of them.
    """
    found = [*_of_times(participant), *_of_pages(participant), *_of_answers(study, participant)]
    return [Flag(participant.name, *each) for each in found]


def reaction_times(participant: Participant) -> np.ndarray:
    """Milliseconds from a state to the press that answered it, float64 [N], if both are known."""
    pairs = [
        (step["shown"], step["pressed"])
        for block in participant.blocks
        for step in block.times
        if step["shown"] is not None and step["pressed"] is not None
    ]
    return np.array([pressed - shown for shown, pressed in pairs if pressed >= shown])


def _of_times(participant: Participant) -> Iterator[tuple[str, str]]:
    times = reaction_times(participant)
    if len(times) < FEWEST_TIMES:
        return
    mean, median = float(times.mean()), float(np.median(times))
    variation = float(times.std(ddof=1)) / mean if mean > 0 else 0.0
    if variation < REGULAR:
        yield (
            "regular",
            f"{len(times)} reaction times with a coefficient of variation of {variation:.2f}; "
            f"people's are above {REGULAR}",
        )
    if median < FAST:
        yield "fast", f"median reaction time of {median:.0f} ms, below {FAST:.0f}"


def _of_pages(participant: Participant) -> Iterator[tuple[str, str]]:
    contents = [event.content["content"] for event in participant.answers().values()]
    untrusted = sum(content.get("untrusted", 0) for content in contents)
    blurs = sum(content.get("blurs", 0) for content in contents)
    if untrusted:
        yield "untrusted", f"{untrusted} presses that a program made (isTrusted is false)"
    if blurs >= OFTEN:
        yield "focus", f"the page lost the focus {blurs} times while it was played"
    for content in contents:
        if content.get("latency", 0) > SLOW_LINK:
            yield "connection", f"round trip of {content['latency']:.0f} ms"
    devices = {step["device"] for block in participant.blocks for step in block.times}
    if len(devices - {"none"}) > 1:
        yield "devices", f"played with {', '.join(sorted(devices - {'none'}))}"


def _of_answers(study: Study, participant: Participant) -> Iterator[tuple[str, str]]:
    for part, event in participant.answers().items():
        asked = study.part(part)
        if not isinstance(asked, Questionnaire):
            continue
        scales = [item.id for item in asked.all_items() if item.kind == "scale"]
        given = {event.content["content"].get(item) for item in scales}
        if len(scales) >= 4 and len(given) == 1:
            yield "straight", f"the same answer to all {len(scales)} scales of {part}"
