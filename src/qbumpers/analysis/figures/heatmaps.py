"""Where learners went and where they were overridden, on the task's grid."""

from collections.abc import Sequence

import numpy as np
import polars as pl
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from qbumpers.analysis.figures.style import figure, readable

_PANELS = (
    ("assisted", "steps with the assistant"),
    ("overridden", "overridden steps"),
    ("unassisted", "steps without it"),
)


def heatmap_figure(states: pl.DataFrame, conditions: Sequence[str], episodes: int) -> Figure:
    """Steps an episode in each cell of the grid, a row of panels a condition.

    Args:
        states: as in `states.parquet`, of a task on a grid.
        conditions: which ones.
        episodes: over all trials of a condition; counts are divided by it.

    Returns:
        The figure; grey cells were never entered.
    """
    rows, columns = (int(states[name].to_numpy().max()) + 1 for name in ("row", "column"))
    height = 0.75 + len(conditions) * (0.55 + 3.4 * rows / columns)
    norm = LogNorm(1e-3, 10, clip=True)
    with figure(11, height) as drawing:
        panels = drawing.subplots(len(conditions), len(_PANELS), squeeze=False)
        image = None
        for axes_row, condition in zip(panels, conditions, strict=True):
            chosen = states.filter(pl.col("condition") == condition).sort("state")
            for axes, (column, title) in zip(axes_row, _PANELS, strict=True):
                counts = chosen[column].to_numpy().reshape(rows, columns) / episodes
                cells = np.ma.masked_equal(counts, 0)
                image = axes.imshow(cells, norm=norm, cmap="viridis")
                axes.set(xticks=[], yticks=[], facecolor="#ececec")
                axes.spines[:].set_visible(False)
                axes.grid(visible=False)
                axes.set_title(title, fontsize=9, fontweight="normal")
            axes_row[0].set_title(f"{readable(condition)}\n{_PANELS[0][1]}", fontsize=9)
        if image is not None:
            drawing.colorbar(
                image, ax=panels.ravel().tolist(), label="steps an episode", location="bottom",
                shrink=0.5, aspect=40,
            )  # fmt: skip
    return drawing
