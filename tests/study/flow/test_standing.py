"""Where a participant is: a fold of the log."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.study.design.parts import DeviceCheck
from qbumpers.study.flow.standing import (
    DAY,
    HOUR,
    after,
    device_suits,
    returning,
    seat_of,
    standing,
    verdict_on,
    window,
)
from qbumpers.study.flow.tables import Event
from tests.study.flow.studies import CHECK, block, study_of

STUDY = study_of(
    {"kind": "instructions", "text": "Read."},
    CHECK,
    block("training"),
    {"kind": "sitting", "after_days": 1, "within_days": 2},
    block("retention"),
)


def arrived(time=0.0, page="a"):
    return Event(time, "arrived", {"page": page})


def answered(part, time=1.0, **content):
    return Event(time, "answered", {"part": part, "content": content})


ASSIGNED = Event(
    2.0,
    "assigned",
    {"condition": "alone", "order": 0, "partner": "", "lengths": [], "overrides": []},
)
UP_TO_TRAINING = [
    arrived(), answered("consent", agree=True), answered("instructions"),
    answered("comprehension", q="2"), ASSIGNED,
]  # fmt: skip
UP_TO_SITTING = [*UP_TO_TRAINING, answered("training", 10.0)]


def test_the_way_through_the_study():
    found = standing(STUDY, UP_TO_TRAINING)
    assert found.part(STUDY).id == "training"
    assert (found.condition, found.sitting, found.outcome) == ("alone", 0, "")
    found = standing(STUDY, UP_TO_SITTING)
    assert window(STUDY, found) == (10 + DAY, 10 + 3 * DAY)
    found = standing(STUDY, [*UP_TO_SITTING, answered("sitting", 2 * DAY), answered("retention")])
    assert (found.part(STUDY).id, found.sitting) == ("debriefing", 1)
    assert after(STUDY, found, answered("debriefing")).outcome == "complete"


def test_wrong_answers_are_counted_until_there_are_too_many():
    before = UP_TO_TRAINING[:3]
    once = standing(STUDY, [*before, answered("comprehension", q="3")])
    assert (once.part(STUDY).id, once.wrong, once.outcome) == ("comprehension", 1, "")
    assert after(STUDY, once, answered("comprehension", q="3")).outcome == "failed"
    right = after(STUDY, once, answered("comprehension", q="2"))
    assert (right.part(STUDY).id, right.wrong) == ("training", 0)


def test_who_does_not_agree_does_not_take_part():
    assert standing(STUDY, [arrived(), answered("consent", agree=False)]).outcome == "no_consent"


@pytest.mark.parametrize(
    ("measured", "suits"),
    [
        ({}, True),
        ({"keyboard": False}, False),
        ({"width": 500}, False),
        ({"refresh": 20}, False),
        ({"refresh": 0}, True),  # not known
        ({"latency": 301}, False),
    ],
)
def test_devices_are_held_to_what_the_study_needs(measured, suits):
    study = study_of(
        {"kind": "device-check", "keyboard": True, "least_width": 600, "least_refresh": 30,
         "most_latency": 300},
        block("training"),
    )  # fmt: skip
    content = {"keyboard": True, "width": 800, "refresh": 60, "latency": 40, **measured}
    check = study.part("device-check")
    assert isinstance(check, DeviceCheck)
    assert device_suits(check, content) is suits
    assert verdict_on(check, content, 0) == ("next" if suits else "screened_out")


@pytest.mark.parametrize(
    ("policy", "page", "away", "what"),
    [
        ("resume", "a", 100 * HOUR, "on"),  # the same page, whose connection was lost
        ("block", "a", 1.0, "on"),
        ("resume", "b", 23 * HOUR, "on"),
        ("resume", "b", 25 * HOUR, "blocked"),
        ("restart", "b", 1.0, "restart"),
        ("restart", "b", 25 * HOUR, "blocked"),
        ("block", "b", 1.0, "blocked"),
    ],
)
def test_who_comes_back_is_treated_by_the_policy(policy, page, away, what):
    study = STUDY.model_copy(
        update={"returning": STUDY.returning.model_copy(update={"policy": policy})}
    )
    now = standing(study, UP_TO_TRAINING)
    assert returning(study, now, 2.0 + away, page, 2.0) == what


@pytest.mark.parametrize(
    ("time", "what"),
    [(DAY, "wait"), (10 + DAY, "open"), (10 + 3 * DAY, "open"), (11 + 3 * DAY, "late")],
)
def test_a_later_sitting_has_a_window(time, what):
    assert returning(STUDY, standing(STUDY, UP_TO_SITTING), time, "b", 10.0) == what


def test_a_sitting_that_is_begun_again_has_the_same_condition():
    later = [*UP_TO_SITTING, answered("sitting", 2 * DAY), Event(2 * DAY, "restarted", {})]
    found = standing(STUDY, later)
    assert (found.part(STUDY).id, found.condition, found.attempt) == ("retention", "alone", 1)
    first = standing(STUDY, [*UP_TO_TRAINING, Event(5.0, "restarted", {})])
    assert (first.part(STUDY).id, first.condition) == ("instructions", "alone")


def test_the_assignment_sees_who_waits_for_a_sitting_as_complete_until_it_is_too_late():
    now = standing(STUDY, UP_TO_SITTING)
    seat = seat_of(STUDY, "p", now, 2 * DAY, 10.0)
    assert (seat.progress, seat.trained) == ("complete", True)
    assert seat_of(STUDY, "p", now, 4 * DAY, 10.0).progress == "ended"
    early = standing(STUDY, UP_TO_TRAINING)
    assert seat_of(STUDY, "p", early, 3.0, 2.0)[3:6] == ("ongoing", 2.0, False)


@given(st.integers(0, len(UP_TO_SITTING)))
def test_a_log_in_two_pieces_leads_to_the_same_place(cut):
    found = standing(STUDY, UP_TO_SITTING[:cut])
    for event in UP_TO_SITTING[cut:]:
        found = after(STUDY, found, event)
    assert found == standing(STUDY, UP_TO_SITTING)
    assert found.number == 4
