"""What is measured: a row per trial, a row per condition, and curves over episodes."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import polars as pl

from qbumpers.analysis.statistics import UNKNOWN, IntervalEstimate, mean_interval

MEASURES = {
    "assisted": "return of the assisted episodes, mean over the training, reward units",
    "unassisted": "return of the greedy unassisted episodes, mean over the training, reward units",
    "assisted_last": "assisted return over the last 10% of the training, reward units",
    "unassisted_last": "unassisted return over the last 10% of the training, reward units",
    "assisted_area": "area under the curve of assisted returns, reward units x episodes",
    "unassisted_area": "area under the curve of unassisted returns, reward units x episodes",
    "overrides": "overrides per episode",
    "override_rate": "overrides per step, over the whole training",
    "override_rate_first": "overrides per step, over the first 10% of the training",
    "override_rate_last": "overrides per step, over the last 10% of the training",
    "dependence": "assisted minus unassisted return, reward units",
    "dependence_last": "assisted minus unassisted return, last 10% of the training, reward units",
    "retention": "unassisted return over further episodes without the assistant, reward units",
    "assisted_success": "share of the assisted episodes that succeed",
    "unassisted_success": "share of the unassisted episodes that succeed",
    "assisted_crash": "share of the assisted episodes that crash",
    "unassisted_crash": "share of the unassisted episodes that crash",
    "criterion_episodes": "training episodes until the criterion; all of them if never reached",
    "criterion_reached": "share of the trials that reach the criterion",
}
"""Measures of a trial, in the order of tables: what each is, and its unit."""

SHARES = (
    "override_rate", "override_rate_first", "override_rate_last", "assisted_success",
    "unassisted_success", "assisted_crash", "unassisted_crash", "criterion_reached",
)  # fmt: skip
"""Those of the measures that lie within [0, 1], and so do their intervals."""

CRITERION_RUN = 5
"""Successive unassisted episodes that must reach the criterion."""

_KEY = ("condition", "trial")
_EVENTS = ("assisted_success", "unassisted_success", "assisted_crash", "unassisted_crash")


def trial_measures(episodes: pl.DataFrame, criterion: float | None = None) -> pl.DataFrame:
    """A row per trial: its measures (macro averages start here).

    Trials may have different numbers of episodes, as those of participants do. The first and last
    10% are rounded down to whole episodes, at least one. Areas are by
    trapezoids. A trial reaches the criterion with the first of five successive unassisted
    episodes that do (of all of them, if a trial has fewer); `criterion_episodes` counts the
    training episodes up to there. A trial that never does counts with all its episodes, so that
    their mean is a restricted one: at most the mean that longer trials would have.

    Args:
        episodes: as in `episodes.parquet`.
        criterion: the unassisted return that counts as having learned.

    Returns:
        Columns condition, assistant, alpha, learner, trial, and one for each of `MEASURES`; null
        if unknown. Conditions in the order of the episodes, trials by number.
    """
    training = episodes.filter(~pl.col("retention"))
    measured = _training_measures(training)
    for found in (_retention(episodes.filter("retention")), _criterion(training, criterion)):
        measured = measured.join(found, on=_KEY, how="left", maintain_order="left")
    return measured.select("condition", "assistant", "alpha", "learner", "trial", *MEASURES)


def _training_measures(training: pl.DataFrame) -> pl.DataFrame:
    """Everything that training episodes say, by trial."""
    order = training["condition"].unique(maintain_order=True)
    found = training.group_by(*_KEY, maintain_order=True).agg(
        pl.col("assistant", "alpha", "learner").first(),
        *(expression for side in ("assisted", "unassisted") for expression in _of(side)),
        pl.col("overrides").mean(),
        *_override_rates(),
        *(pl.col(event).mean() for event in _EVENTS),
    )
    return (
        found.with_columns(
            dependence=pl.col("assisted") - pl.col("unassisted"),
            dependence_last=pl.col("assisted_last") - pl.col("unassisted_last"),
            place=pl.col("condition").replace_strict(order, range(len(order))),
        )
        .sort("place", "trial")
        .drop("place")
    )


_EPISODE = pl.col("episode")
_LENGTH = _EPISODE.max() + 1  # of a trial
_TENTH = (_LENGTH // 10).clip(lower_bound=1)
_LAST = _EPISODE >= _LENGTH - _TENTH


def _of(side: str) -> list[pl.Expr]:
    """Mean, mean over the last tenth and area of the returns of "assisted" or "unassisted"."""
    returns = pl.col(f"{side}_return")
    ends = returns.filter(_EPISODE == 0).sum() + returns.filter(_EPISODE == _LENGTH - 1).sum()
    return [
        returns.mean().alias(side),
        returns.filter(_LAST).mean().alias(f"{side}_last"),
        (returns.sum() - ends / 2).alias(f"{side}_area"),
    ]


def _override_rates() -> Iterator[pl.Expr]:
    spans = {
        "override_rate": pl.lit(True),
        "override_rate_first": _EPISODE < _TENTH,
        "override_rate_last": _LAST,
    }
    for name, span in spans.items():
        overrides, steps = (pl.col(c).filter(span).sum() for c in ("overrides", "assisted_length"))
        yield (overrides / steps).alias(name)


def _retention(retained: pl.DataFrame) -> pl.DataFrame:
    return retained.group_by(*_KEY).agg(pl.col("unassisted_return").mean().alias("retention"))


def _criterion(training: pl.DataFrame, criterion: float | None) -> pl.DataFrame:
    """When each trial reaches the criterion, if there is one."""
    if criterion is None:
        unknown = pl.lit(None, pl.Float64)
        return training.select(*_KEY).unique().with_columns(
            criterion_episodes=unknown, criterion_reached=unknown
        )  # fmt: skip
    run = min(CRITERION_RUN, training["episode"].n_unique())
    reached = pl.col("unassisted_return").sort_by("episode") >= criterion
    complete = reached.cast(pl.Int32).rolling_sum(run) == run
    return training.group_by(*_KEY).agg(
        pl.when(complete.any())
        .then(complete.arg_max() - (run - 2))
        .otherwise(pl.len())
        .cast(pl.Float64)
        .alias("criterion_episodes"),
        complete.any().cast(pl.Float64).alias("criterion_reached"),
    )


def trial_samples(trials: pl.DataFrame, *measures: str) -> dict[str, np.ndarray]:
    """Samples of each condition.

    Args:
        trials: from `trial_measures`.
        *measures: M columns.

    Returns:
        float64 [T, M] by condition, in the order of the experiment, trials by number; NaN if a
        measure is unknown.
    """
    chosen = trials.select("condition", "trial", pl.col(measures).cast(pl.Float64))
    parts = chosen.partition_by("condition", maintain_order=True)
    return {
        part["condition"][0]: part.sort("trial").select(measures).fill_null(np.nan).to_numpy()
        for part in parts
    }


def summary(
    trials: pl.DataFrame,
    options: Mapping[str, Mapping[str, Any]],
    episodes: int,
    retention: int = 0,
) -> pl.DataFrame:
    """A row per condition: means over trials with 95% intervals over trials.

    Args:
        trials: from `trial_measures`.
        options: for each condition, by its id, the options of its assistant by name.
        episodes: of training, per trial.
        retention: further episodes without the assistant, per trial.

    Returns:
        The table of `summary.csv`: what a condition is, how much of it was run, and
        `<measure>_mean`, `_low` and `_high` of every measure that is known.
    """
    known = [name for name in MEASURES if trials[name].null_count() < trials.height]
    counts = {"episodes": episodes, **({"retention_episodes": retention} if retention else {})}
    names = list(dict.fromkeys(name for chosen in options.values() for name in chosen))
    leading = [name for name in ("alpha", "second") if name in names]
    samples = trial_samples(trials, *known)
    rows = []
    for first in trials.unique("condition", keep="first", maintain_order=True).to_dicts():
        chosen = options.get(first["condition"], {})
        row: dict[str, Any] = {name: first[name] for name in ("condition", "assistant", "learner")}
        row |= {name: chosen.get(name) for name in (*leading, *sorted(set(names) - set(leading)))}
        row |= {"trials": len(samples[first["condition"]]), **counts}
        for measure, values in zip(known, samples[first["condition"]].T, strict=True):
            row |= _columns(measure, values[~np.isnan(values)])
        rows.append(row)
    return pl.DataFrame(rows, infer_schema_length=None)


def _columns(measure: str, values: np.ndarray) -> dict[str, float | None]:
    """The three columns of a measure; null if unknown."""
    numbers = np.array(mean_interval(values) if len(values) else UNKNOWN)
    if measure in SHARES:
        numbers = np.clip(numbers, 0, 1)
    return {
        f"{measure}_{part}": None if np.isnan(number) else float(number)
        for part, number in zip(IntervalEstimate._fields, numbers, strict=True)
    }


def learning_curve(
    episodes: pl.DataFrame, condition: str, column: str, starts: np.ndarray | None = None
) -> np.ndarray:
    """Mean and 95% interval over trials of a measure, by episode or by block of episodes.

    Args:
        episodes: as in `episodes.parquet`.
        condition: which one.
        column: for example "unassisted_return".
        starts: int [B], the episodes with which blocks begin, the first of them 0; every episode is
            a block if None.

    Returns:
        float64 [3, B]: mean, low, high; within [0, 1] if the measure is a share.
    """
    found = _course(_block_means(_by_trial(episodes, condition, column), starts))
    return np.clip(found, 0, 1) if column in SHARES else found


def override_curve(
    episodes: pl.DataFrame, condition: str, starts: np.ndarray | None = None
) -> np.ndarray:
    """Mean and 95% interval over trials of the override rate in training.

    Args:
        episodes: as in `episodes.parquet`.
        condition: which one.
        starts: int [B] of training, as for `learning_curve`.

    Returns:
        float64 [3, B]: mean, low, high; overrides per step.
    """
    training = episodes.filter(~pl.col("retention"))
    overrides, steps = (
        _block_sums(_by_trial(training, condition, column), starts)
        for column in ("overrides", "assisted_length")
    )
    with np.errstate(invalid="ignore"):  # of trials without an episode there
        return np.clip(_course(overrides / steps), 0, 1)


def _by_trial(episodes: pl.DataFrame, condition: str, column: str) -> np.ndarray:
    """A column of a condition, float64 [T, E] of the longest trial of all; NaN where one ended."""
    length = int(episodes["episode"].max()) + 1  # type: ignore[arg-type]
    chosen = episodes.filter(pl.col("condition") == condition)
    trials, trial = np.unique(chosen["trial"].to_numpy(), return_inverse=True)
    values = np.full((len(trials), length), np.nan)
    values[trial, chosen["episode"].to_numpy()] = chosen[column].cast(pl.Float64).to_numpy()
    return values


def _block_means(values: np.ndarray, starts: np.ndarray | None) -> np.ndarray:
    """Means over blocks of what is known; NaN if nothing is."""
    known = ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        return _block_sums(values, starts) / _block_sums(known.astype(float), starts)


def _block_sums(values: np.ndarray, starts: np.ndarray | None) -> np.ndarray:
    known = np.where(np.isnan(values), 0.0, values)
    return known if starts is None else np.add.reduceat(known, starts, axis=1)


def _course(values: np.ndarray) -> np.ndarray:
    known = [column[~np.isnan(column)] for column in values.T]
    return np.array([mean_interval(part) if len(part) else UNKNOWN for part in known]).T
