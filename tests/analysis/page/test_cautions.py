"""What to keep in mind, in sentences, against tables whose every number is known."""

import numpy as np
import polars as pl

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings
from qbumpers.analysis.page.cautions import cautions
from qbumpers.experiments.sources import make_experiment
from tests.analysis.examples import ALPHAS, summary_table
from tests.analysis.page.made_up import about
from tests.experiments.examples import settings


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


def test_few_trials_are_named_with_what_they_mean():
    # Student's t of 4 degrees of freedom at 97.5% is 2.776, the normal's 1.960; half of the
    # intervals is 35, and that of a difference of two such means larger by the square root of 2.
    [sentence, *_] = warned(trials=5)
    assert "only 5 trials" in sentence
    assert "reaches 2.8 standard errors to each side, in place of 2.0" in sentence
    assert "below about 49 per episode cannot be seen" in sentence


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


def test_cautions_are_added():
    findings = found_of(additions=Additions(cautions=["Beware."]))
    assert "Beware." in cautions(findings, make_experiment(settings(trials=20)))


def test_settings_as_good_as_the_best_are_counted():
    # Means 10 apart, intervals from -30 to +40: those at most 70 below the best overlap with it.
    [sentence] = warned()
    assert "5 of 5 settings of Local Q-Thresholding" in sentence
    assert "3 of 3 settings of Stochastic Q Bumpers" in sentence
    ends = pl.col("unassisted_mean")
    sharp = about().summary.with_columns(unassisted_low=ends - 1, unassisted_high=ends + 1)
    assert warned(learner=about()._replace(summary=sharp)) == []
