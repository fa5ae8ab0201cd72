"""How every figure looks: legible in print and to colour-blind readers."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import Any, Literal, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator, ScalarFormatter

from qbumpers.analysis.formatting import format_number
from qbumpers.files import write_atomically

NAMES = {
    "none": "No assistance",
    "maximal": "Maximal assistance",
    "local-q-thresholding": "Local Q-Thresholding",
    "stochastic-q-bumpers": "Stochastic Q Bumpers",
}
"""Assistants as figures call them."""


class Look(NamedTuple):
    """How an assistant is drawn; colour is never the only sign.

    Attributes:
        colour: as "#rrggbb".
        marker: shape of its points, as Matplotlib names it.
    """

    colour: str
    marker: str


# Okabe and Ito's palette, which stays distinct under the common colour blindnesses.
_LOOKS = {
    "none": Look("#000000", "s"),
    "maximal": Look("#7a7a7a", "D"),
    "local-q-thresholding": Look("#d55e00", "^"),
    "stochastic-q-bumpers": Look("#0072b2", "o"),
}
# Four colours and five markers: twenty looks before one returns.
_SPARE_COLOURS = ("#009e73", "#cc79a7", "#b8860b", "#56b4e9")
_SPARE_MARKERS = ("v", "P", "X", "<", ">")
DASHES = ("-", "--", ":", "-.")
"""Lines of one assistant."""

_STYLE: Any = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # looking for a place above all labels is a tenth of the time
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "xtick.bottom": False,  # the grid shows where ticks are, and is quicker to draw alone
    "ytick.left": False,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "text.parse_math": False,  # names of one's own may have dollar signs
    "figure.dpi": 100,
    "savefig.dpi": 150,
    "svg.hashsalt": "qbumpers",
    "svg.fonttype": "none",
}


def looks(assistants: Iterable[str]) -> dict[str, Look]:
    """How to draw assistants, each differently.

    Args:
        assistants: names, those of one experiment in its order.

    Returns:
        The look of each, the same in every figure of the experiment.
    """
    names = list(dict.fromkeys(assistants))
    spare = [name for name in names if name not in _LOOKS]
    fresh = zip(
        spare, zip(cycle(_SPARE_COLOURS), cycle(_SPARE_MARKERS), strict=False), strict=False
    )
    chosen = _LOOKS | {name: Look(*parts) for name, parts in fresh}
    return {name: chosen[name] for name in names}


def assistant_of(condition: str) -> str:
    """The assistant in a condition's id."""
    return condition.partition("@")[0].partition("/")[0]


def readable(condition: str) -> str:
    """A condition's id as figures call it, for example "Stochastic Q Bumpers, α = 0.7".

    The learner after "@" is left out: every figure is of one learner.
    """
    name, _, options = condition.partition("@")[0].partition("/")
    label = NAMES.get(name, name)
    return f"{label}, {setting(condition)}" if options else label


def setting(condition: str) -> str:
    """The options in a condition's id as figures write them, for example "α = 0.7"."""
    options = condition.partition("@")[0].partition("/")[2]
    return options.replace("alpha=", "α = ").replace(",", ", ")


_PNG: Any = {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 4}}
_FAR, _NEAR = 1000, 100  # beyond the first, what lies nearer to zero could not be distinguished


def show_returns(axes: Axes, axis: Literal["x", "y"]) -> None:
    """Show returns so that they can be read, with numbers written in full.

    Small returns beside very large losses are shown linear within -100..100, logarithmic beyond.

    Args:
        axes: with everything drawn.
        axis: which one.
    """
    along, set_scale = (
        (axes.xaxis, axes.set_xscale) if axis == "x" else (axes.yaxis, axes.set_yscale)
    )
    low, high = along.get_view_interval()
    if low >= -_FAR or not -_NEAR <= high <= -low:
        write_in_full(along)
        return
    set_scale("symlog", linthresh=_NEAR, linscale=1.2)
    steps, most = ((1,), 3) if axis == "x" else ((1, 3), 12)  # side by side they need more space
    sizes = [step * 10**power for power in range(2, 12) for step in steps]
    sizes = sizes[:: -(-sum(size <= -low for size in sizes) // most)]
    ticks = [tick for tick in (*(-s for s in sizes[::-1]), 0, *sizes) if low <= tick <= high]
    along.set_ticks(ticks, [format_number(tick, 0) for tick in ticks])
    along.set_minor_locator(NullLocator())


class _InFull(ScalarFormatter):
    """Numbers without offset or powers of ten, with separators if they are long."""

    def __init__(self) -> None:
        super().__init__(useOffset=False)
        self.set_scientific(b=False)

    def __call__(self, x: float, pos: int | None = None) -> str:
        whole, point, rest = str(super().__call__(x, pos)).partition(".")
        return (format_number(x, 0) if abs(x) >= _LONG and not point else whole) + point + rest


_LONG = 10_000


def write_in_full(*axes: Axis) -> None:
    """Write the numbers of linear axes in full; fewer of them if they are long."""
    for along in axes:
        along.set_major_formatter(_InFull())
        if np.abs(along.get_view_interval()).max() >= _LONG:
            along.set_major_locator(MaxNLocator(4))


@contextmanager
def _style() -> Iterator[None]:
    """The common style, whatever settings of their own a user or a notebook has."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


@contextmanager
def figure(width: float, height: float) -> Iterator[Figure]:
    """An empty figure in the common style.

    Args:
        width: in inches.
        height: in inches.

    Yields:
        The figure, with its layout managed.
    """
    with _style():
        yield Figure(figsize=(width, height), layout="constrained")


def save(drawing: Figure, folder: Path, name: str) -> Path:
    """Write a figure as PNG and SVG, atomically.

    Args:
        drawing: what is to be saved.
        folder: where the files go.
        name: without ending.

    Returns:
        The path of the PNG.
    """
    vector, pixels = (folder / f"{name}.{ending}" for ending in ("svg", "png"))
    with _style():
        # Laid out once for both; `savefig` would lay out and draw everything twice for each.
        drawing.dpi = _STYLE["savefig.dpi"]
        for axes in drawing.axes:
            if not axes.get_title("left"):  # else its place is looked for in every drawing
                axes.set_title("")
        engine = drawing.get_layout_engine()
        if engine is not None:
            engine.execute(drawing)
        drawing.set_layout_engine("none")
        canvas = FigureCanvasAgg(drawing)
        write_atomically(pixels, lambda path: canvas.print_png(path, **_PNG))
        outline = FigureCanvasSVG(drawing)
        write_atomically(vector, lambda path: outline.print_svg(path, metadata={"Date": None}))
    return pixels
