"""Section 4.1 in pictures: Q values beside the cliff, and what thresholds override."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import figure
from qbumpers.reproduction.cliff_walking.thresholds import (
    EXAMPLES,
    KINDS,
    Move,
    overridden,
    overridden_share,
    positions,
)
from qbumpers.tasks.cliff_walking import COLUMNS, GOAL, ROWS, START, is_cliff, state_of

_OVERRIDDEN, _FREE, _OPTIMAL, _CLIFF = "#d55e00", "#d9e7f2", "#ffffff", "#4d5359"
_KIND_COLOURS = ("#000000", "#d55e00", "#0072b2")
_KIND_DASHES = ("-", "--", ":")
_POWERS = (0.001, 0.01, 0.1, 1.0)  # in words of their own: figures read no formulas
# Corners of a position's four triangles, by action: up, right, down, left; the middle comes last.
_CORNERS = np.array(
    [[(0, 0), (1, 0)], [(1, 0), (1, 1)], [(1, 1), (0, 1)], [(0, 1), (0, 0)]], np.float64
)
_LETTER_PLACES = ((0.5, 0.17), (0.83, 0.5), (0.5, 0.83), (0.17, 0.5))


def values_figure(table: np.ndarray) -> Figure:
    """Q* of every move on the grid, the two positions of Section 4.1 outlined.

    Args:
        table: float64 [48, 4].

    Returns:
        The figure.
    """
    with figure(11, 4.2) as drawing:
        axes = drawing.subplots()
        best = table.max(axis=1, keepdims=True)
        _draw_grid(axes, np.where(table == best, "#cfe8d5", _FREE))
        for row, column in positions():
            for action, (x, y) in enumerate(_LETTER_PLACES):
                axes.text(
                    column + x, row + y, f"{table[state_of(row, column), action]:g}",
                    ha="center", va="center", fontsize=7,
                )  # fmt: skip
        for row, column in EXAMPLES:
            square = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)]
            axes.add_collection(
                PolyCollection([square], facecolor="none", edgecolor="#d55e00", linewidth=2.5)
            )
        axes.set_title("Q* of each move; optimal moves green, the grid cells discussed outlined")
    return drawing


def overrides_figure(table: np.ndarray, alphas: Sequence[float]) -> Figure:
    """Which moves Local Q-Thresholding overrides, a map per threshold.

    Args:
        table: Q*, float64 [48, 4].
        alphas: thresholds.

    Returns:
        The figure.
    """
    with figure(11, 1.75 * ((len(alphas) + 1) // 2) + 0.6) as drawing:
        panels = drawing.subplots((len(alphas) + 1) // 2, 2, squeeze=False).ravel()
        best = table.max(axis=1, keepdims=True)
        for axes, alpha in zip(panels, alphas, strict=False):
            colours = np.where(table == best, _OPTIMAL, _FREE)
            _draw_grid(axes, np.where(overridden(table, alpha), _OVERRIDDEN, colours))
            axes.set_title(f"α = {alpha:g}", fontsize=10)
        for axes in panels[len(alphas) :]:
            axes.set_visible(False)
        drawing.suptitle(
            "Moves that the threshold overrides (orange), leaves free (blue); optimal moves white",
            fontsize=10,
        )
    return drawing


def shares_figure(moves: list[Move]) -> Figure:
    """Share of suboptimal moves overridden against the threshold, by kind of move.

    Args:
        moves: from `suboptimal_moves`.

    Returns:
        The figure.
    """
    alphas = np.unique(
        np.concatenate([[1e-3, 1.0], *([m.critical - 1e-6, m.critical] for m in moves)])
    )
    with figure(9, 3.8) as drawing:
        axes = drawing.subplots()
        for kind, name in enumerate(KINDS):
            share = overridden_share(moves, kind, alphas)
            axes.plot(
                alphas, 100 * share, _KIND_DASHES[kind], color=_KIND_COLOURS[kind], label=name,
                drawstyle="steps-post", linewidth=2,
            )  # fmt: skip
        axes.set_xscale("log")
        axes.set_xticks(_POWERS, [f"{power:g}" for power in _POWERS])
        axes.set(
            xlabel="threshold α (logarithmic)",
            ylabel="suboptimal moves\noverridden, per cent",
            title="No threshold holds the walker back only where it matters",
            ylim=(-4, 104),
        )
        axes.legend(loc="center left")
    return drawing


def _draw_grid(axes: Axes, colours: np.ndarray) -> None:
    """Positions as four triangles, coloured by state and action [S, A]."""
    triangles, fills = [], []
    for row, column in positions():
        for action in range(4):
            corners = [*(_CORNERS[action] + (column, row)), np.array([column + 0.5, row + 0.5])]
            triangles.append(corners)
            fills.append(colours[state_of(row, column), action])
    axes.add_collection(
        PolyCollection(triangles, facecolors=fills, edgecolors="#9aa0a6", linewidths=0.5)
    )
    fixed = [(r, c) for r, c in np.ndindex(ROWS, COLUMNS) if is_cliff(r, c)]
    squares = [[(c, r), (c + 1, r), (c + 1, r + 1), (c, r + 1)] for r, c in [*fixed, GOAL]]
    axes.add_collection(
        PolyCollection(
            squares, facecolors=[_CLIFF] * len(fixed) + ["#d9ecd6"], edgecolors="#9aa0a6"
        )
    )
    for letter, (row, column), ink in (("S", START, "#2c5f8f"), ("G", GOAL, "#2f7031")):
        axes.text(
            column + 0.5, row + 0.5, letter, ha="center", va="center", color=ink, weight="bold"
        )
    axes.set(xlim=(0, COLUMNS), ylim=(ROWS, 0), xticks=[], yticks=[], aspect="equal")
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
