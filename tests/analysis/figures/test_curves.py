"""Learning curves."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.curves import (
    MOST_POINTS,
    block_size,
    courses_figure,
    curves_figure,
    learning_curves,
    override_courses,
    representative,
)
from qbumpers.analysis.figures.style import looks
from qbumpers.analysis.measures import learning_curve, override_curve
from tests.analysis.drawn import xs, ys
from tests.analysis.examples import BUMPERS, THRESHOLDS, episode_table, summary_table

CHOSEN = ["none", *list(BUMPERS)[:2]]
DRAWN = looks(["none", "stochastic-q-bumpers"])


def episodes_of(conditions=CHOSEN, retained=0, **shape):
    """Made-up episodes, the last of which may be without the assistant."""
    table = episode_table(conditions, **shape)
    last = pl.col("episode").max()
    return table.with_columns(
        retention=pl.col("episode") > last - retained,
        overrides=pl.col("episode") % 3 + pl.col("trial"),
        assisted_length=10 + pl.col("trial"),
    )


def drawn_from(table, conditions=CHOSEN):
    return curves_figure(learning_curves(table, conditions), DRAWN)


def test_every_condition_is_a_line_with_a_band_in_both_panels():
    table = episodes_of()
    drawing = drawn_from(table)
    assert [axes.get_title(loc="left") for axes in drawing.axes] == [
        "Assisted",
        "Unassisted",
    ]
    for axes, column in zip(drawing.axes, ("assisted_return", "unassisted_return"), strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("episode", "return per episode")
        assert len(axes.lines) == len(axes.collections) == 3
        for line, condition in zip(axes.lines, CHOSEN, strict=True):
            assert xs(line).tolist() == [1, 2, 3, 4, 5, 6]
            assert ys(line) == pytest.approx(learning_curve(table, condition, column)[0])


def test_the_legend_names_the_conditions_and_lines_of_one_assistant_differ():
    drawing = drawn_from(episodes_of())
    [legend] = drawing.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "No assistance",
        "Stochastic Q Bumpers, α = 0.2",
        "Stochastic Q Bumpers, α = 0.5",
    ]
    lines = drawing.axes[0].lines
    assert lines[1].get_color() == lines[2].get_color() != lines[0].get_color()
    assert lines[1].get_marker() == lines[2].get_marker() != lines[0].get_marker()
    assert lines[1].get_linestyle() != lines[2].get_linestyle()


def test_the_numbers_behind_the_curves_are_means_and_intervals_by_episode():
    table = episodes_of(retained=2)
    numbers = learning_curves(table, CHOSEN)
    assert numbers["condition"].unique(maintain_order=True).to_list() == CHOSEN
    for condition in CHOSEN:
        rows = numbers.filter(condition=condition)
        assert rows["episode"].to_list() == [1, 2, 3, 4, 5, 6]
        assert rows["retention"].to_list() == [False] * 4 + [True] * 2
        for column in ("assisted_return", "unassisted_return"):
            parts = rows.select(f"{column}_{part}" for part in ("mean", "low", "high")).to_numpy()
            assert np.allclose(parts.T, learning_curve(table, condition, column))


def test_episodes_without_the_assistant_stand_on_grey():
    def greys(axes):
        return [
            patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches
        ]

    for axes in drawn_from(episodes_of(retained=2)).axes:
        [span] = greys(axes)
        assert (span.x0, span.x1) == pytest.approx((4.5, 6.5))
    assert not any(axes.patches for axes in drawn_from(episodes_of()).axes)


def test_the_course_of_overrides_is_in_per_cent_of_steps():
    table = episodes_of(CHOSEN[1:])
    courses = override_courses(table, CHOSEN[1:])
    [axes] = courses_figure(courses, DRAWN).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("episode", "steps overridden, per cent")
    assert axes.get_ylim()[0] <= 0
    for line, condition in zip(axes.lines, CHOSEN[1:], strict=True):
        mean, low, high = override_curve(table, condition)
        rows = courses.filter(condition=condition)
        assert rows["override_rate_low"].to_numpy() == pytest.approx(low)
        assert rows["override_rate_high"].to_numpy() == pytest.approx(high)
        assert ys(line) == pytest.approx(100 * mean)


@pytest.mark.parametrize(
    ("deepest", "scale"), [(-100.0, "linear"), (-5000.0, "symlog")], ids=["near", "far"]
)
def test_returns_of_very_different_size_get_a_logarithmic_scale(deepest, scale):
    drawing = drawn_from(episodes_of(deepest=deepest))
    assert {axes.get_yscale() for axes in drawing.axes} == {scale}
    drawing.draw_without_rendering()
    labels = [label.get_text() for label in drawing.axes[0].get_yticklabels()]
    assert ("\N{MINUS SIGN}1,000" in labels) == (scale == "symlog")


@pytest.mark.parametrize("shape", [{"trials": 1}, {"episodes": 1}, {"trials": 1, "episodes": 1}])
def test_a_single_trial_or_episode_is_drawn_too(shape):
    drawing = drawn_from(episodes_of(**shape))
    drawing.draw_without_rendering()
    assert all(np.isfinite(line.get_ydata()).all() for line in drawing.axes[0].lines)


def test_the_ends_of_each_assistants_sweep_represent_it():
    chosen = representative(summary_table())
    thresholds, bumpers = list(THRESHOLDS), list(BUMPERS)
    ends = [thresholds[0], thresholds[-1], bumpers[0], bumpers[-1]]
    assert chosen == ["none", "maximal", *ends]


def test_more_of_each_are_spread_evenly():
    chosen = representative(summary_table(), each=3)
    places = [list(THRESHOLDS).index(name) for name in chosen if name in THRESHOLDS]
    assert places == [0, 2, 4]
    firsts = [next(iter(THRESHOLDS)), next(iter(BUMPERS))]
    assert representative(summary_table(), each=1)[2:] == firsts


def test_long_trainings_are_drawn_by_blocks_that_retention_does_not_share():
    table = episodes_of(CHOSEN[:1], retained=30, episodes=250 + 30)
    size = block_size(250)
    assert size == 3
    found = learning_curves(table, CHOSEN[:1])
    assert found.height == 84 + 10
    assert found["episode"].head(2).to_list() == [2, 5]  # of episodes 1 to 3, and 4 to 6
    assert found["retention"].to_list() == [False] * 84 + [True] * 10
    assert found.row(83, named=True)["episode"] == 250  # alone in the last block
    first = table.filter(pl.col("episode") < size)["unassisted_return"].to_numpy().mean()
    assert found["unassisted_return_mean"][0] == pytest.approx(first)
    assert override_courses(table, CHOSEN[:1]).height == 84


def test_the_blocks_of_a_training_are_never_more_than_can_be_told_apart():
    for length in (1, 99, 100, 101, 1999, 2000):
        assert -(-length // block_size(length)) <= MOST_POINTS
    assert [block_size(length) for length in (1, 100, 101, 2000)] == [1, 1, 2, 20]


def test_rates_are_drawn_in_per_cent_whatever_is_asked_for():
    table = episodes_of().with_columns(
        assisted_success=pl.col("episode") > 2, unassisted_success=pl.lit(value=False)
    )
    drawing = curves_figure(learning_curves(table, CHOSEN, "success"), DRAWN, "success")
    for axes, expected in zip(drawing.axes, ([0, 0, 0, 100, 100, 100], [0] * 6), strict=True):
        assert axes.get_ylabel() == "episodes that succeed, per cent"
        assert axes.get_ylim() == (-4, 104)
        assert ys(axes.lines[0]).tolist() == expected
