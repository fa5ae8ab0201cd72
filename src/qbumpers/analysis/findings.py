"""Every table of a report, from the trials of a run."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import polars as pl

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.comparisons import RETURNS, against, compare_methods, optimal, pooled
from qbumpers.analysis.formatting import decimals_of
from qbumpers.analysis.frontier import Regret, matched_regret
from qbumpers.analysis.leaders import Leader, Trade, leader, trade
from qbumpers.analysis.measures import summary, trial_samples
from qbumpers.experiments.design import Experiment
from qbumpers.experiments.record import RecordedCondition

_ROLES = ("maximal", "local-q-thresholding", "stochastic-q-bumpers")
"""Published assistants; of two, the first is the baseline of the other."""


class LearnerFindings(NamedTuple):
    """What the tables say about one kind of learner; different learners are never mixed.

    Attributes:
        learner: its id, for example "q-learning/perception=observant".
        summary: its rows of `summary.csv`.
        trials: its rows of `trials.parquet`.
        frontier: a row per condition: its mean returns with intervals, whether it is Pareto-optimal
            (`pareto`) and the probability of it.
        methods: a row per method: `methods.csv`.
        advantages: a row per pair of methods: `advantages.csv`.
        control: the condition without assistance; None if there is none to compare with.
        differences: a row per measure and condition, against the control: `differences.csv`; no
            rows without a control.
        compared: the method and the baseline of the regrets; None without two swept ones.
        regrets: by what is matched, "performance" and "learning".
        leaders: the best condition by measure, "assisted" and "unassisted".
        trade: between the two of them; None if they are one.
    """

    learner: str
    summary: pl.DataFrame
    trials: pl.DataFrame
    frontier: pl.DataFrame
    methods: pl.DataFrame
    advantages: pl.DataFrame
    control: str | None
    differences: pl.DataFrame
    compared: tuple[str, str] | None
    regrets: dict[str, Regret]
    leaders: Mapping[str, Leader]
    trade: Trade | None

    @property
    def label(self) -> str:
        """What distinguishes the learner from others, for example "perception=observant"."""
        return self.learner.partition("/")[2]

    @property
    def decimals(self) -> int:
        """Decimals of its mean returns."""
        means = [f"{measure}_mean" for measure in RETURNS]
        return decimals_of(self.summary.select(means).to_numpy().astype(float).ravel().tolist())


class Sentences(NamedTuple):
    """Sentences on one kind of learner, or on a whole run.

    Attributes:
        heading: what distinguishes the learner from others; empty for none.
        sentences: in plain words.
    """

    heading: str
    sentences: Sequence[str]


class Findings(NamedTuple):
    """What the tables of a report say.

    Attributes:
        summary: a row per condition.
        trials: a row per trial.
        learners: what compares conditions, one for each kind of learner.
        additions: what is added to the report of this experiment.
        headlines: what came out; empty until `find` of a report adds it.
        cautions: what to keep in mind, in plain sentences; the same.
        suggestions: what to try next, in plain sentences; the same.
        missing: how many trials each condition lacks, by id, if the run is not finished.
    """

    summary: pl.DataFrame
    trials: pl.DataFrame
    learners: list[LearnerFindings]
    additions: Additions = Additions()
    headlines: Sequence[Sentences] = ()
    cautions: Sequence[str] = ()
    suggestions: Sequence[str] = ()
    missing: Mapping[str, int] = {}

    @property
    def regrets(self) -> dict[str, Regret]:
        """Regrets by what is matched; none if there are several learners, each with its own."""
        return self.learners[0].regrets if len(self.learners) == 1 else {}

    @property
    def methods(self) -> tuple[str, str] | None:
        """The method and the baseline of the regrets."""
        return self.learners[0].compared if self.regrets else None


def find_tables(
    trials: pl.DataFrame, experiment: Experiment, conditions: Sequence[RecordedCondition]
) -> Findings:
    """Every table of a report.

    Args:
        trials: from `trial_measures`.
        experiment: as run.
        conditions: what is noted of each.

    Returns:
        The tables, without additions and sentences.
    """
    options = {each.condition: each.options for each in conditions}
    table = summary(trials, options, experiment.episodes, experiment.retention)
    learners = [
        _about(index, part, trials.filter(learner=part["learner"][0]), experiment)
        for index, part in enumerate(table.partition_by("learner", maintain_order=True))
    ]
    return Findings(table, trials, learners)


def _about(
    index: int, table: pl.DataFrame, trials: pl.DataFrame, experiment: Experiment
) -> LearnerFindings:
    # Pairs need the same trials in every condition: a run that is not finished may lack some.
    paired = experiment.common_random_numbers and _same_trials(trials)

    def generator(use: int) -> np.random.Generator:
        return np.random.default_rng([experiment.seed, index, use])

    best = optimal(trials, generator(0), paired)
    returns = [f"{measure}_{part}" for measure in RETURNS for part in ("mean", "low", "high")]
    points = table.select("condition", "assistant", *returns, "overrides_mean")
    areas, advantages = compare_methods(trials, generator(1), paired)
    for use, measure in enumerate(RETURNS, start=2):
        means = pooled(trials, measure, generator(use), paired).select(
            "assistant",
            pl.selectors.starts_with("macro", "interquartile").name.prefix(f"{measure}_"),
        )
        areas = areas.join(means, on="assistant", how="left", maintain_order="left")
    control = _control(table)
    compared = _compared(table)
    samples = trial_samples(trials, *RETURNS)
    idle = table.filter(overrides_mean=0)["condition"].to_list()
    leaders = {
        measure: leader({name: v[:, place] for name, v in samples.items()}, idle, paired)
        for place, measure in enumerate(RETURNS)
    }
    performing, teaching = (leaders[measure].condition for measure in RETURNS)
    return LearnerFindings(
        learner=str(table["learner"][0]),
        summary=table,
        trials=trials,
        frontier=points.join(
            best.select("condition", "pareto", "probability"), on="condition", maintain_order="left"
        ),
        methods=areas,
        advantages=advantages,
        control=control,
        differences=_differences(trials, control, paired),
        compared=compared,
        regrets=_regrets(table, samples, compared, generator, paired) if compared else {},
        leaders=leaders,
        trade=None if performing == teaching else trade(samples, performing, teaching, paired),
    )


def _same_trials(trials: pl.DataFrame) -> bool:
    first, *others = (part["trial"] for part in trials.partition_by("condition"))
    return all(first.equals(other) for other in others)


def _control(table: pl.DataFrame) -> str | None:
    """The condition without assistance, if there are others."""
    controls = table.filter(assistant="none")["condition"]
    return str(controls[0]) if len(controls) and table.height > 1 else None


def _differences(trials: pl.DataFrame, control: str | None, paired: bool) -> pl.DataFrame:
    if control is None:
        return pl.DataFrame()
    parts = [
        against(trials, control, measure, paired).select(pl.lit(measure).alias("measure"), pl.all())
        for measure in RETURNS
    ]
    return pl.concat(parts, how="vertical_relaxed")


def _compared(table: pl.DataFrame) -> tuple[str, str] | None:
    """The method and the baseline of the regrets: of swept assistants, the two of highest rank.

    What was published ranks below one's own, so that the older of two is the baseline; the order
    of an experiment's file plays no part.
    """
    overriding = table.filter(pl.col("overrides_mean") > 0)
    counts = overriding.group_by("assistant").len()
    swept = sorted(counts.filter(pl.col("len") > 1)["assistant"].to_list(), key=_rank)
    return (swept[-1], swept[-2]) if len(swept) > 1 else None


def _rank(assistant: str) -> tuple[int, str]:
    known = _ROLES.index(assistant) if assistant in _ROLES else len(_ROLES)
    return known, assistant


def _regrets(
    table: pl.DataFrame,
    samples: Mapping[str, np.ndarray],
    compared: tuple[str, str],
    generator: Callable[[int], np.random.Generator],
    paired: bool,
) -> dict[str, Regret]:
    overriding = table.filter(pl.col("overrides_mean") > 0)
    ours, theirs = (overriding.filter(assistant=name)["condition"].to_list() for name in compared)
    return {
        matched: matched_regret(samples, ours, theirs, axis, generator(4 + axis), paired)
        for axis, matched in enumerate(("performance", "learning"))
    }
