"""The numbers that a paper printed, beside the measured ones."""

import tomllib
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from markupsafe import Markup
from scipy.special import ndtri

from qbumpers.analysis.figures.frontier import Marks
from qbumpers.analysis.formatting import NONE, format_number
from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.page.elements import Column, Section, Table, interval
from qbumpers.analysis.statistics import CONFIDENCE, IntervalEstimate
from qbumpers.reproduction.experiments import package_of

AGREEMENT = 0.99
"""Two samples of one size and one truth agree, by the criterion below, this often."""

PUBLISHED = "published.csv"
"""A row per printed number."""


class Comparison(NamedTuple):
    """One printed number beside the measured one.

    Attributes:
        what: which number.
        published: the printed number; the middle if a range is printed.
        printed: the number as the paper prints it, for example "51 to 52".
        measured: with its 95% interval.
        agrees: whether they differ by no more than sampling explains; None if unmeasured.
        note: a remark on the printed number.
    """

    what: str
    published: float
    printed: str
    measured: IntervalEstimate
    agrees: bool | None
    note: str


def agrees(published: float, spread: float, measured: IntervalEstimate) -> bool | None:
    """Whether a printed number and a measured one differ by no more than sampling explains.

    The paper's number is itself a mean over a sample; the difference of two such means has an
    interval wider by the square root of two.

    Args:
        published: the number as the paper prints it.
        spread: how far printing leaves it open.
        measured: with its 95% interval.

    Returns:
        Whether the difference lies within the 99% interval of such differences; None if the
        measured number or its interval is unknown.
    """
    if not np.isfinite(measured.mean):
        return None
    half_width = (measured.high - measured.low) / 2
    if not np.isfinite(half_width):
        return None
    widened = half_width * np.sqrt(2) * ndtri((1 + AGREEMENT) / 2) / ndtri((1 + CONFIDENCE) / 2)
    centre = (measured.high + measured.low) / 2
    return bool(abs(published - centre) <= widened + spread)


def printed_numbers(name: str) -> dict[str, Any]:
    """The numbers that the paper prints for an experiment.

    Args:
        name: one that has a file `printed.toml`, for example "cliff-walking".

    Returns:
        Lists `number` (condition, measure, value, spread) and `regret` (matched, value, spread),
        each with `printed` if the paper prints no single number.
    """
    file = resources.files(package_of(name)) / "printed.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def compare(
    numbers: Mapping[str, Any], summary: pl.DataFrame, regrets: Mapping[str, Regret]
) -> list[Comparison]:
    """Every printed number beside the measured one.

    Args:
        numbers: from `printed_numbers`.
        summary: a row per condition, from `qbumpers.analysis.measures.summary`.
        regrets: by what is matched, "performance" and "learning".

    Returns:
        One comparison per printed number whose condition was run.
    """
    rows = {row["condition"]: row for row in summary.iter_rows(named=True)}
    compared = []
    for number in numbers["number"]:
        row = rows.get(number["condition"])
        if row is None:
            continue
        parts = [row[f"{number['measure']}_{part}"] for part in IntervalEstimate._fields]
        measured = IntervalEstimate(*(float("nan") if part is None else part for part in parts))
        what = f"{number['condition']}, {number['measure']}"
        compared.append(_comparison(what, number, measured))
    for number in numbers["regret"]:
        if number["matched"] in regrets:
            other = {"performance": "learning", "learning": "performance"}[number["matched"]]
            what = f"less regret in {other}, matched {number['matched']}"
            compared.append(_comparison(what, number, regrets[number["matched"]].reduction, 2))
    return compared


def _comparison(
    what: str, number: Mapping[str, Any], measured: IntervalEstimate, digits: int = 1
) -> Comparison:
    value = number["value"]
    printed = number.get("printed", format_number(value, digits))
    verdict = agrees(value, number["spread"], measured)
    return Comparison(what, value, printed, measured, verdict, number.get("note", ""))


def comparisons_frame(comparisons: Sequence[Comparison]) -> pl.DataFrame:
    """The content of `published.csv`: every comparison."""
    return pl.DataFrame([_flat(row) for row in comparisons]).fill_nan(None)


def _flat(row: Comparison) -> dict[str, Any]:
    return {
        "what": row.what,
        "published": row.published,
        "printed": row.printed,
        **{f"measured_{part}": number for part, number in row.measured._asdict().items()},
        "agrees": row.agrees,
        "note": row.note,
    }


def comparisons_section(comparisons: Sequence[Comparison], why: str = "") -> Section:
    """The section of a report that holds every printed number beside the measured one.

    Args:
        comparisons: at least one.
        why: there is no verdict; empty if there is.
    """
    explained = (
        no_verdict(why)
        if why
        else (
            "They agree if they differ by no more than two samples of this size would, 99 times in "
            "100. One trial has no interval, and no verdict."
        )
    )
    introduction = Markup(
        "<p>The numbers that the paper prints for its experiment, beside those of this one. {}</p>"
    ).format(explained)
    content = [introduction, comparisons_table(comparisons)]
    return Section("published", "Against the paper", "methods", content)


def comparisons_table(comparisons: Sequence[Comparison]) -> Table:
    """Printed numbers beside measured ones."""
    columns = [
        Column("number", text=True),
        Column("paper"),
        Column("measured, with 95% interval"),
        Column("agrees", text=True),
        Column("", text=True, secondary=True),
    ]
    verdicts = {
        None: NONE,
        True: Markup('<span class="yes">yes</span>'),
        False: Markup('<span class="no">no</span>'),
    }
    rows = [
        [
            row.what,
            row.printed,
            interval(*row.measured, 2 if "regret" in row.what else 1),
            verdicts[row.agrees],
            row.note,
        ]
        for row in comparisons
    ]
    return Table(columns, rows, PUBLISHED, cards=True)


def no_verdict(why: str) -> str:
    """That printed numbers neither agree nor disagree with the measured ones, and why."""
    return f"No verdict is given on the numbers that the paper prints: {why}."


def disagreements(comparisons: Sequence[Comparison]) -> list[str]:
    """A caution on printed numbers that disagree with the measured ones, if there are any."""
    unlike = [row for row in comparisons if row.agrees is False]
    if not unlike:
        return []
    return [
        f"{len(unlike)} of {len(comparisons)} numbers that the paper prints disagree with the "
        "measured ones."
    ]


def printed_marks(numbers: Mapping[str, Any]) -> Marks:
    """The printed points of performance and learning: conditions with both numbers.

    Args:
        numbers: from `printed_numbers`.
    """
    found: dict[str, dict[str, float]] = {}
    for number in numbers["number"]:
        found.setdefault(number["condition"], {})[number["measure"]] = number["value"]
    return Marks(
        "as printed in the paper",
        {
            condition: (values["assisted"], values["unassisted"])
            for condition, values in found.items()
            if len(values) == 2
        },
    )
