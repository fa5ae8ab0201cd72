"""Where learners went, on the grid."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.heatmaps import heatmap_figure, visit_counts

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


def drawn_from(table, conditions=CONDITIONS):
    return heatmap_figure(visit_counts(table, dict.fromkeys(conditions, EPISODES)))


def maps_of(drawing):
    """Maps row by row, each row from left to right."""
    images = drawing.axes[0].images
    return sorted(images, key=lambda image: (image.get_extent()[2], image.get_extent()[0]))


def test_every_condition_is_a_row_of_three_maps_of_steps_an_episode():
    table = states()
    maps = maps_of(drawn_from(table.sample(fraction=1, shuffle=True, seed=1)))
    assert len(maps) == 2 * 3
    for image, (condition, name) in zip(
        maps, [(c, n) for c in CONDITIONS for n in COUNTS], strict=True
    ):
        shown = image.get_array()
        by_hand = np.zeros((ROWS, COLUMNS))
        for row in table.filter(condition=condition).iter_rows(named=True):
            by_hand[row["row"], row["column"]] = row[name] / EPISODES
        assert np.array_equal(shown.mask, by_hand == 0)  # grey
        assert shown.filled(0) == pytest.approx(by_hand)


def test_maps_stand_apart_with_square_cells():
    extents = np.array([image.get_extent() for image in maps_of(drawn_from(states()))])
    left, right, bottom, top = extents.T
    assert right - left == pytest.approx(COLUMNS)
    assert bottom - top == pytest.approx(ROWS)
    assert (left[1:3] > right[:2]).all()
    assert (top[3:] > bottom[:3]).all()


def test_rows_and_maps_are_named_and_share_one_scale():
    drawing = drawn_from(states())
    texts = sorted(drawing.axes[0].texts, key=lambda t: t.get_position()[::-1])
    maps = ["assisted steps", "overridden steps", "unassisted steps"]
    names = ["No assistance", "Stochastic Q Bumpers, α = 0.7"]
    assert [text.get_text() for text in texts] == [names[0], *maps, names[1], *maps]
    assert len({image.norm for image in maps_of(drawing)}) == 1
    [bar] = [axes for axes in drawing.axes if not axes.images]
    assert bar.get_xlabel() == "steps per episode"


def test_the_numbers_behind_the_maps_are_in_the_order_asked_for():
    counts = visit_counts(states(), {CONDITIONS[1]: EPISODES, CONDITIONS[0]: 2 * EPISODES})
    assert counts["condition"].unique(maintain_order=True).to_list() == CONDITIONS[::-1]
    first = counts.row(0, named=True)
    [state] = states().filter(condition=CONDITIONS[1], state=0).to_dicts()
    assert (first["row"], first["column"]) == (0, 0)
    assert first["assisted"] == state["assisted"] / EPISODES
    last = counts.row(-1, named=True)
    [state] = states().filter(condition=CONDITIONS[0], state=ROWS * COLUMNS - 1).to_dicts()
    assert last["unassisted"] == state["unassisted"] / (2 * EPISODES)


def test_a_condition_that_was_never_overridden_is_drawn_all_grey():
    drawing = drawn_from(states().with_columns(overridden=pl.lit(0)), CONDITIONS[:1])
    drawing.draw_without_rendering()
    assert maps_of(drawing)[1].get_array().mask.all()
