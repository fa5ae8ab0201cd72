"""Flags have reasons; each is raised by what it says, and nobody who is as people are has one."""

import numpy as np
import pytest

from qbumpers.study.flow.tables import Event
from qbumpers.study.outcomes.flags import flags_of


def changed(participant, *, gaps=None, content=None, part=None, device="keyboard"):
    blocks = []
    for block in participant.blocks:
        times = [
            {**step, "shown": 0.0, "pressed": float(gap), "device": device}
            for step, gap in zip(block.times, gaps or [300.0] * len(block.times), strict=False)
        ]
        blocks.append(block._replace(times=times))
    events = list(participant.events)
    if content is not None:
        said = {"part": part, "content": content, "shown": 1.0, "at": 2.0}
        events.append(Event(events[-1].time, "answered", said))
    return participant._replace(blocks=blocks, events=events)


@pytest.fixture
def somebody(participants):
    return next(each for each in participants if each.now.outcome == "complete")


HUMAN = np.random.default_rng(1).gamma(4, 100, 400).tolist()


def kinds(study, participant):
    return {flag.flag for flag in flags_of(study, participant)}


def test_who_is_as_people_are_has_no_flag(study, somebody):
    assert kinds(study, changed(somebody, gaps=HUMAN)) == set()


@pytest.mark.parametrize(
    ("change", "flag", "reason"),
    [
        ({"gaps": [300.0, 301.0] * 200}, "regular", "coefficient of variation of 0.00"),
        ({"gaps": [gap / 10 for gap in HUMAN]}, "fast", "median reaction time of 3"),
        ({"content": {"untrusted": 4, "blurs": 0}, "part": "posttest"}, "untrusted", "4 presses"),
        ({"content": {"untrusted": 0, "blurs": 9}, "part": "posttest"}, "focus", "9 times"),
        ({"content": dict.fromkeys(
            ("mental", "physical", "temporal", "performance", "effort", "frustration"), 50),
          "part": "nasa-tlx"}, "straight", "all 6 scales of nasa-tlx"),
    ],
)  # fmt: skip
def test_each_flag_is_raised_with_its_reason(study, somebody, change, flag, reason):
    found = flags_of(study, changed(somebody, **{"gaps": HUMAN, **change}))
    assert [each.flag for each in found] == [flag]
    assert reason in found[0].reason
