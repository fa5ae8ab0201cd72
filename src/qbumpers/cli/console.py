"""What the command line prints, and how numbers look there."""

import codecs
import contextlib
import io
import math
import re
import sys
import warnings
from collections.abc import Generator
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from qbumpers.analysis.formatting import decimals_for, format_number

OUTPUT, ERRORS = Console(highlight=False), Console(stderr=True, highlight=False)

_SPELT = str.maketrans({
    "α": "alpha", "±": "+-", "≤": "<=", "\N{MINUS SIGN}": "-", "\N{EN DASH}": "-",
    "\N{NO-BREAK SPACE}": " ", "\N{HORIZONTAL ELLIPSIS}": "...",
})  # fmt: skip


def spelt_out(error: UnicodeError) -> tuple[bytes, int]:
    """What is printed in place of characters that an encoding does not have, for `codecs`."""
    assert isinstance(error, UnicodeEncodeError)
    spelt = error.object[error.start : error.end].translate(_SPELT)
    try:
        return spelt.encode("ascii", "surrogateescape"), error.end  # bytes of a path, as they came
    except UnicodeEncodeError:
        return spelt.encode("ascii", "backslashreplace"), error.end


codecs.register_error("spelt-out", spelt_out)


def print_in_any_encoding() -> None:
    """Have standard output and errors spell out what their encoding does not have."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="spelt-out")


_warned: set[str] = set()


def forget_warnings() -> None:
    """Forget what was warned of, at the beginning of a command."""
    _warned.clear()


def print_warning(message: Warning | str, *_: Any) -> None:
    """A warning in one line, once per command; in place of `warnings.showwarning`."""
    plain = in_one_line(re.sub(r"\x1b\[[0-9;]*m", "", str(message)))
    if plain not in _warned:
        _warned.add(plain)
        ERRORS.print(f"warning: {escape(plain)}", soft_wrap=True)


def in_one_line(message: object) -> str:
    """A message without line breaks: those of libraries often have some."""
    return " ".join(str(message).split())


@contextlib.contextmanager
def expert_warnings_printed() -> Generator[None, None, None]:
    """Print warnings about action values, a line each."""
    from qbumpers.experts import ExpertWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ExpertWarning)
        yield
    for warning in caught:
        print_warning(warning.message)


def table(*columns: str) -> Table:
    """A plain table; its first column is never broken into lines."""
    made = Table(box=None, pad_edge=False, header_style="bold", caption_justify="left")
    for column in columns:
        made.add_column(column, overflow="fold", no_wrap=column == columns[0])
    return made


def interval(mean: float | None, low: float | None, high: float | None, digits: int = 1) -> str:
    """A mean with half the width of its interval, if it has one; a dash if it is not known."""
    if mean is None:
        return "-"
    digits = decimals_for(low, high, digits)
    if low is None or high is None or not math.isfinite(low):
        return _number(mean, digits)
    return f"{_number(mean, digits)} \N{PLUS-MINUS SIGN} {_number((high - low) / 2, digits)}"


def _number(value: float, digits: int) -> str:
    """With the minus sign of a keyboard, and separators only if it has no decimals."""
    return f"{value:.{digits}f}" if digits > 0 else typeable(format_number(value, digits))


def duration(seconds: float) -> str:
    """A time in words, for example "3 s" or "2 h 10 min"."""
    if seconds < 1:
        return "less than a second"
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def typeable(text: str) -> str:
    """Text with the minus signs of a keyboard, which can be searched for in a terminal."""
    return text.replace("\N{MINUS SIGN}", "-")
