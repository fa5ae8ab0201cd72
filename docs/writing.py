"""What the scripts that write pages share: templates, and numbers as pages have them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.statistics import IntervalEstimate

DOCS = Path(__file__).parent
PLUS_MINUS = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"


def template(name: str, *more: Callable[..., str]) -> jinja2.Template:
    """A page to be filled in, for instance "reproduction.md.j2", with more filters of its own."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(DOCS),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=jinja2.StrictUndefined,
    )
    filters = (number, per_cent, estimate, with_error, rate, readable, *more)
    environment.filters |= {f.__name__: f for f in filters}
    return environment.get_template(name)


def number(value: float | None, digits: int = 1) -> str:
    """A number for the page; a dash if there is none."""
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value:,.{digits}f}".replace("-", "\N{MINUS SIGN}")


def per_cent(value: float) -> str:
    """A share in whole per cent."""
    return number(100 * value, 0) + "%" if np.isfinite(value) else "–"


def estimate(value: IntervalEstimate, digits: int = 1) -> str:
    """A mean with half the width of its 95% interval."""
    if not np.isfinite(value.mean):
        return number(None)
    half = (value.high - value.low) / 2
    return f"{number(value.mean, digits)}{PLUS_MINUS}{number(half, digits)}"


def with_error(value: Any, digits: int = 1) -> str:
    """A mean with 1.96 of its standard error; a dash if there is none."""
    if value is None or not np.isfinite(value.mean):
        return number(None)
    return f"{number(value.mean, digits)}{PLUS_MINUS}{number(1.96 * value.error, digits)}"


def rate(value: IntervalEstimate) -> str:
    """A share in per cent, with half the width of its 95% interval."""
    return estimate(IntervalEstimate(*(100 * part for part in value)), 0)


def measure(row: dict[str, Any], name: str) -> IntervalEstimate:
    """A measure of a row of `summary.csv`."""
    parts = (row[f"{name}_{part}"] for part in IntervalEstimate._fields)
    return IntervalEstimate(*(float("nan") if part is None else part for part in parts))
