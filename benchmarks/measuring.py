"""How the benchmarks measure: alternating rounds, ratios within a round, one table."""

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

Timed = Callable[[int], float]
"""Does the work once, given the number of the round, and returns what it measured."""


class Target(NamedTuple):
    """What a measurement should reach.

    Attributes:
        limit: in the unit of the measurement.
        at_least: whether it is a floor; otherwise a ceiling.
    """

    limit: float
    at_least: bool = False


class Row(NamedTuple):
    """One line of the table.

    Attributes:
        name: what was measured.
        measured: the median over the rounds.
        unit: of `measured`.
        baseline: what it is compared with, in words; empty if there is nothing.
        ratios: measured to baseline, one per round.
        target: what it should reach, if there is such a number.
    """

    name: str
    measured: float
    unit: str
    baseline: str = ""
    ratios: Sequence[float] = ()
    target: Target | None = None


def alternate(timed: dict[str, Timed], rounds: int) -> dict[str, list[float]]:
    """Measure everything once per round, in turn, so that a busy moment hits all alike.

    Args:
        timed: what to measure, by name.
        rounds: how often.

    Returns:
        What each returned, by name, one number per round.
    """
    measured: dict[str, list[float]] = {name: [] for name in timed}
    for number in range(rounds):
        for name, function in timed.items():
            measured[name].append(function(number))
    return measured


def compared(
    name: str, ours: Sequence[float], unit: str, baseline: str, theirs: Sequence[float],
    target: Target | None = None,
) -> Row:  # fmt: skip
    """A row from the rounds of a measurement and of its baseline.

    Args:
        name: what was measured.
        ours: one number per round.
        unit: of both.
        baseline: what `theirs` is, in words.
        theirs: one number per round.
        target: what `ours` should reach.

    Returns:
        The row: medians, and the ratio of each round.
    """
    ratios = [our / their for our, their in zip(ours, theirs, strict=True)]
    words = f"{baseline}: {number(statistics.median(theirs))} {unit}"
    return Row(name, statistics.median(ours), unit, words, ratios, target)


def seconds_of(work: Callable[[], object]) -> float:
    """Wall-clock seconds of a call."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def number(value: float) -> str:
    """Three significant digits, without an exponent."""
    return f"{value:,.0f}" if value >= 100 else f"{float(f'{value:.3g}'):g}"


def show(title: str, rows: Sequence[Row]) -> None:
    """Print rows as a table.

    Args:
        title: of the table.
        rows: its lines.
    """
    table = Table("name", "measured", "baseline", "ratio (min..max)", "target", title=title)
    for row in rows:
        table.add_row(
            row.name, f"{number(row.measured)} {row.unit}", row.baseline, _ratio(row), _target(row)
        )
    Console(width=132).print(table)


def _ratio(row: Row) -> str:
    if not row.ratios:
        return ""
    low, middle, high = min(row.ratios), statistics.median(row.ratios), max(row.ratios)
    return f"{number(middle)} ({number(low)}..{number(high)})"


def _target(row: Row) -> str:
    if row.target is None:
        return ""
    limit, at_least = row.target
    met = row.measured >= limit if at_least else row.measured < limit
    return f"{'>=' if at_least else '<'} {number(limit)} {row.unit}: {'met' if met else 'missed'}"


def watched(rows: Iterable[Row]) -> Iterator[Row]:
    """Rows, each of which is said as soon as it is measured: the table comes at the end."""
    for row in rows:
        ratio = f", {_ratio(row)} of {row.baseline}" if row.ratios else ""
        print(f"{row.name}: {number(row.measured)} {row.unit}{ratio}", file=sys.stderr, flush=True)
        yield row


def is_quick(description: str | None) -> bool:
    """Read the command line that all benchmarks share: `--quick` or nothing.

    Args:
        description: for `--help`.

    Returns:
        Whether fewer rounds are wanted.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    return parser.parse_args().quick
