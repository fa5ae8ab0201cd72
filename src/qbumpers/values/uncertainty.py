"""How uncertain V* is if the table of transitions was estimated."""

# SciPy has no types.
# pyright: basic

from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from qbumpers.errors import RequestError
from qbumpers.tasks import TabularTask, Task
from qbumpers.tasks.estimation import Estimate
from qbumpers.values.exact import solve

RESAMPLES = 20
"""Tables that are drawn and solved."""


class StartInterval(NamedTuple):
    """V* of the first state, its mean if there are several, and how uncertain it is.

    Attributes:
        value: by the estimated table.
        error: standard error.
        low: of the interval that holds the true one with a probability of about 95%.
        high: of that interval.
    """

    value: float
    error: float
    low: float
    high: float


def start_interval(task: Task, seed: int = 0) -> StartInterval:
    """Uncertainty of V* at the start of a task whose table was estimated.

    Twenty tables are drawn as the counts allow and solved: probabilities of each pair of a state
    and an action, and of the first state, from Dirichlet distributions with the counts as
    parameters (the Bayesian bootstrap, Rubin 1981). The standard error is the standard deviation of
    their V*; the interval reaches as many of them to either side as Student's distribution says. If
    there are pairs that were never tried, it reaches up to what V* would be besides if they brought
    the best that was seen in every step. Outcomes that were never seen are no part of it.

    Args:
        task: of `TabularTask.estimated`.
        seed: decides the tables; not negative.

    Returns:
        The interval.

    Raises:
        RequestError: if the table was not estimated, or values do not exist.
    """
    from scipy import special

    if task.estimate is None:
        raise RequestError(f"task {task.name}: its table is known, it was not estimated")
    tabular, estimate = cast(TabularTask, task), task.estimate
    generator = np.random.default_rng(seed)
    drawn = [_start_value(_resampled(tabular, estimate, generator)) for _ in range(RESAMPLES)]
    value, error = _start_value(tabular), float(np.std(drawn, ddof=1))
    reach = float(special.stdtrit(RESAMPLES - 1, 0.975)) * error
    hoped = _start_value(_hopeful(tabular, estimate)) if estimate.untried else value
    return StartInterval(value, error, value - reach, hoped + reach)


def _start_value(task: TabularTask) -> float:
    return float(task.start @ solve(task).table.max(axis=1))


def _hopeful(task: TabularTask, estimate: Estimate) -> TabularTask:
    """The task if what was never tried were the best that could be."""
    untried = (estimate.visits == 0) & estimate.met[:, None]
    return replace(task, reward=np.where(untried[:, :, None], estimate.best, task.reward))


def _resampled(
    task: TabularTask, estimate: Estimate, generator: np.random.Generator
) -> TabularTask:
    """The task with other probabilities that the counts allow."""
    counts = np.round(task.probability * estimate.visits[:, :, None])
    drawn = generator.standard_gamma(counts)
    total = drawn.sum(axis=2, keepdims=True)
    kept = np.where(total > 0, drawn / np.where(total > 0, total, 1.0), task.probability)
    start = generator.standard_gamma(estimate.starts.astype(np.float64))
    return replace(task, probability=kept, start=start / start.sum())
