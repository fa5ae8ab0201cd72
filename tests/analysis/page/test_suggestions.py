"""What to try next, against tables whose every number is known."""

import polars as pl

from qbumpers.analysis.findings import Findings
from qbumpers.analysis.page.suggestions import suggestions
from qbumpers.analysis.statistics import IntervalEstimate
from tests.analysis.page.made_up import TEACHES, about

SURE = TEACHES._replace(contenders=[])


def suggested(best=SURE, summary=None, **changes):
    learner = about()._replace(**changes)
    learner = learner._replace(leaders={**learner.leaders, "unassisted": best})
    if summary is not None:
        learner = learner._replace(summary=summary(learner.summary))
    return suggestions(Findings(learner.summary, pl.DataFrame(), [learner]))


def test_so_many_learners_as_would_tell_the_best_from_the_second():
    # 30 learners leave 10 -+ 30. Nine times as many leave -+ 10; twice that is asked for.
    [sentence] = [each for each in suggested(TEACHES) if "learners per condition" in each]
    assert sentence == (
        "To find out whether No assistance teaches better than Maximal assistance, run about 540 "
        "learners per condition."
    )


def test_nobody_is_sent_after_a_difference_that_is_nothing():
    close = TEACHES._replace(ahead=IntervalEstimate(0.001, -30.0, 30.0))
    assert suggested(close)[0].startswith("Do not try to find out whether No assistance teaches")


def test_what_is_sure_needs_no_more_learners():
    assert not any("learners per condition" in each for each in suggested())


def test_the_best_at_the_end_of_a_sweep_asks_for_more_settings():
    found = [each for each in suggested() if each.startswith("Try")]
    assert found == [
        "Try α smaller than 0.01 of Local Q-Thresholding: it teaches best at the end of what was "
        "tried.",
        "Try α smaller than 0.2 of Stochastic Q Bumpers: it teaches best at the end of what was "
        "tried.",
    ]

    def in_the_middle(summary):
        best = pl.col("alpha").is_in([0.012, 0.5])
        return summary.with_columns(
            unassisted_mean=pl.when(best).then(0.0).otherwise("unassisted_mean")
        )

    assert not any(each.startswith("Try") for each in suggested(summary=in_the_middle))


def test_the_limits_of_alpha_are_no_reason_to_go_on():
    def to_the_limit(summary):
        ends = {0.010: 0.0, 0.2: 0.0}
        return summary.with_columns(alpha=pl.col("alpha").replace(ends))

    assert not any(each.startswith("Try") for each in suggested(summary=to_the_limit))


def test_what_an_experiment_lacks_is_named():
    assert not any(each.startswith("Add") for each in suggested())
    for name in ("none", "maximal"):
        found = suggested(
            summary=lambda table, name=name: table.filter(pl.col("assistant") != name)
        )
        assert [each for each in found if each.startswith("Add the assistant " + name)]


def test_tune_is_named_if_there_is_a_trade():
    assert any("qbumpers tune" in each for each in suggested())
    assert not any("qbumpers tune" in each for each in suggested(trade=None))
