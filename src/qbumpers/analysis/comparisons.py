"""Tables that compare the conditions and the methods of one learner.

Each function takes trials of one learner: conditions of different learners are never mixed. A
method is an assistant with all its settings.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from qbumpers.analysis.frontier import is_optimal, optimal_probability
from qbumpers.analysis.hypervolume import Hypervolumes, compare_hypervolumes, hypervolume
from qbumpers.analysis.measures import MEASURES, trial_samples
from qbumpers.analysis.resampling import interquartile_interval, resampled_means
from qbumpers.analysis.statistics import (
    IntervalEstimate,
    bonferroni,
    difference,
    holm,
    percentile_interval,
    probability_of_improvement,
)
from qbumpers.errors import RequestError, unknown_name

RETURNS = ("assisted", "unassisted")
"""The two measures that a frontier is made of."""


def against(trials: pl.DataFrame, control: str, measure: str, paired: bool = False) -> pl.DataFrame:
    """Every condition against one of them, with control over their number.

    Args:
        trials: of one learner, from `trial_measures`.
        control: id of the condition that the others are compared with.
        measure: one of `MEASURES`.
        paired: whether trials of equal number belong together (common random numbers).

    Returns:
        A row per condition but the control: condition, assistant, alpha; `difference_mean`, `_low`,
        `_high` (condition minus control) and `simultaneous_low`, `_high`, which hold for all rows
        at once (Bonferroni); `p_value` of the t test and `p_adjusted` (Holm); and
        `improvement_mean`, `_low`, `_high`, the probability that a trial exceeds one of the control
        (its own partner, if paired). Null if unknown.

    Raises:
        RequestError: if control, measure or pairs cannot be had from these trials.
    """
    samples = _samples(trials, (measure,), paired)
    if control not in samples:
        raise unknown_name("condition", control, samples)
    reference = samples[control][:, 0]
    others = {name: values[:, 0] for name, values in samples.items() if name != control}
    if not others:
        raise RequestError(f"control = {control!r}: there is no other condition to compare with it")
    confidence = bonferroni(len(others))
    found = [difference(values, reference, paired) for values in others.values()]
    together = [difference(v, reference, paired, confidence).estimate for v in others.values()]
    p_values = np.array([one.p_value for one in found])
    columns = {
        **_columns("difference", (one.estimate for one in found)),
        "simultaneous_low": [estimate.low for estimate in together],
        "simultaneous_high": [estimate.high for estimate in together],
        "p_value": p_values,
        "p_adjusted": holm(p_values),
        **_columns(
            "improvement",
            (probability_of_improvement(v, reference, paired) for v in others.values()),
        ),
    }
    return _with_numbers(_identities(trials).filter(pl.col("condition") != control), columns)


def optimal(
    trials: pl.DataFrame, generator: np.random.Generator, paired: bool = False
) -> pl.DataFrame:
    """Which conditions are Pareto-optimal in both returns, and how certain that is.

    Args:
        trials: of one learner, from `trial_measures`.
        generator: draws resamples of the trials.
        paired: whether trials of equal number belong together (common random numbers).

    Returns:
        A row per condition: condition, assistant, alpha, assisted, unassisted (means), `pareto`,
        and `probability`, the share of the resamples in which it is Pareto-optimal.

    Raises:
        RequestError: if the trials are not of one learner, or pairs are incomplete.
    """
    samples = _samples(trials, RETURNS, paired)
    means = np.array([values.mean(axis=0) for values in samples.values()])
    columns = {
        **dict(zip(RETURNS, means.T, strict=True)),
        "pareto": is_optimal(means),
        "probability": list(optimal_probability(samples, generator, paired).values()),
    }
    return _with_numbers(_identities(trials), columns)


def pooled(
    trials: pl.DataFrame, measure: str, generator: np.random.Generator, paired: bool = False
) -> pl.DataFrame:
    """Every method over all its settings together.

    Args:
        trials: of one learner, from `trial_measures`.
        measure: one of `MEASURES`.
        generator: draws resamples, of the trials within each condition.
        paired: whether trials of equal number belong together (common random numbers).

    Returns:
        A row per method: assistant, conditions, trials (of all of them); `macro_mean`, `_low`,
        `_high`, the mean of the conditions' means; `interquartile_mean`, `_low`, `_high`, the mean
        of the middle half of all trials. Percentile intervals of the stratified bootstrap.

    Raises:
        RequestError: if measure or pairs cannot be had from these trials.
    """
    samples = _samples(trials, (measure,), paired)
    strata = {m: [samples[n][:, 0] for n in names] for m, names in _methods(trials).items()}
    columns = {
        "conditions": [len(values) for values in strata.values()],
        "trials": [sum(map(len, values)) for values in strata.values()],
        **_columns("macro", (_macro(v, generator, paired) for v in strata.values())),
        **_columns(
            "interquartile",
            (interquartile_interval(v, generator, paired) for v in strata.values()),
        ),
    }
    return _with_numbers(pl.DataFrame({"assistant": list(strata)}), columns)


class MethodTables(NamedTuple):
    """Whole methods compared by what their settings cover.

    Attributes:
        methods: a row per method: assistant, conditions; `hypervolume_mean`, `_low`, `_high`, in
            squared reward units; `share` of what all conditions cover together; `largest`, the
            share of the resamples in which it covers most; `reference_assisted`,
            `reference_unassisted`.
        advantages: a row per pair: assistant, other; `advantage_mean`, `_low`, `_high`, by how much
            the first one's hypervolume is larger, in squared reward units; `probability`, the share
            of the resamples in which it is.
    """

    methods: pl.DataFrame
    advantages: pl.DataFrame


def compare_methods(
    trials: pl.DataFrame,
    generator: np.random.Generator,
    paired: bool = False,
    reference: np.ndarray | None = None,
) -> MethodTables:
    """Every method, and every two methods, by what their settings cover.

    Args:
        trials: of one learner, from `trial_measures`.
        generator: draws resamples of the trials, the same for both tables.
        paired: whether trials of equal number belong together (common random numbers).
        reference: float64 [2], assisted and unassisted return above which hypervolumes are
            measured; the worst of each over all conditions if None.

    Raises:
        RequestError: if the trials are not of one learner, or pairs are incomplete.
    """
    samples = _samples(trials, RETURNS, paired)
    settings = _methods(trials)
    found = compare_hypervolumes(samples, settings, generator, reference, paired)
    means = np.array([values.mean(axis=0) for values in samples.values()])
    whole = float(hypervolume(means, found.reference))
    return MethodTables(_methods_table(found, settings, whole), _advantages_table(found))


def _methods_table(
    found: Hypervolumes, settings: Mapping[str, Sequence[str]], whole: float
) -> pl.DataFrame:
    columns = {
        "conditions": [len(names) for names in settings.values()],
        **_columns("hypervolume", found.methods.values()),
        "share": [e.mean / whole if whole > 0 else np.nan for e in found.methods.values()],
        "largest": list(found.largest.values()),
        "reference_assisted": [found.reference[0]] * len(settings),
        "reference_unassisted": [found.reference[1]] * len(settings),
    }
    return _with_numbers(pl.DataFrame({"assistant": list(settings)}), columns)


def _advantages_table(found: Hypervolumes) -> pl.DataFrame:
    pairs = list(found.advantages)
    names = {"assistant": [first for first, _ in pairs], "other": [second for _, second in pairs]}
    columns = {
        **_columns("advantage", (one.estimate for one in found.advantages.values())),
        "probability": [one.probability for one in found.advantages.values()],
    }
    return _with_numbers(pl.DataFrame(names, schema=dict.fromkeys(names, pl.String)), columns)


def _samples(
    trials: pl.DataFrame, measures: tuple[str, ...], paired: bool
) -> dict[str, np.ndarray]:
    """Samples [T, M] of each condition, if these trials have them."""
    learners = trials["learner"].unique(maintain_order=True).to_list()
    if len(learners) != 1:
        raise RequestError(
            f"trials of {len(learners)} learners ({', '.join(map(str, learners))}); a comparison "
            "takes those of one: filter the trials by learner first"
        )
    known = [name for name in MEASURES if trials[name].null_count() == 0]
    for measure in measures:
        if measure not in known:
            raise unknown_name("measure", measure, known)
    if paired:
        _check_pairs(trials)
    return trial_samples(trials, *measures)


def _check_pairs(trials: pl.DataFrame) -> None:
    """Pairs need the same trials in every condition."""
    numbers = {
        str(key[0]): set(part["trial"])
        for key, part in trials.partition_by("condition", as_dict=True, maintain_order=True).items()
    }
    first = next(iter(numbers))
    for name, found in numbers.items():
        if found != numbers[first]:
            raise RequestError(
                f"paired = True: {first} and {name} do not have the same trials "
                f"({len(numbers[first])} and {len(found)}); pairs need them"
            )


def _identities(trials: pl.DataFrame) -> pl.DataFrame:
    columns = ("condition", "assistant", "alpha")
    return trials.select(columns).unique(subset="condition", keep="first", maintain_order=True)


def _methods(trials: pl.DataFrame) -> dict[str, list[str]]:
    """Conditions of each assistant, in the order of the experiment."""
    settings: dict[str, list[str]] = {}
    for condition, assistant in _identities(trials).select("condition", "assistant").iter_rows():
        settings.setdefault(assistant, []).append(condition)
    return settings


def _macro(
    strata: Sequence[np.ndarray], generator: np.random.Generator, paired: bool
) -> IntervalEstimate:
    """Mean of the conditions' means; no interval for a single trial."""
    mean = float(np.mean([values.mean() for values in strata]))
    if min(map(len, strata)) < 2:
        return IntervalEstimate(mean, float("nan"), float("nan"))
    samples = [values[:, np.newaxis] for values in strata]
    replicates = resampled_means(samples, generator, paired).mean(axis=(1, 2))
    return percentile_interval(mean, replicates)


def _columns(name: str, estimates: Iterable[IntervalEstimate]) -> dict[str, list[float]]:
    found = list(estimates)
    return {
        f"{name}_{part}": [getattr(e, part) for e in found] for part in IntervalEstimate._fields
    }


def _with_numbers(table: pl.DataFrame, columns: Mapping[str, Any]) -> pl.DataFrame:
    """A table with further columns, in which what is not a number is null."""
    numbers = pl.DataFrame({name: list(values) for name, values in columns.items()})
    return table.hstack(numbers.fill_nan(None))
