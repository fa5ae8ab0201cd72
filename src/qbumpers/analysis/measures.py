"""What is measured: a row a trial, a row a condition, and curves over episodes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import polars as pl

from qbumpers.analysis.statistics import mean_interval

ESTIMATED = (
    "assisted",
    "unassisted",
    "overrides",
    "override_rate",
    "assisted_success",
    "unassisted_success",
    "assisted_crash",
    "unassisted_crash",
)
"""Measures of a trial: each is a mean over its episodes."""


def trial_means(episodes: pl.DataFrame) -> pl.DataFrame:
    """A row a trial: means over its episodes (macro averages start here).

    Args:
        episodes: as in `episodes.parquet`.

    Returns:
        Columns condition, trial, and one for each of `ESTIMATED`; returns are in reward units,
        overrides per episode, `override_rate` per step, the rest are shares of episodes.
    """
    return episodes.group_by("condition", "trial", maintain_order=True).agg(
        pl.col("assisted_return").mean().alias("assisted"),
        pl.col("unassisted_return").mean().alias("unassisted"),
        pl.col("overrides").mean(),
        (pl.col("overrides").sum() / pl.col("assisted_length").sum()).alias("override_rate"),
        *(pl.col(name).mean() for name in ESTIMATED[4:]),
    )


def trial_samples(trials: pl.DataFrame, *measures: str) -> dict[str, np.ndarray]:
    """Samples of each condition.

    Args:
        trials: from `trial_means`.
        *measures: M columns.

    Returns:
        float64 [T, M] by condition, in the order of the experiment.
    """
    parts = trials.partition_by("condition", as_dict=True, maintain_order=True)
    return {str(key[0]): part.select(measures).to_numpy() for key, part in parts.items()}


def summary(
    episodes: pl.DataFrame, trials: pl.DataFrame, options: Mapping[str, Mapping[str, Any]]
) -> pl.DataFrame:
    """A row a condition: means over trials with 95% intervals over trials.

    Args:
        episodes: as in `episodes.parquet`.
        trials: from `trial_means`.
        options: of the assistant of each condition, by its id.

    Returns:
        The table of `summary.csv`.
    """
    assistants = dict(episodes.select("condition", "assistant").unique().iter_rows())
    counts = dict(trials.group_by("condition").len().iter_rows())
    length = episodes["episode"].n_unique()
    names = list(dict.fromkeys(name for chosen in options.values() for name in chosen))
    leading = [name for name in ("alpha", "second") if name in names]
    rows = []
    for condition, samples in trial_samples(trials, *ESTIMATED).items():
        chosen = options.get(condition, {})
        row: dict[str, Any] = {"condition": condition, "assistant": assistants[condition]}
        row |= {name: chosen.get(name) for name in (*leading, *sorted(set(names) - set(leading)))}
        row |= {"trials": counts[condition], "episodes": length}
        for measure, values in zip(ESTIMATED, samples.T.astype(np.float64), strict=True):
            estimate = mean_interval(values)
            for part, number in estimate._asdict().items():
                row[f"{measure}_{part}"] = None if np.isnan(number) else number
        rows.append(row)
    return pl.DataFrame(rows, infer_schema_length=None)


def learning_curve(episodes: pl.DataFrame, condition: str, column: str) -> np.ndarray:
    """Mean and 95% interval of a measure in each episode, over trials.

    Args:
        episodes: as in `episodes.parquet`.
        condition: which one.
        column: for instance "unassisted_return".

    Returns:
        float64 [3, E]: mean, low, high.
    """
    chosen = episodes.filter(pl.col("condition") == condition).sort("trial", "episode")
    length = chosen["episode"].n_unique()
    table = chosen[column].cast(pl.Float64).to_numpy().reshape(-1, length)
    return np.array([mean_interval(values) for values in table.T]).T
