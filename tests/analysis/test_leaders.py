"""Which condition is best and how sure that is, against truths that are known."""

import math

import numpy as np
import pytest
import scipy.stats

from qbumpers.analysis.leaders import leader, trade
from tests.narrowing import present

MEANS = {"low": 0.0, "best": 10.0, "near": 9.5, "idle": 9.9}


def samples_of(means, generator, trials=20, spread=4.0):
    return {name: generator.normal(mean, spread, trials) for name, mean in means.items()}


def exactly(means):
    return {name: np.full(3, mean) for name, mean in means.items()}


def test_the_best_and_its_lead_without_chance():
    found = leader(exactly(MEANS))
    assert (found.condition, found.second, found.trials, found.others) == ("best", "idle", 3, 3)
    assert found.ahead == pytest.approx((0.1, 0.1, 0.1))
    assert found.contenders == []


def test_equals_of_the_best_may_be_as_good():
    found = leader(exactly({"first": 1.0, "second": 1.0, "third": 0.0}))
    assert (found.condition, found.contenders) == ("first", ["second"])


def test_the_same_treatment_is_no_rival():
    found = leader(exactly({**MEANS, "idle": 11.0, "other": 10.9}), alike=["idle", "other"])
    assert (found.condition, found.second, found.others) == ("idle", "best", 3)
    apart = leader(exactly(MEANS), alike=["idle", "near"])  # the best overrides: both are rivals
    assert apart.others == 3


@pytest.mark.parametrize("paired", [False, True])
def test_contenders_are_those_whose_simultaneous_interval_reaches_the_best(paired):
    samples = samples_of(MEANS, np.random.default_rng(5))
    found = leader(samples, paired=paired)
    best = samples[found.condition]
    expected = []
    for name, values in samples.items():
        if name == found.condition:
            continue
        test = (
            scipy.stats.ttest_rel(values, best)
            if paired
            else scipy.stats.ttest_ind(values, best, equal_var=False)
        )
        if test.confidence_interval(1 - 0.05 / 3).high >= 0:
            expected.append(name)
    assert sorted(present(found.contenders)) == sorted(expected)
    assert "low" not in present(found.contenders)


def test_the_truly_best_is_named_in_95_of_100_experiments():
    generator, repetitions, missed = np.random.default_rng(11), 400, 0
    for _ in range(repetitions):
        found = leader(samples_of({"a": 1.0, "b": 0.9, "c": 0.9, "d": 0.0}, generator, 8, 1.0))
        missed += "a" not in [found.condition, *present(found.contenders)]
    assert missed / repetitions <= 0.05 + 3 * math.sqrt(0.05 * 0.95 / repetitions)


def test_single_trials_leave_it_open():
    found = leader({"a": np.array([1.0]), "b": np.array([0.0])})
    assert (found.condition, found.contenders) == ("a", None)
    assert math.isnan(present(found.ahead).low)


def test_a_condition_alone_has_no_rival():
    found = leader({"only": np.array([1.0, 2.0])})
    assert (found.condition, found.others, found.ahead, found.second) == ("only", 0, None, "")


def test_a_trade_is_what_one_gains_and_the_other_loses():
    samples = {
        "helper": np.array([[87.0, -300.0], [89.0, -340.0]]),
        "teacher": np.array([[50.0, -21.0], [52.0, -19.0]]),
    }
    found = trade(samples, "helper", "teacher")
    assert (found.performing, found.teaching) == ("helper", "teacher")
    assert (found.gained.mean, found.lost.mean) == (37.0, 300.0)
    test = scipy.stats.ttest_ind([-21.0, -19.0], [-300.0, -340.0], equal_var=False)
    interval = test.confidence_interval(0.95)
    assert (found.lost.low, found.lost.high) == pytest.approx((interval.low, interval.high))
