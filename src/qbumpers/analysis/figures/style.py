"""How every figure looks: legible in print and to colour-blind readers."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers.files import write_atomically

NAMES = {
    "none": "No assistance",
    "maximal": "Maximal assistance",
    "local-q-thresholding": "Local Q-Thresholding",
    "stochastic-q-bumpers": "Stochastic Q Bumpers",
}
"""Assistants as figures call them."""

# Okabe and Ito's palette, which stays distinct under the common colour blindnesses.
_COLOURS = {
    "none": "#000000",
    "maximal": "#7a7a7a",
    "local-q-thresholding": "#d55e00",
    "stochastic-q-bumpers": "#0072b2",
}
_MARKERS = {"none": "s", "maximal": "D", "local-q-thresholding": "^", "stochastic-q-bumpers": "o"}
_SPARE_COLOURS = ("#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_SPARE_MARKERS = ("v", "P", "X", "<")

_STYLE: Any = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "svg.hashsalt": "qbumpers",
    "svg.fonttype": "none",
}


def colour(assistant: str) -> str:
    """The colour of an assistant, by name."""
    return _COLOURS.get(assistant) or _SPARE_COLOURS[_spare(assistant, len(_SPARE_COLOURS))]


def marker(assistant: str) -> str:
    """The marker of an assistant, by name."""
    return _MARKERS.get(assistant) or _SPARE_MARKERS[_spare(assistant, len(_SPARE_MARKERS))]


def _spare(assistant: str, count: int) -> int:
    return sum(assistant.encode()) % count


def readable(condition: str) -> str:
    """A condition's id as figures call it, for instance "Stochastic Q Bumpers, α = 0.7"."""
    name, _, options = condition.partition("/")
    label = NAMES.get(name, name)
    if not options:
        return label
    return f"{label}, " + options.replace("alpha=", "α = ").replace(",", ", ")


@contextmanager
def figure(width: float, height: float) -> Iterator[Figure]:
    """An empty figure in the common style.

    Args:
        width: in inches.
        height: in inches.

    Yields:
        The figure, with its layout managed.
    """
    with mpl.rc_context(_STYLE):
        yield Figure(figsize=(width, height), layout="constrained")


def save(drawing: Figure, folder: Path, name: str) -> Path:
    """Write a figure as PNG and SVG, atomically.

    Args:
        drawing: the figure.
        folder: where to.
        name: without ending.

    Returns:
        The path of the PNG.
    """
    with mpl.rc_context(_STYLE):
        for ending, metadata in (("svg", {"Date": None}), ("png", {"Software": None})):
            write_atomically(
                folder / f"{name}.{ending}",
                lambda path, e=ending, m=metadata: drawing.savefig(path, format=e, metadata=m),
            )
            drawing.set_layout_engine("none")  # the layout stays; finding it takes longest
    return folder / f"{name}.png"


def label_in_column(axes: Axes, points: np.ndarray, labels: list[str], at: float, ink: str) -> None:
    """Label a cluster of points in a column beside it, with a line to each point.

    Args:
        axes: to draw on, with its limits set.
        points: float64 [N, 2], in data units.
        labels: N of them.
        at: horizontal place of the column, as a share of the width of the axes.
        ink: colour.
    """
    low, high = axes.get_ylim()
    order = np.argsort(points[:, 1])
    wanted = (points[order, 1] - low) / (high - low)
    places = _spread_out(wanted, gap=min(0.062, 0.94 / max(1, len(labels))))
    for place, index in zip(places, order, strict=True):
        axes.annotate(
            labels[index],
            xy=tuple(points[index]),
            xytext=(at, place),
            textcoords="axes fraction",
            fontsize=8,
            color=ink,
            va="center",
            arrowprops={"arrowstyle": "-", "color": ink, "alpha": 0.45, "linewidth": 0.7},
        )


def _spread_out(wanted: np.ndarray, gap: float) -> np.ndarray:
    """Places near the wanted ones (sorted), at least a gap apart, within [0.03, 0.97]."""
    places = np.clip(wanted, 0.03, 0.97)
    for index in range(1, len(places)):
        places[index] = max(places[index], places[index - 1] + gap)
    overflow = places[-1] - 0.97
    if overflow > 0:
        places[-1] = 0.97
        for index in range(len(places) - 2, -1, -1):
            places[index] = min(places[index], places[index + 1] - gap)
    return places
