"""What the tables of the page are made of."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup, escape

from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.numerals import digits_for, per_cent, written


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        title: of the column.
        text: whether it holds words rather than numbers.
        secondary: whether a narrow screen may leave it out.
    """

    title: str
    text: bool = False
    secondary: bool = False


class Table(NamedTuple):
    """A table as text.

    Attributes:
        columns: N of them.
        rows: of N cells each.
        file: where the numbers are, to be offered with it; empty for none.
        cards: whether a narrow screen shows each row as a card rather than leaving columns out.
    """

    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    file: str = ""
    cards: bool = False


def interval(mean: float | None, low: float | None, high: float | None, least: int = 1) -> Markup:
    """A number and, softer, its interval."""
    digits = digits_for(low, high, least)
    return _with_range(*(written(value, digits) for value in (mean, low, high)))


def share(mean: float | None, low: float | None, high: float | None) -> Markup:
    """A share and its interval, as percentages."""
    return _with_range(*(per_cent(value) for value in (mean, low, high)))


def _with_range(mean: str, low: str, high: str) -> Markup:
    return Markup('{} <span class="range">[{}, {}]</span>').format(mean, low, high)


def named(condition: str) -> str:
    """A condition as readers call it, its settings each on one line."""
    return readable(condition).replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")


def breakable(condition: str) -> Markup:
    """A condition's id, which may go on in another line after its separators."""
    return Markup(re.sub(r"([/,@])", r"\1<wbr>", str(escape(condition))))
