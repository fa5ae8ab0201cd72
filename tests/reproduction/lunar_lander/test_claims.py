"""Claims in words, judged from trials whose truth is known."""

from typing import Any

import numpy as np
import polars as pl
import pytest
import scipy.stats

from qbumpers.analysis.measures import MEASURES
from qbumpers.analysis.statistics import IntervalEstimate
from qbumpers.reproduction.claims import (
    FAILS,
    HOLDS,
    OPEN,
    claim_sentence,
)
from qbumpers.reproduction.lunar_lander.claims import decisive_conditions, judge_claims

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


AS_CLAIMED: dict[str, Any] = {
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
    return judge_claims(trials_of(**world, **changes), np.random.default_rng(1))


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
    destroys, keeps, _ = judge_claims(trials, np.random.default_rng(1))
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


def test_what_was_not_run_is_not_judged():
    nothing = trials_of({}, {})
    assert judge_claims(nothing, np.random.default_rng(1)) == []
    trials = trials_of(**AS_CLAIMED)
    two = pl.concat([trials, trials.with_columns(learner=pl.lit("another"))])
    assert judge_claims(two, np.random.default_rng(1)) == []
    alone = judge_claims(trials.filter(pl.col("assistant") != "none"),
                         np.random.default_rng(1))  # fmt: skip
    assert [claim.title.rpartition(" of ")[2] for claim in alone] == ["Local Q-Thresholding"]


def test_single_trials_tell_nothing():
    assert {claim.verdict for claim in judge(AS_CLAIMED, trials=1)} == {OPEN}


def test_the_decisive_conditions_are_the_best_bumpers_and_the_weakest_thresholding():
    assert decisive_conditions(trials_of(**AS_CLAIMED)) == [
        "none",
        "maximal",
        BUMPERS[1.0],
        THRESHOLDS[0.999],
    ]
    assert decisive_conditions(trials_of({}, {})) == ["none", "maximal"]


def test_a_claim_on_a_single_setting_says_how_few_were_tried():
    destroys, _, covers = judge({**AS_CLAIMED, "thresholds": {0.9: (170.0, -150.0, 0.05)}})
    end = "destroys learning: holds (of 1 setting tried, 1 for it, 0 against it)."
    assert claim_sentence(destroys).endswith(end)
    assert claim_sentence(covers).endswith("Local Q-Thresholding: holds.")
