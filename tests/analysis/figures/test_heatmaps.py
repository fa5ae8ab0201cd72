"""Where learners went, on the grid."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.heatmaps import heatmap_figure

CONDITIONS = ["none", "stochastic-q-bumpers/alpha=0.7"]
COUNTS = ("assisted", "overridden", "unassisted")
ROWS, COLUMNS, EPISODES = 3, 4, 20


def states():
    generator = np.random.default_rng(3)
    parts = [
        pl.DataFrame({"state": np.arange(ROWS * COLUMNS)}).with_columns(
            condition=pl.lit(condition),
            row=pl.col("state") // COLUMNS,
            column=pl.col("state") % COLUMNS,
            **{name: generator.integers(0, 3, ROWS * COLUMNS) * 10 for name in COUNTS},
        )
        for condition in CONDITIONS
    ]
    return pl.concat(parts)


def test_every_condition_is_a_row_of_three_maps_of_steps_an_episode():
    table = states()
    drawing = heatmap_figure(table.sample(fraction=1, shuffle=True, seed=1), CONDITIONS, EPISODES)
    panels = [axes for axes in drawing.axes if axes.images]
    assert len(panels) == 2 * 3
    for axes, (condition, name) in zip(
        panels, [(c, n) for c in CONDITIONS for n in COUNTS], strict=True
    ):
        shown = axes.images[0].get_array()
        by_hand = np.zeros((ROWS, COLUMNS))
        for row in table.filter(condition=condition).iter_rows(named=True):
            by_hand[row["row"], row["column"]] = row[name] / EPISODES
        assert np.array_equal(shown.mask, by_hand == 0)  # grey
        assert shown.filled(0) == pytest.approx(by_hand)


def test_rows_and_panels_are_named_and_share_one_scale():
    drawing = heatmap_figure(states(), CONDITIONS, EPISODES)
    panels = [axes for axes in drawing.axes if axes.images]
    titles = [axes.get_title(loc="left") for axes in panels]
    assert titles[0].startswith("No assistance\n")
    assert titles[3].startswith("Stochastic Q Bumpers, α = 0.7\n")
    for row in (titles[:3], titles[3:]):
        assert row[0].endswith("steps with the assistant")
        assert row[1:] == ["overridden steps", "steps without it"]
    assert len({axes.images[0].norm for axes in panels}) == 1
    [bar] = [axes for axes in drawing.axes if not axes.images]
    assert bar.get_xlabel() == "steps an episode"


def test_a_condition_that_was_never_overridden_is_drawn_all_grey():
    table = states().with_columns(overridden=pl.lit(0))
    drawing = heatmap_figure(table, CONDITIONS[:1], EPISODES)
    drawing.draw_without_rendering()
    assert drawing.axes[1].images[0].get_array().mask.all()
