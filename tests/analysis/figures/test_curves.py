"""Learning curves."""

import numpy as np
import pytest

from qbumpers.analysis.figures.curves import curves_figure, representative
from qbumpers.analysis.measures import learning_curve
from tests.analysis.examples import BUMPERS, THRESHOLDS, episode_table, summary_table

CHOSEN = ["none", *list(BUMPERS)[:2]]


def test_every_condition_is_a_line_with_a_band_in_both_panels():
    table = episode_table(CHOSEN)
    drawing = curves_figure(table, CHOSEN)
    assert [axes.get_title(loc="left") for axes in drawing.axes] == [
        "With the assistant",
        "Without it",
    ]
    for axes, column in zip(drawing.axes, ("assisted_return", "unassisted_return"), strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("episode", "return")
        assert len(axes.lines) == len(axes.collections) == 3
        for line, condition in zip(axes.lines, CHOSEN, strict=True):
            assert line.get_xdata().tolist() == [1, 2, 3, 4, 5, 6]
            assert line.get_ydata() == pytest.approx(learning_curve(table, condition, column)[0])


def test_the_legend_names_the_conditions_and_lines_of_one_assistant_differ():
    drawing = curves_figure(episode_table(CHOSEN), CHOSEN)
    [legend] = drawing.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "No assistance",
        "Stochastic Q Bumpers, α = 0.2",
        "Stochastic Q Bumpers, α = 0.5",
    ]
    lines = drawing.axes[0].lines
    assert lines[1].get_color() == lines[2].get_color() != lines[0].get_color()
    assert lines[1].get_linestyle() != lines[2].get_linestyle()


@pytest.mark.parametrize(
    ("deepest", "scale"), [(-100.0, "linear"), (-5000.0, "symlog")], ids=["near", "far"]
)
def test_returns_of_very_different_size_get_a_logarithmic_scale(deepest, scale):
    drawing = curves_figure(episode_table(CHOSEN, deepest=deepest), CHOSEN)
    assert {axes.get_yscale() for axes in drawing.axes} == {scale}
    drawing.draw_without_rendering()
    labels = [label.get_text() for label in drawing.axes[0].get_yticklabels()]
    assert ("\N{MINUS SIGN}1,000" in labels) == (scale == "symlog")


@pytest.mark.parametrize("shape", [{"trials": 1}, {"episodes": 1}, {"trials": 1, "episodes": 1}])
def test_a_single_trial_or_episode_is_drawn_too(shape):
    drawing = curves_figure(episode_table(CHOSEN, **shape), CHOSEN)
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
