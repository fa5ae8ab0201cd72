"""Tables of a comparison: points, points at matched shares, scores of methods, aggregates."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import polars as pl
import scipy.stats

from qbumpers.analysis.hypervolume import hypervolume
from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import (
    UNKNOWN,
    IntervalEstimate,
    bonferroni,
    mean_interval,
    percentile_interval,
)
from qbumpers.comparison.aggregates import aggregate, improvement, iqm, median
from qbumpers.comparison.levels import (
    case_columns,
    estimate_columns,
    floor_rows,
    share_rows,
)
from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.results import MEASURES, CaseResults, Comparison

RUNS = 5
"""Runs of a case that its trials are dealt to, for scores over cases."""


class Tables(NamedTuple):
    """The tables of a comparison. Columns ending in `_mean`, `_low` and `_high` are 95% intervals.

    Attributes:
        cases: a row per case: task, learner, trials, episodes, best, spread, reference_assisted,
            reference_unassisted, and whether both sides of its box are above chance (comparable).
        methods: a row per method: dial and formula.
        left_out: a row per task and method that it cannot carry: task, method, reason.
        points: a row per setting: case, method, number, condition, and `override_rate`, `assisted`
            and `unassisted`; anchors too, as methods of one setting.
        matched: a row per case, method and share: `assisted` and `unassisted` there, in reward
            units; null if the method does not reach the share. `assisted_lead` and
            `unassisted_lead` are minus those of the bumpers (all of a case and share hold at once).
        floors: a row per comparable case, method and floor of performance, a share of the way from
            no assistance to the best return: level (of the assisted return) and `unassisted` there,
            in reward units; null if the method does not perform as well. `unassisted_lead` is minus
            that of the bumpers (all of a case and floor hold at once).
        scores: a row per case and method: settings, normalised `hypervolume`, `advantage` over the
            bumpers (all of a case hold at once), rank, and `largest`, the share of resamples in
            which it covers most. Only comparable cases, and in these only methods that return no
            more than any policy.
        aggregates: a row per method over its comparable cases: cases, `iqm`, `median`, `rank`,
            `improvement` (the probability that a run exceeds one of the bumpers) and `lead` (its
            interquartile mean minus that of the bumpers in the same cases; all hold at once).
    """

    cases: pl.DataFrame
    methods: pl.DataFrame
    left_out: pl.DataFrame
    points: pl.DataFrame
    matched: pl.DataFrame
    floors: pl.DataFrame
    scores: pl.DataFrame
    aggregates: pl.DataFrame


def find_tables(comparison: Comparison, seed: int = 0) -> Tables:
    """The tables of a comparison.

    Args:
        comparison: from `load_comparison`.
        seed: decides which trials are resampled.
    """
    generator = np.random.default_rng(seed)
    cases, names = comparison.cases, comparison.names
    left_out = {
        (case.task, method): reason for case in cases for method, reason in case.left_out.items()
    }
    scored = [_scores(case, generator) for case in cases if case.comparable]
    rows = [row for found in scored for row in found.rows]
    return Tables(
        cases=pl.DataFrame([_case_row(case) for case in cases]),
        methods=pl.DataFrame(
            [{"method": name, **comparison.methods[name]} for name in names],
            schema={"method": pl.String, "dial": pl.String, "formula": pl.String},
        ),
        left_out=pl.DataFrame(
            [(*key, reason) for key, reason in left_out.items()],
            schema=dict.fromkeys(("task", "method", "reason"), pl.String),
            orient="row",
        ),
        points=_table([row for case in cases for row in _points(case)]),
        matched=_table([row for case in cases for row in share_rows(case, generator)]),
        floors=_table(
            [row for case in cases if case.comparable for row in floor_rows(case, generator)]
        ),
        scores=_table(rows),
        aggregates=_table(_aggregates(names, scored, generator)),
    )


def _table(rows: list[dict[str, Any]]) -> pl.DataFrame:
    return pl.DataFrame(rows, infer_schema_length=None).fill_nan(None) if rows else pl.DataFrame()


def _case_row(case: CaseResults) -> dict[str, Any]:
    assisted, unassisted = case.reference
    return {
        **case_columns(case),
        "trials": case.experiment.trials,
        "episodes": case.experiment.episodes,
        "best": case.best,
        "spread": case.spread,
        "reference_assisted": float(assisted),
        "reference_unassisted": float(unassisted),
        "comparable": case.comparable,
    }


def _points(case: CaseResults) -> list[dict[str, Any]]:
    anchors = {name: samples[np.newaxis] for name, samples in case.anchors.items()}
    return [
        {
            **case_columns(case),
            "method": name,
            "number": number,
            "condition": ids[number],
            **{
                column: value
                for place, measure in enumerate(MEASURES)
                for column, value in estimate_columns(
                    measure, mean_interval(trials[:, place])
                ).items()
            },
        }
        for methods, conditions in (
            (anchors, {name: [name] for name in anchors}),
            (case.methods, case.conditions),
        )
        for name, samples in methods.items()
        for ids in [conditions[name]]
        for number, trials in enumerate(samples)
    ]


def covered(points: np.ndarray, reference: np.ndarray, best: float) -> np.ndarray:
    """The share of its box that a method's settings cover.

    Args:
        points: assisted and unassisted means of its settings, float64 [..., K, 2].
        reference: the lower left corner of the box, float64 [2].
        best: both coordinates of the upper right corner; points beyond it count as on its edge.

    Returns:
        Normalised hypervolumes, float64 [...], in [0, 1].
    """
    return hypervolume(np.minimum(points, best), reference) / np.prod(best - reference)


class _CaseScores(NamedTuple):
    """Scores of a case: rows, and by method scores of runs [R] and ranks in resamples [B]."""

    rows: list[dict[str, Any]]
    runs: Mapping[str, np.ndarray]
    ranks: Mapping[str, np.ndarray]


def _scores(case: CaseResults, generator: np.random.Generator) -> _CaseScores:
    """Scores of every method in a case."""
    reference, best = case.reference, case.best
    returns = {n: s[..., 1:] for n, s in case.methods.items() if not case.beyond(n)}
    names, means = list(returns), {name: each.mean(axis=1) for name, each in returns.items()}
    resampled = {name: resampled_means([*each], generator) for name, each in returns.items()}
    areas = {name: covered(resampled[name], reference, best) for name in names}
    unknown = any(np.isnan(points).any() for points in resampled.values())
    replicates = np.stack([areas[name] for name in names], axis=-1)
    ranks = scipy.stats.rankdata(-replicates, axis=-1)
    largest = (replicates == replicates.max(axis=-1, keepdims=True)).mean(axis=0)
    own = {name: float(covered(means[name], reference, best)) for name in names}
    order = scipy.stats.rankdata([-own[name] for name in names])
    rows = [
        {
            **case_columns(case),
            "method": name,
            "settings": len(means[name]),
            **estimate_columns("hypervolume", _own(case, means[name], resampled[name])),
            **estimate_columns("advantage", _advantage(case, name, means, resampled)),
            "rank": float(order[place]),
            "largest": float("nan") if unknown else float(largest[place]),
        }
        for place, name in enumerate(names)
    ]
    runs = {name: _run_scores(each, case) for name, each in returns.items()}
    return _CaseScores(rows, runs, dict(zip(names, ranks.T, strict=True)))


def _own(case: CaseResults, means: np.ndarray, resampled: np.ndarray) -> IntervalEstimate:
    """What a method covers, with an interval; it covers no less than nothing."""
    found = function_interval(
        lambda points: covered(points, case.reference, case.best), means, resampled
    )
    return found._replace(low=max(found.low, 0.0))  # NaN stays


def _advantage(
    case: CaseResults,
    name: str,
    means: Mapping[str, np.ndarray],
    resampled: Mapping[str, np.ndarray],
) -> IntervalEstimate:
    """By how much more than the bumpers a method covers; all of a case hold at once."""
    if name == BASELINE or BASELINE not in means:
        return UNKNOWN
    number = len(means[name])

    def lead(points: np.ndarray) -> np.ndarray:
        first, second = points[..., :number, :], points[..., number:, :]
        return covered(first, case.reference, case.best) - covered(
            second, case.reference, case.best
        )

    return function_interval(
        lead,
        np.concatenate([means[name], means[BASELINE]]),
        np.concatenate([resampled[name], resampled[BASELINE]], axis=1),
        bonferroni(len(means) - 1),
    )


def _run_scores(returns: np.ndarray, case: CaseResults) -> np.ndarray:
    """Scores [R] of runs of a method, which its trials, float64 [K, T, 2], are dealt to."""
    trials = returns.shape[1]
    runs = min(RUNS, trials)
    dealt = returns[:, : trials // runs * runs].reshape(len(returns), runs, -1, 2)
    return covered(dealt.mean(axis=2).swapaxes(0, 1), case.reference, case.best)


def _aggregates(
    names: list[str],
    scored: list[_CaseScores],
    generator: np.random.Generator,
) -> list[dict[str, Any]]:
    rows = []
    for name in names:
        having = [each for each in scored if name in each.runs]
        if not having:
            continue
        own = np.stack([each.runs[name] for each in having], axis=1)
        row: dict[str, Any] = {
            "method": name,
            "cases": len(having),
            **estimate_columns("iqm", aggregate(iqm, (own,), generator)),
            **estimate_columns("median", aggregate(median, (own,), generator)),
            **estimate_columns("rank", _mean_rank(name, having)),
        }
        improved = lead = UNKNOWN
        if name != BASELINE and all(BASELINE in each.runs for each in having):
            bumpers = np.stack([each.runs[BASELINE] for each in having], axis=1)
            improved = aggregate(improvement, (own, bumpers), generator)
            lead = aggregate(
                lambda first, second: iqm(first) - iqm(second),
                (own, bumpers),
                generator,
                bonferroni(max(1, len(names) - 1)),
            )
        rows.append(
            {**row, **estimate_columns("improvement", improved), **estimate_columns("lead", lead)}
        )
    return rows


def _mean_rank(name: str, having: list[_CaseScores]) -> IntervalEstimate:
    """The mean over cases of a method's rank, with a percentile interval over resamples."""
    ranks = np.mean([each.ranks[name] for each in having], axis=0)
    found = np.mean([row["rank"] for each in having for row in each.rows if row["method"] == name])
    return percentile_interval(float(found), ranks)
