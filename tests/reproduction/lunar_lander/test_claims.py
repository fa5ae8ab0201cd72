"""Claims in words, judged from trials whose truth is known."""

import math

import numpy as np
import polars as pl
import pytest
import scipy.stats
from qbumpers.analysis.claims import (
    FAILS,
    HOLDS,
    OPEN,
    Claim,
    Evidence,
    judged,
    telling,
)

from qbumpers.analysis.measures import MEASURES
from qbumpers.analysis.page.headlines import told
from qbumpers.analysis.statistics import IntervalEstimate

BUMPERS = {alpha: f"stochastic-q-bumpers/alpha={alpha:g}" for alpha in (0.0, 0.5, 1.0)}
THRESHOLDS = {a: f"local-q-thresholding/alpha={a:g}" for a in (0.0, 0.9, 0.95, 0.999, 1.0)}
NONE = (150.0, 140.0, 0.8)  # return with the assistant, without it, success without it


def trials_of(bumpers, thresholds, spread=5.0, trials=10, seed=4):
    """Made-up trials: levels of bumpers and of thresholding by alpha, as `NONE`."""
    generator = np.random.default_rng(seed)
    levels = {"none": (None, NONE), "maximal": (None, (230.0, -200.0, 0.0))}
    levels |= {BUMPERS[alpha]: (alpha, level) for alpha, level in bumpers.items()}
    levels |= {THRESHOLDS[alpha]: (alpha, level) for alpha, level in thresholds.items()}
    rows = []
    for condition, (alpha, (assisted, unassisted, success)) in levels.items():
        quiet = condition == "none" or (alpha == 1 and condition.startswith("local"))
        rows += [
            {
                **dict.fromkeys(MEASURES),
                "condition": condition,
                "assistant": condition.partition("/")[0],
                "alpha": alpha,
                "learner": "double-dqn",
                "trial": trial,
                "assisted": generator.normal(assisted, spread),
                "unassisted": generator.normal(unassisted, spread),
                "unassisted_success": generator.normal(success, spread / 200),
                "overrides": 0.0 if quiet else 10.0,
            }
            for trial in range(trials)
        ]
    return pl.DataFrame(rows, schema_overrides={"alpha": pl.Float64}, infer_schema_length=None)


AS_CLAIMED = {
    "bumpers": {0.0: (220.0, -100.0, 0.1), 0.5: (210.0, 50.0, 0.5), 1.0: (190.0, 150.0, 0.8)},
    "thresholds": {
        0.0: (200.0, -200.0, 0.0), 0.9: (170.0, -150.0, 0.05), 0.95: (168.0, -150.0, 0.05),
        0.999: (165.0, -140.0, 0.1), 1.0: NONE,
    },
}  # fmt: skip
REVERSED = {
    "bumpers": {0.0: (180.0, -200.0, 0.0), 1.0: (160.0, -150.0, 0.0)},
    "thresholds": {0.0: (230.0, 0.0, 0.5), 0.9: (200.0, 140.0, 0.8), 0.95: (190.0, 145.0, 0.8)},
}


def judge(world, **changes):
    return judged("lunar-lander", trials_of(**world, **changes), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("world", "spread", "verdict"),
    [(AS_CLAIMED, 5.0, HOLDS), (REVERSED, 5.0, FAILS), (AS_CLAIMED, 900.0, OPEN)],
    ids=["as-claimed", "reversed", "noise"],
)
def test_verdicts_follow_from_the_trials(world, spread, verdict):
    assert [claim.verdict for claim in judge(world, spread=spread)] == [verdict] * 3


def test_one_setting_that_teaches_refutes_a_claim_about_all():
    thresholds = {**AS_CLAIMED["thresholds"], 0.95: (168.0, 130.0, 0.8)}
    destroys, *_ = judge({**AS_CLAIMED, "thresholds": thresholds})
    assert destroys.verdict == FAILS
    assert destroys.settings == {
        THRESHOLDS[0.9]: True,
        THRESHOLDS[0.95]: False,
        THRESHOLDS[0.999]: True,
    }


def test_learning_that_is_lost_by_less_than_half_is_not_destroyed():
    thresholds = {0.9: (170.0, 80.0, 0.6)}
    destroys, *_ = judge({**AS_CLAIMED, "thresholds": thresholds})
    assert destroys.verdict == FAILS
    worse, *_ = judge({**AS_CLAIMED, "thresholds": {0.9: (170.0, -150.0, 0.6)}})
    assert worse.verdict == FAILS  # returns are lost, but they still succeed


def test_performance_that_rises_where_learning_goes_does_not_keep_it():
    bumpers = {0.0: (220.0, -100.0, 0.1), 0.5: (210.0, 50.0, 0.5), 1.0: (120.0, 150.0, 0.8)}
    _, keeps, _ = judge({**AS_CLAIMED, "bumpers": bumpers})
    assert keeps.verdict == FAILS
    assert set(keeps.settings.values()) == {False}


def test_intervals_are_welchs_and_hold_for_all_settings_at_once():
    trials = trials_of(**AS_CLAIMED)
    destroys, keeps, _ = judged("lunar-lander", trials, np.random.default_rng(1))
    for claim, measure, condition, share, settings in (
        (destroys, "unassisted", THRESHOLDS[0.9], 1.0, 3),
        (destroys, "unassisted_success", THRESHOLDS[0.999], 0.5, 3),
        (keeps, "assisted", BUMPERS[0.5], 1.0, 3),
        (keeps, "unassisted", BUMPERS[1.0], 1.0, 3),
    ):
        own, none = (
            trials.filter(condition=name)[measure].to_numpy() for name in (condition, "none")
        )
        test = scipy.stats.ttest_ind(own, share * none, equal_var=False)
        low, high = test.confidence_interval(1 - 0.05 / settings)
        rows = [row for row in claim.evidence if row.condition == condition]
        expected = IntervalEstimate(
            float(own.mean() - share * none.mean()), float(low), float(high)
        )
        assert any(row.estimate == pytest.approx(expected) for row in rows)


def test_evidence_speaks_only_where_the_whole_interval_does():
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
    rows = [
        Evidence(str(place), "x", IntervalEstimate((low + high) / 2, low, high), 0.0, "above")
        for place, (low, high) in enumerate(ends)
    ]
    assert Claim("", "", every, rows).verdict == verdict


def test_all_evidence_on_a_setting_must_speak_for_it():
    rows = [
        Evidence("a", what, IntervalEstimate(low + 1, low, low + 2), 0.0, "above")
        for what, low in (("x", 1.0), ("y", -1.0))
    ]
    assert Claim("", "", True, rows).settings == {"a": None}


def test_what_was_not_run_is_not_judged():
    nothing = trials_of({}, {})
    assert judged("lunar-lander", nothing, np.random.default_rng(1)) == []
    trials = trials_of(**AS_CLAIMED)
    assert judged("cliff-walking", trials, np.random.default_rng(1)) == []
    two = pl.concat([trials, trials.with_columns(learner=pl.lit("another"))])
    assert judged("lunar-lander", two, np.random.default_rng(1)) == []
    alone = judged("lunar-lander", trials.filter(pl.col("assistant") != "none"),
                   np.random.default_rng(1))  # fmt: skip
    assert [claim.title.rpartition(" of ")[2] for claim in alone] == ["Local Q-Thresholding"]


def test_single_trials_tell_nothing():
    assert {claim.verdict for claim in judge(AS_CLAIMED, trials=1)} == {OPEN}


def test_the_telling_conditions_are_the_best_bumpers_and_the_weakest_thresholding():
    assert telling(trials_of(**AS_CLAIMED)) == ["none", "maximal", BUMPERS[1.0], THRESHOLDS[0.999]]
    assert telling(trials_of({}, {})) == ["none", "maximal"]


def test_a_claim_on_a_single_setting_says_how_few_were_tried():
    destroys, _, covers = judge({**AS_CLAIMED, "thresholds": {0.9: (170.0, -150.0, 0.05)}})
    end = "destroys learning: holds (of 1 setting tried, 1 for it, 0 against it)."
    assert told(destroys).endswith(end)
    assert told(covers).endswith("Local Q-Thresholding: holds.")
