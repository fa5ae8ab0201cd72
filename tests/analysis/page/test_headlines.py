"""What came out, in sentences, against tables whose every number is known."""

import math

import polars as pl
import pytest

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings, Sentences
from qbumpers.analysis.page.headlines import headlines
from qbumpers.analysis.statistics import IntervalEstimate
from tests.analysis.examples import summary_table
from tests.analysis.page.made_up import DIFFERENCES, NAN, PERFORMS, SOME, TEACHES, about, regret

MINUS = "\N{MINUS SIGN}"


def sentences_on(learner):
    [(heading, sentences)] = headlines(Findings(summary_table(), pl.DataFrame(), [learner]))
    assert heading == ""
    return sentences


NEARLY_NONE = IntervalEstimate(0.007, -0.002, 0.02)


@pytest.mark.parametrize(
    ("method", "reduction", "sentence"),
    [
        (SOME, IntervalEstimate(0.514, 0.42, 0.615),
         "At matched performance, Stochastic Q Bumpers has 51% less regret in learning than Local "
         "Q-Thresholding (95% interval of the reduction 42% to 62%)."),
        (SOME, IntervalEstimate(-0.08, -0.13, -0.01),
         "At matched performance, Stochastic Q Bumpers has 8% more regret in learning than Local "
         f"Q-Thresholding (95% interval of the reduction {MINUS}13% to {MINUS}1%)."),
        (SOME, IntervalEstimate(-0.05, -0.13, 0.01),
         "At matched performance, it is open whether Stochastic Q Bumpers has less regret in "
         f"learning than Local Q-Thresholding or more: the reduction is {MINUS}5% (95% interval "
         f"{MINUS}13% to 1%)."),
        (SOME, IntervalEstimate(0.5, math.nan, math.nan),
         "At matched performance, Stochastic Q Bumpers has 50% less regret in learning than Local "
         "Q-Thresholding (in many resamples no setting reaches that level, so this has no "
         "interval)."),
        (NAN, NAN,
         "At matched performance, no setting of Stochastic Q Bumpers reaches the level of Local "
         "Q-Thresholding."),
    ],
    ids=["less", "more", "open", "few", "out-of-reach"],
)  # fmt: skip
def test_regret_is_told_with_what_is_known_of_it(method, reduction, sentence):
    found = about(regrets={"performance": regret(method, reduction)})
    assert sentence in sentences_on(found)


def test_a_baseline_that_is_itself_the_best_leaves_no_regret():
    best = about(regrets={"performance": regret(SOME, NAN, IntervalEstimate(0.0, 0.0, 3.0))})
    assert (
        "At matched performance, Local Q-Thresholding is itself the best: it leaves no regret to "
        "reduce."
    ) in sentences_on(best)


def test_no_share_is_told_of_a_regret_that_may_be_nothing():
    tiny = regret(SOME, IntervalEstimate(-22.3, -90.0, -1.0), NEARLY_NONE)
    found = sentences_on(about(regrets={"performance": tiny}))
    [sentence] = [each for each in found if each.startswith("At matched")]
    assert "%" not in sentence.replace("95%", "")
    assert "the regret of Local Q-Thresholding itself, 0.00700 (95% interval" in sentence
    assert "is not surely above zero" in sentence


def test_the_best_are_told_first_then_the_trade_methods_settings_and_differences():
    assert sentences_on(about()) == [
        "Maximal assistance performs best: its learners return 87.0 ± 1.5 per assisted episode. "
        "That is sure: no other condition is as good (with 30 learners per condition, 95% for all "
        "at once).",
        f"No assistance teaches best: its learners return {MINUS}100.0 ± 35.0 per greedy "
        "unassisted episode. It is not sure to be the best: of 9 others, 2 may be as good (with 30 "
        "learners per condition, 95% for all at once): Maximal assistance; Local Q-Thresholding, α "
        "= 0.010.",
        "The trade: from No assistance to Maximal assistance, assisted episodes return 387.0 (95% "
        f"interval 385.0 to 389.0) more and unassisted ones 10.0 (95% interval {MINUS}20.0 to "
        "40.0, perhaps nothing) less. Between the two, 2 more are Pareto-optimal.",
        "Over all its settings, Stochastic Q Bumpers covers 90% of the area of performance and "
        "learning that all conditions cover, the most of all methods (in 98% of the resamples).",
        f"Local Q-Thresholding teaches best at α = 0.010: 50.2 ± 1.5 assisted, {MINUS}120.0 ± 35.0 "
        f"unassisted; and performs best at α = 0.014: 50.6 ± 1.5 assisted, {MINUS}160.0 ± 35.0 "
        "unassisted.",
        f"Stochastic Q Bumpers both teaches and performs best at α = 0.2: 72.0 ± 1.5 assisted, "
        f"{MINUS}170.0 ± 35.0 unassisted.",
        "Against no assistance, of 2 conditions 1 perform significantly better and 0 worse, 0 "
        "teach significantly better and 2 worse (95% for all at once).",
    ]


def test_a_best_that_never_overrode_is_told_to_be_no_assistance():
    idle = TEACHES._replace(condition="local-q-thresholding/alpha=0.010", contenders=[])
    learner = about()
    never = pl.when(condition=idle.condition).then(0.0).otherwise("overrides_mean")
    learner = learner._replace(
        leaders={"assisted": PERFORMS, "unassisted": idle},
        summary=learner.summary.with_columns(overrides_mean=never),
    )
    [sentence] = [each for each in sentences_on(learner) if "teaches best: its" in each]
    assert sentence.startswith("Local Q-Thresholding, α = 0.010, which never overrode, teaches")
    assert "no condition that overrides is as good" in sentence


def test_one_best_leaves_no_trade():
    sure = dict.fromkeys(("assisted", "unassisted"), PERFORMS)
    found = sentences_on(about()._replace(trade=None, leaders=sure))
    assert "One condition both performs and teaches best, so these results show no trade." in found
    open_ = sentences_on(about()._replace(trade=None))
    assert any(
        sentence.endswith("not sure to be the best, so there may be one.") for sentence in open_
    )


def test_a_best_that_may_be_any_is_not_called_the_best():
    every = TEACHES._replace(others=len(TEACHES.contenders or ()))
    found = sentences_on(about()._replace(leaders={"assisted": PERFORMS, "unassisted": every}))
    assert found[1] == (
        "Which condition teaches best cannot be told from 30 learners per condition: each of 2 "
        "others may be as good (95% for all at once) as No assistance, whose learners return the "
        f"most, {MINUS}100.0 ± 35.0 per greedy unassisted episode."
    )


def test_single_trials_are_not_called_significant_or_sure():
    assert not any("resamples" in sentence for sentence in sentences_on(about(trials=1)))
    unknown = DIFFERENCES.with_columns(simultaneous_low=pl.lit(None, pl.Float64))
    open_ = {name: TEACHES._replace(contenders=None) for name in ("assisted", "unassisted")}
    sentences = sentences_on(about()._replace(differences=unknown, leaders=open_))
    assert not any("significantly" in sentence for sentence in sentences)
    assert sentences[0].endswith("Single learners leave it open how sure that is.")


def test_sentences_on_several_learners_stand_under_a_heading_each():
    learners = [about("q-learning/penalty=1"), about("q-learning/penalty=2")]
    found = headlines(Findings(summary_table(), pl.DataFrame(), learners))
    assert [each.heading for each in found] == ["penalty=1", "penalty=2"]
    assert found[0].sentences == found[1].sentences != []


def test_what_is_added_is_told_first():
    added = Findings(summary_table(), pl.DataFrame(), [about()], Additions(headlines=["First."]))
    assert headlines(added)[0] == Sentences("", ["First."])
