"""What came out, in sentences, against tables whose every number is known."""

import math

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings, LearnerFindings
from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.page.headlines import cautions, headlines
from qbumpers.analysis.statistics import IntervalEstimate
from qbumpers.experiments.sources import make_experiment
from tests.analysis.examples import ALPHAS, summary_table
from tests.experiments.examples import settings

NAN = IntervalEstimate(math.nan, math.nan, math.nan)
SOME = IntervalEstimate(-300.0, -320.0, -280.0)
METHODS = pl.DataFrame(
    {
        "assistant": ["none", "stochastic-q-bumpers"],
        "hypervolume_mean": [0.0, 900.0],
        "share": [0.0, 0.9],
        "largest": [0.02, 0.98],
    }
)
DIFFERENCES = pl.DataFrame(
    [
        ("assisted", 1.0, 2.0),
        ("assisted", -1.0, 2.0),
        ("unassisted", -3.0, -2.0),
        ("unassisted", -3.0, -1.0),
    ],
    schema=["measure", "simultaneous_low", "simultaneous_high"],
    orient="row",
)


def regret(method, reduction, axis=0):
    return Regret(axis, "x", "y", 50.0, -500.0, method, -20.0, reduction)


def about(learner="q-learning", regrets=(), trials=30):
    table = summary_table().with_columns(trials=pl.lit(trials))
    return LearnerFindings(
        learner=learner,
        summary=table,
        trials=pl.DataFrame(),
        frontier=pl.DataFrame(),
        methods=METHODS,
        advantages=pl.DataFrame(),
        control="none",
        differences=DIFFERENCES,
        compared=("stochastic-q-bumpers", "local-q-thresholding"),
        regrets=dict(regrets),
    )


def sentences_on(*learners):
    return headlines(Findings(summary_table(), pl.DataFrame(), list(learners)))


@pytest.mark.parametrize(
    ("method", "reduction", "sentence"),
    [
        (SOME, IntervalEstimate(0.514, 0.42, 0.615),
         "At matched performance, Stochastic Q Bumpers has 51% less regret in learning than Local "
         "Q-Thresholding (95% interval of the reduction 42% to 62%)."),
        (SOME, IntervalEstimate(-0.05, -0.13, 0.01),
         "At matched performance, Stochastic Q Bumpers has 5% more regret in learning than Local "
         "Q-Thresholding (95% interval of the reduction \N{MINUS SIGN}13% to 1%)."),
        (SOME, IntervalEstimate(0.5, math.nan, math.nan),
         "At matched performance, Stochastic Q Bumpers has 50% less regret in learning than Local "
         "Q-Thresholding (its interval is not known)."),
        (NAN, NAN,
         "At matched performance, no setting of Stochastic Q Bumpers reaches the level of Local "
         "Q-Thresholding."),
        (SOME, NAN,
         "At matched performance, Local Q-Thresholding is itself the best: it leaves no regret to "
         "reduce."),
    ],
    ids=["less", "more", "few", "out-of-reach", "best"],
)  # fmt: skip
def test_regret_is_told_first(method, reduction, sentence):
    assert sentences_on(about(regrets={"performance": regret(method, reduction)}))[0] == sentence


def test_settings_methods_and_differences_are_told():
    minus = "\N{MINUS SIGN}"
    assert sentences_on(about()) == [
        "Stochastic Q Bumpers covers 90% of the performance and learning that all conditions cover "
        "together, the most of all methods (in 98% of the resamples).",
        f"No assistance returns {minus}300.0 ± 1.5 in training and {minus}100.0 ± 35.0 in greedy "
        "episodes.",
        f"Maximal assistance returns 87.0 ± 1.5 assisted, {minus}110.0 ± 35.0 unassisted.",
        f"Local Q-Thresholding teaches best at α = 0.010: 50.2 ± 1.5 assisted, {minus}120.0 ± 35.0 "
        f"unassisted; and performs best at α = 0.014: 50.6 ± 1.5 assisted, {minus}160.0 ± 35.0 "
        "unassisted.",
        f"Stochastic Q Bumpers both teaches and performs best at α = 0.2: 72.0 ± 1.5 assisted, "
        f"{minus}170.0 ± 35.0 unassisted.",
        "Against no assistance, of 2 conditions 1 perform significantly better and 0 worse, 0 "
        "teach significantly better and 2 worse (95% for all at once).",
    ]


def test_single_trials_are_not_called_significant():
    assert not any("resamples" in sentence for sentence in sentences_on(about(trials=1)))
    unknown = DIFFERENCES.with_columns(simultaneous_low=pl.lit(None, pl.Float64))
    sentences = sentences_on(about()._replace(differences=unknown))
    assert not any("significantly" in sentence for sentence in sentences)


def test_sentences_on_one_of_several_learners_say_which():
    found = sentences_on(about("q-learning/penalty=1"), about("q-learning/penalty=2"))
    half = len(found) // 2
    assert all(sentence.startswith("With penalty=1: ") for sentence in found[:half])
    assert all(sentence.startswith("With penalty=2: ") for sentence in found[half:])


def found_of(trials: int | list[int] = 20, **parts):
    """Findings of conditions that have so many trials each."""
    return Findings(
        summary_table().with_columns(trials=pl.Series(np.broadcast_to(trials, len(ALPHAS)))),
        pl.DataFrame(),
        **{"learners": [about()], **parts},
    )


def warned(learner=None, trials: int | list[int] = 20, **changes):
    findings = found_of(trials, learners=[learner or about()])
    return cautions(findings, make_experiment(settings(**{"trials": 20, **changes})))


def test_small_experiments_are_cautioned_about():
    assert "one trial" in warned(trials=1)[0]
    assert "only 19 trials" in warned(trials=19)[0]
    assert "only 19 trials" in warned(trials=[19, *[20] * 9])[0]
    assert "Conditions of a single trial have no interval" in warned(trials=[1, *[20] * 9])[0]
    assert "one episode" in warned(episodes=1)[0]
    assert not any("trials per condition" in sentence for sentence in warned())


def test_a_run_that_is_not_finished_says_what_is_missing():
    missing = {"none": 3, "absent": 20}
    [first, *_] = cautions(found_of(missing=missing), make_experiment(settings(trials=20)))
    assert first == (
        "The run is not finished: 197 of 220 trials are there, and 2 of 11 conditions lack some: "
        "none (17 of 20), absent (0 of 20). Run it again to continue."
    )
    many = {f"absent/{number}": 20 for number in range(8)}
    [first, *_] = cautions(found_of(missing=many), make_experiment(settings(trials=20)))
    assert "absent/5 (0 of 20) and 2 more. Run it" in first


def test_what_is_added_is_told_too():
    added = Additions(headlines=["First."], cautions=["Beware."])
    findings = found_of(additions=added)
    assert headlines(findings)[0] == "First."
    assert "Beware." in cautions(findings, make_experiment(settings(trials=20)))


def test_settings_as_good_as_the_best_are_counted():
    # Means 10 apart, intervals from -30 to +40: those at most 70 below the best overlap with it.
    [sentence] = warned()
    assert "5 of 5 settings of Local Q-Thresholding" in sentence
    assert "3 of 3 settings of Stochastic Q Bumpers" in sentence
    ends = pl.col("unassisted_mean")
    sharp = about().summary.with_columns(unassisted_low=ends - 1, unassisted_high=ends + 1)
    assert warned(learner=about()._replace(summary=sharp)) == []
