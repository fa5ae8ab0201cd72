"""How many participants the planned test needs, from those of a rehearsal."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtr  # pyright: ignore[reportMissingTypeStubs]

from qbumpers.errors import RequestError
from qbumpers.study.design.models import Analysis, Study
from qbumpers.study.outcomes.reading import Participant

SIZES = (4, 6, 8, 10, 12, 15, 20, 25, 30, 40, 50, 60, 80, 100, 120, 160, 200, 250, 300, 400, 500)
"""Participants per arm that are tried."""

FEWEST = 8
"""Simulated participants per arm below which nothing is said."""

_TESTS, _POOLS = 400, 60


class PowerAt(NamedTuple):
    """The power of the test with so many participants.

    Attributes:
        size: participants per arm.
        power: probability that the test finds a difference, if the rehearsal's is the true one.
        low: lower end of a 95% interval, over whom the rehearsal might have had.
        high: upper end.
        null: the same probability if there is no difference.
    """

    size: int
    power: float
    low: float
    high: float
    null: float


class Power(NamedTuple):
    """What a rehearsal says of the planned test.

    Attributes:
        analysis: the planned test.
        arms: participants of the rehearsal in each arm.
        means: of the measure in each arm.
        effect: standardised difference, Cohen's d, first minus second; infinite if nobody varies.
        table: by size.
        needed: participants per arm for the power that is aimed at; None if no size is enough.
        low: lower end of a 95% interval of it; None likewise.
        high: upper end; None likewise.
    """

    analysis: Analysis
    arms: tuple[int, int]
    means: tuple[float, float]
    effect: float
    table: list[PowerAt]
    needed: int | None
    low: int | None
    high: int | None


def samples_of(study: Study, participants: Sequence[Participant]) -> tuple[np.ndarray, np.ndarray]:
    """The planned measure of each complete participant of each arm, float64 [N] each.

    Raises:
        RequestError: if the study plans no test.
    """
    analysis = study.analysis
    if analysis is None:
        raise RequestError("analysis: the study plans no test; give it a table [analysis]")
    arms = [study.conditions_of(name) for name in analysis.arms]
    found = [
        [
            each.measure(analysis.measure)
            for each in participants
            if each.now.condition in arm and each.now.outcome == "complete"
        ]
        for arm in arms
    ]
    first, second = (np.array(values)[~np.isnan(values)] for values in found)
    return first, second


def power_of(study: Study, participants: Sequence[Participant]) -> Power:
    """The power of the planned test by how many participants there are per arm.

    Arms are drawn with replacement from the rehearsal's participants, and tested. Its uncertainty
    comes from drawing the rehearsal's participants themselves again; without an effect, both arms
    are drawn from everybody.

    Args:
        study: with a planned test.
        participants: of the rehearsal.

    Raises:
        RequestError: if the study plans no test, or too few have completed it.
    """
    first, second = samples_of(study, participants)
    analysis = study.analysis
    assert analysis is not None
    if min(len(first), len(second)) < FEWEST:
        raise RequestError(
            f"power: {len(first)} and {len(second)} complete participants in the arms; at least "
            f"{FEWEST} each are needed: simulate more"
        )
    generator = np.random.default_rng([study.seed, *b"Power"])
    pools = [(_again(first, generator), _again(second, generator)) for _ in range(_POOLS)]
    everybody = np.concatenate([first, second])
    level, rows, curves = analysis.level, list[PowerAt](), list[list[float]]()
    for size in SIZES:
        power = found_share(first, second, size, level, generator)
        others = [found_share(*pool, size, level, generator) for pool in pools]
        low, high = np.quantile(others, [0.025, 0.975]).tolist()
        null = found_share(everybody, everybody, size, level, generator)
        rows.append(PowerAt(size, power, low, high, null))
        curves.append(others)
    needed = _first_enough([row.power for row in rows], analysis.power)
    enough = [_first_enough(curve, analysis.power) for curve in zip(*curves, strict=True)]
    low, high = _interval(enough)
    spread = float(np.sqrt((first.var(ddof=1) + second.var(ddof=1)) / 2))
    difference = float(first.mean() - second.mean())
    effect = difference / spread if spread else float(np.copysign(np.inf, difference))
    means = (float(first.mean()), float(second.mean()))
    return Power(analysis, (len(first), len(second)), means, effect, rows, needed, low, high)


def _again(values: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    return generator.choice(values, len(values))


def found_share(
    first: np.ndarray, second: np.ndarray, size: int, level: float, generator: np.random.Generator
) -> float:
    """How often Welch's test finds a difference between samples of two pools.

    Args:
        first: float64 [N], a pool.
        second: float64 [M], the other.
        size: of each sample, at least 2.
        level: of significance, two-sided.
        generator: draws the samples.
    """
    one, other = (generator.choice(pool, (_TESTS, size)) for pool in (first, second))
    return float(np.mean(welch(one, other) < level))


def welch(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """p-values of Welch's t test, two-sided, of rows.

    Args:
        first: float64 [R, N].
        second: float64 [R, M].

    Returns:
        float64 [R]; 0 or 1 if neither row varies.
    """
    parts = [each.var(axis=1, ddof=1) / each.shape[1] for each in (first, second)]
    total = parts[0] + parts[1]
    difference = first.mean(axis=1) - second.mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = total**2 / sum(
            part**2 / (each.shape[1] - 1) for part, each in zip(parts, (first, second), strict=True)
        )
        found: np.ndarray = 2 * stdtr(freedom, -np.abs(difference) / np.sqrt(total))
    return np.where(total > 0, found, (difference == 0).astype(float))


def _first_enough(powers: Sequence[float], aim: float) -> int | None:
    return next((size for size, power in zip(SIZES, powers, strict=True) if power >= aim), None)


def _interval(sizes: Sequence[int | None]) -> tuple[int | None, int | None]:
    """The middle 95% of sizes; None, more than any, comes last."""
    ordered = sorted(sizes, key=lambda size: SIZES[-1] + 1 if size is None else size)
    cut = int(0.025 * len(ordered))
    return ordered[cut], ordered[-1 - cut]
