"""Where learners went and where they were overridden, on the task's grid."""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
import polars as pl
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from qbumpers.analysis.figures.style import figure, readable

_PANELS = {
    "assisted": "assisted steps",
    "overridden": "overridden steps",
    "unassisted": "unassisted steps",
}
_TICKS = (0.001, 0.01, 0.1, 1, 10)
_WIDTH, _GAP = 10, 0.04  # of the figure in inches; between maps, of a map's width
_COLOURS = mpl.colormaps["viridis"].with_extremes(bad="#e9e9e9")


def visit_counts(states: pl.DataFrame, episodes: Mapping[str, int]) -> pl.DataFrame:
    """Steps per episode in each cell of a grid.

    Args:
        states: as in `states.parquet`, of a task on a grid.
        episodes: of the conditions that are asked for, by id, over all their trials; counts are
            divided by it.

    Returns:
        A row per condition and grid cell: condition, row, column, assisted, overridden, unassisted.
    """
    chosen = states.filter(pl.col("condition").is_in(list(episodes)))
    order = pl.col("condition").replace_strict({c: i for i, c in enumerate(episodes)})
    number = pl.col("condition").replace_strict(dict(episodes), return_dtype=pl.Float64)
    return chosen.sort(order, "state").select(
        "condition", "row", "column", *(pl.col(name) / number for name in _PANELS)
    )


def heatmap_figure(counts: pl.DataFrame) -> Figure:
    """Steps per episode in each cell of the grid, a row of maps per condition.

    Args:
        counts: from `visit_counts`.

    Returns:
        The figure; grey cells were never entered.
    """
    conditions = counts["condition"].unique(maintain_order=True).to_list()
    rows, columns = (int(counts[name].to_numpy().max()) + 1 for name in ("row", "column"))
    maps = counts.select(*_PANELS).to_numpy().reshape(len(conditions), rows, columns, len(_PANELS))
    # All maps on one pair of axes: a pair for each would take many times as long to draw.
    inch = (len(_PANELS) * columns + 2 * _GAP * columns) / _WIDTH
    across, down = (1 + _GAP) * columns, rows + 0.5 * inch
    norm = LogNorm(_TICKS[0], _TICKS[-1], clip=True)
    with figure(_WIDTH, len(conditions) * down / inch + 0.7) as drawing:
        axes = drawing.subplots()
        for place, panel in np.ndindex(len(conditions), len(_PANELS)):
            left, low = panel * across, (place + 1) * down
            # Not by `imshow`, which scales the axes anew for each.
            image = AxesImage(
                axes, cmap=_COLOURS, norm=norm, origin="upper",
                extent=(left, left + columns, low, low - rows),
            )  # fmt: skip
            image.set_data(np.ma.masked_equal(maps[place, :, :, panel], 0))
            axes.add_image(image)
            axes.text(left, low - rows - 0.07 * inch, list(_PANELS.values())[panel], fontsize=9)
            if panel == 0:
                name = readable(conditions[place])
                axes.text(left, low - rows - 0.26 * inch, name, fontsize=9, weight="bold")
        axes.set(aspect="equal", xlim=(0, across * len(_PANELS)), ylim=(len(conditions) * down, 0))
        axes.set_axis_off()
        bar = drawing.colorbar(
            ScalarMappable(norm, _COLOURS), ax=axes, label="steps per episode", location="bottom",
            shrink=0.5, aspect=40,
        )  # fmt: skip
        least, *between, most = (f"{tick:g}" for tick in _TICKS)
        bar.set_ticks(_TICKS, labels=[f"≤ {least}", *between, f"≥ {most}"])
        bar.minorticks_off()
    return drawing
