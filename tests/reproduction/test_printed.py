"""Printed numbers beside measured ones: when they agree, and which there are."""

import math

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.statistics import IntervalEstimate, mean_interval
from qbumpers.reproduction.printed import (
    Comparison,
    agrees,
    compare,
    disagreements,
    printed_marks,
    printed_numbers,
)

NAN = float("nan")


def how_often_they_agree(printed, measured):
    pairs = zip(printed, measured, strict=True)
    return sum(agrees(mean, 0.0, mean_interval(sample)) is True for mean, sample in pairs)


def test_two_samples_of_one_truth_agree_99_times_in_100():
    generator = np.random.default_rng(99)
    repetitions, trials = 10_000, 100
    printed = generator.normal(-200.0, 60.0, (repetitions, trials)).mean(axis=1)
    measured = generator.normal(-200.0, 60.0, (repetitions, trials))
    agreed = how_often_they_agree(printed, measured)
    # Four standard errors of a share of 0.99 among 10,000: 4 * 0.001; that the spread is itself
    # an estimate, of 100 trials, moves the share by less than 0.001 more.
    assert agreed / repetitions == pytest.approx(0.99, abs=0.005)


def test_samples_of_truths_six_errors_apart_seldom_agree():
    generator = np.random.default_rng(98)
    apart = 6 * 60.0 * np.sqrt(2 / 100)
    printed = generator.normal(-200.0, 60.0, (1000, 100)).mean(axis=1)
    measured = generator.normal(-200.0 + apart, 60.0, (1000, 100))
    agreed = how_often_they_agree(printed, measured)
    assert agreed <= 5  # a difference 3.4 errors below its mean: a chance of about 4e-4 each


@pytest.mark.parametrize(("offset", "verdict"), [(3.63, True), (3.65, False)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_criterion_is_the_99_per_cent_interval_of_a_difference(offset, sign, verdict):
    # A standard error of 1: two of them, 2.5758 * sqrt(2) = 3.6428.
    measured = IntervalEstimate(10.0, 10 - 1.95996, 10 + 1.95996)
    assert agrees(10 + sign * offset, 0.0, measured) is verdict
    assert agrees(10 + sign * (offset + 0.5), 0.5, measured) is verdict


def test_a_number_without_spread_agrees_within_what_printing_leaves_open():
    assert agrees(87.0, 0.05, IntervalEstimate(87.04, 87.04, 87.04)) is True
    assert agrees(87.0, 0.05, IntervalEstimate(87.06, 87.06, 87.06)) is False


@pytest.mark.parametrize("measured", [(NAN, NAN, NAN), (5.0, NAN, NAN), (NAN, 1.0, 2.0)])
def test_what_was_not_measured_neither_agrees_nor_disagrees(measured):
    assert agrees(5.0, 0.1, IntervalEstimate(*measured)) is None


def test_the_numbers_are_those_that_the_paper_prints():
    numbers = printed_numbers("cliff-walking")
    printed = {(n["condition"], n["measure"]): n["value"] for n in numbers["number"]}
    bumpers, thresholds = "stochastic-q-bumpers/alpha=", "local-q-thresholding/alpha="
    # Section 4.2 and Figure 2; "51..52" for 0.0195, so 51.5 with half a unit either way.
    assert printed == {
        (f"{thresholds}1", "unassisted"): -26.6,
        (f"{bumpers}0.7", "assisted"): 53.9,
        (f"{bumpers}0.7", "unassisted"): -222.6,
        (f"{bumpers}0.2", "assisted"): 66.6,
        (f"{bumpers}0.2", "unassisted"): -465.6,
        (f"{thresholds}0.0195", "assisted"): 51.5,
        (f"{thresholds}0.0195", "unassisted"): -486.5,
        (f"{thresholds}0.0191", "assisted"): 51.3,
        (f"{thresholds}0.0191", "unassisted"): -486.9,
        ("maximal", "assisted"): 87.0,
    }
    ranges = {n["condition"]: n["printed"] for n in numbers["number"] if "printed" in n}
    assert ranges == {f"{thresholds}0.0195": "51 to 52"}
    regrets = [(r["matched"], r["value"]) for r in numbers["regret"]]
    from_points = 1 - (222.6 - 26.6) / (486.5 - 26.6)
    assert regrets == [
        ("performance", 0.51),
        ("performance", pytest.approx(from_points, abs=5e-4)),
        ("learning", 0.43),
    ]
    gain = 1 - (87 - 66.6) / (87 - 51.3)
    assert gain == pytest.approx(0.43, abs=0.005)


SUMMARY = pl.DataFrame(
    {
        "condition": ["maximal", "local-q-thresholding/alpha=1", "none"],
        "assisted_mean": [87.0, -350.0, -350.0],
        "assisted_low": [87.0, -360.0, -360.0],
        "assisted_high": [87.0, -340.0, -340.0],
        "unassisted_mean": [-2800.0, -126.6, -26.6],
        "unassisted_low": [-3000.0, None, -30.0],
        "unassisted_high": [-2600.0, None, -20.0],
    }
)
REDUCTION = IntervalEstimate(0.3, 0.25, 0.35)
REGRET = Regret(
    0, "x", "y", 50.0, -500.0, IntervalEstimate(-300.0, -310.0, -290.0), -20.0, REDUCTION,
    IntervalEstimate(480.0, 400.0, 560.0),
)  # fmt: skip


def test_conditions_that_were_run_are_compared_and_no_others():
    found = compare(printed_numbers("cliff-walking"), SUMMARY, {})
    assert [(row.what, row.published, row.agrees) for row in found] == [
        ("local-q-thresholding/alpha=1, unassisted", -26.6, None),
        ("maximal, assisted", 87.0, True),
    ]
    assert found[0].measured.mean == -126.6
    assert math.isnan(found[0].measured.low)
    assert found[1].measured == IntervalEstimate(87.0, 87.0, 87.0)


def test_a_printed_range_is_told_as_the_paper_prints_it():
    numbers = [
        {"condition": "maximal", "measure": "assisted", "value": 86.5, "spread": 0.5, **printed}
        for printed in ({"printed": "86 to 87"}, {})
    ]
    found = compare({"number": numbers, "regret": []}, SUMMARY, {})
    assert [(row.printed, row.published) for row in found] == [("86 to 87", 86.5), ("86.5", 86.5)]
    small = [{"matched": "performance", "value": 0.574, "spread": 0.001}]
    [row] = compare({"number": [], "regret": small}, SUMMARY, {"performance": REGRET})
    assert row.printed == "0.57"


def test_regrets_are_compared_by_what_is_matched():
    found = compare(printed_numbers("cliff-walking"), SUMMARY, {"performance": REGRET})[2:]
    assert [(row.what, row.published, row.agrees) for row in found] == [
        ("less regret in learning, matched performance", 0.51, False),
        ("less regret in learning, matched performance", 0.574, False),
    ]
    assert found[0].measured == REDUCTION
    assert "57%" in found[0].note
    [row] = compare({"number": [], "regret": printed_numbers("cliff-walking")["regret"]}, SUMMARY,
                    {"learning": REGRET})  # fmt: skip
    assert row.what == "less regret in performance, matched learning"


def test_disagreement_with_the_paper_is_cautioned_about():
    unknown = IntervalEstimate(0.5, NAN, NAN)
    verdicts = [True, False, None, False]
    rows = [Comparison("x", 1.0, "1", unknown, verdict, "") for verdict in verdicts]
    [caution] = disagreements(rows)
    assert caution.startswith("2 of 4 numbers that the paper prints disagree")
    assert disagreements(rows[:1]) == []


def test_points_of_the_paper_need_both_numbers():
    marks = printed_marks(printed_numbers("cliff-walking"))
    assert marks.points == {
        "stochastic-q-bumpers/alpha=0.7": (53.9, -222.6),
        "stochastic-q-bumpers/alpha=0.2": (66.6, -465.6),
        "local-q-thresholding/alpha=0.0195": (51.5, -486.5),
        "local-q-thresholding/alpha=0.0191": (51.3, -486.9),
    }
