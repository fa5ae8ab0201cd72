"""The numbers that a paper printed, beside the measured ones."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from scipy.special import ndtri

from qbumpers.analysis.frontier import Regret
from qbumpers.analysis.numerals import written
from qbumpers.analysis.statistics import CONFIDENCE, Estimate

AGREEMENT = 0.99
"""Two samples of one size and one truth agree, by the criterion below, this often."""


class Comparison(NamedTuple):
    """One printed number beside the measured one.

    Attributes:
        what: which number.
        published: the printed number; the middle where a range is printed.
        printed: the number as the paper prints it, for instance "51 to 52".
        measured: with its 95% interval.
        agrees: whether they differ by no more than sampling explains; None where unmeasured.
        note: on the printed number.
    """

    what: str
    published: float
    printed: str
    measured: Estimate
    agrees: bool | None
    note: str


def agrees(published: float, spread: float, measured: Estimate) -> bool | None:
    """Whether a printed number and a measured one differ by no more than sampling explains.

    The paper's number is itself a mean over a sample; the difference of two such means has an
    interval wider by the square root of two.

    Args:
        published: the printed number.
        spread: how far printing leaves it open.
        measured: with its 95% interval.

    Returns:
        Whether the difference lies within the 99% interval of such differences; None where the
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


def published_numbers(name: str) -> dict[str, Any]:
    """The printed numbers of a published experiment, empty where there are none.

    Args:
        name: for instance "cliff-walking".

    Returns:
        Lists `number` (condition, measure, value, spread) and `regret` (matched, value, spread);
        `printed` where the paper prints no single number.
    """
    file = resources.files("qbumpers.analysis") / "published" / f"{name}.toml"
    if not file.is_file():
        return {"number": [], "regret": []}
    return tomllib.loads(file.read_text(encoding="utf-8"))


def compare(
    numbers: Mapping[str, Any], summary: pl.DataFrame, regrets: Mapping[str, Regret]
) -> list[Comparison]:
    """Every printed number beside the measured one.

    Args:
        numbers: from `published_numbers`.
        summary: the table of `summary.csv`.
        regrets: by what is matched, "performance" and "learning".

    Returns:
        One comparison a printed number whose condition was run.
    """
    rows = {row["condition"]: row for row in summary.iter_rows(named=True)}
    compared = []
    for number in numbers["number"]:
        row = rows.get(number["condition"])
        if row is None:
            continue
        parts = [row[f"{number['measure']}_{part}"] for part in Estimate._fields]
        measured = Estimate(*(float("nan") if part is None else part for part in parts))
        what = f"{number['condition']}, {number['measure']}"
        compared.append(_comparison(what, number, measured))
    for number in numbers["regret"]:
        if number["matched"] in regrets:
            other = {"performance": "learning", "learning": "performance"}[number["matched"]]
            what = f"less regret in {other}, matched {number['matched']}"
            compared.append(_comparison(what, number, regrets[number["matched"]].reduction, 2))
    return compared


def _comparison(
    what: str, number: Mapping[str, Any], measured: Estimate, digits: int = 1
) -> Comparison:
    value = number["value"]
    printed = number.get("printed", written(value, digits))
    verdict = agrees(value, number["spread"], measured)
    return Comparison(what, value, printed, measured, verdict, number.get("note", ""))
