"""What a page is made of: tables, drawings, and sections of both."""

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import polars as pl
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.formatting import NONE, decimals_for, format_number, format_share


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        title: heads the column.
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
        rows: each of N texts.
        file: where the numbers are, to be offered with it; empty for none.
        cards: whether a narrow screen shows each row as a card rather than leaving columns out.
        folded: the line that a reader opens to see the table; empty if it is always open.
    """

    columns: Sequence[Column]
    rows: Sequence[Sequence[str]]
    file: str = ""
    cards: bool = False
    folded: str = ""


class Drawing(NamedTuple):
    """A figure of a report.

    Attributes:
        kind: what it is, for example "frontier".
        label: what distinguishes its learner from others; empty if there is one, or it shows none.
        caption: what can be seen.
        numbers: what it is drawn from, a row per mark.
        draw: makes the figure.
    """

    kind: str
    label: str
    caption: str
    numbers: pl.DataFrame
    draw: Callable[[], Figure]

    @property
    def name(self) -> str:
        """The name of its files, without ending."""
        return f"{self.kind}@{self.label}" if self.label else self.kind


class Section(NamedTuple):
    """A section that is added to a page.

    Attributes:
        id: its anchor.
        title: heads it and stands in the menu; empty for a note, which has neither.
        after: id of the section of every report that it follows.
        content: its paragraphs, tables and drawings, in order.
        file: a table that is offered at its end; empty for none.
    """

    id: str
    title: str
    after: str
    content: Sequence[Markup | Table | Drawing]
    file: str = ""


def interval(mean: float | None, low: float | None, high: float | None, least: int = 1) -> Markup:
    """A number with at least so many decimals and, softer, its interval."""
    digits = decimals_for(low, high, least)
    return _with_range(*(format_number(value, digits) for value in (mean, low, high)))


def share(mean: float | None, low: float | None, high: float | None) -> Markup:
    """A share and its interval, as percentages."""
    return _with_range(*(format_share(value) for value in (mean, low, high)))


def _with_range(mean: str, low: str, high: str) -> Markup:
    if mean == NONE:
        return Markup(NONE)
    if NONE in (low, high):
        return Markup('{} <span class="range">no interval</span>').format(mean)
    return Markup('{} <span class="range">[{}, {}]</span>').format(mean, low, high)


def unbroken(condition: str) -> str:
    """A condition as readers call it, each of its settings kept on one line."""
    return readable(condition).replace(" = ", "\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}")


def breakable(condition: str) -> Markup:
    """A condition's id, which may continue on another line after its separators."""
    return Markup(re.sub(r"([/,@])", r"\1<wbr>", str(escape(condition))))
