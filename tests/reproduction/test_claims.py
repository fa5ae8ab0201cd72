"""Claims in words: how verdicts follow from evidence."""

import math

import pytest

from qbumpers.analysis.statistics import IntervalEstimate
from qbumpers.reproduction.claims import FAILS, HOLDS, OPEN, Claim, Evidence


def above(condition, what, low, high, wanted="above"):
    """Evidence with an interval, whose limit is 0."""
    return Evidence(condition, what, IntervalEstimate((low + high) / 2, low, high), 0.0, wanted)


def test_evidence_speaks_only_if_the_whole_interval_does():
    def speaks(low, high, wanted):
        return Evidence(
            "", "", IntervalEstimate((low + high) / 2, low, high), 0.0, wanted
        ).speaks_for

    assert (speaks(1, 2, "above"), speaks(1, 2, "below")) == (True, False)
    assert (speaks(-2, -1, "above"), speaks(-2, -1, "below")) == (False, True)
    assert speaks(-1, 1, "above") is None
    assert speaks(math.nan, math.nan, "below") is None


@pytest.mark.parametrize(
    ("every", "ends", "verdict"),
    [
        (True, [(1, 2), (3, 4)], HOLDS),
        (True, [(1, 2), (-1, 4)], OPEN),
        (True, [(-2, -1), (-1, 4)], FAILS),
        (False, [(-2, -1), (3, 4)], HOLDS),
        (False, [(-2, -1), (-1, 4)], OPEN),
        (False, [(-2, -1), (-4, -3)], FAILS),
    ],
)
def test_claims_about_every_and_about_some_setting(every, ends, verdict):
    rows = [above(str(place), "x", low, high) for place, (low, high) in enumerate(ends)]
    assert Claim("", "", every, rows).verdict == verdict


def test_all_evidence_on_a_setting_must_speak_for_it():
    rows = [above("a", "x", 1.0, 3.0), above("a", "y", -1.0, 1.0)]
    assert Claim("", "", True, rows).settings == {"a": None}
