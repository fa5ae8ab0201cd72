"""Section 4.1 in pictures."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex

from qbumpers.reproduction.cliff_walking.threshold_figures import (
    overrides_figure,
    shares_figure,
    values_figure,
)
from qbumpers.reproduction.cliff_walking.thresholds import (
    KINDS,
    overridden,
    positions,
    suboptimal_moves,
)
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.cliff_walking import state_of
from qbumpers.values import solve
from tests.analysis.drawn import corners, xs, ys
from tests.narrowing import present

TABLE = solve(cliff_walking()).table
ORANGE, WHITE = "#d55e00", "#ffffff"
# Where a move's triangle lies in its cell, the vertical axis downwards: up, right, down, left.
SIDES = {0: (0.5, 1 / 6), 1: (5 / 6, 0.5), 2: (0.5, 5 / 6), 3: (1 / 6, 0.5)}


def triangles(axes):
    """The colour of each move's triangle, by row, column and action."""
    collection = next(c for c in axes.collections if len(c.get_paths()) == 4 * len(positions()))
    assert isinstance(collection, PolyCollection)
    found = {}
    for path, ink in zip(
        collection.get_paths(), np.asarray(collection.get_facecolor()), strict=True
    ):
        x, y = corners(path)[:3].mean(axis=0)
        place = (x % 1, y % 1)
        action = next(a for a, side in SIDES.items() if place == pytest.approx(side))
        found[int(y), int(x), action] = to_hex(ink)
    return found


def test_every_move_bears_its_value():
    [axes] = values_figure(TABLE).axes
    numbers = {text.get_position(): text.get_text() for text in axes.texts}
    for row, column in positions():
        for action, (x, y) in SIDES.items():
            [text] = [
                label
                for place, label in numbers.items()
                if place == pytest.approx((column + x, row + y), abs=0.05) and label not in "SG"
            ]
            assert float(text) == TABLE[state_of(row, column), action]


def test_optimal_moves_are_green_and_the_rest_is_not():
    colours = triangles(values_figure(TABLE).axes[0])
    assert len(colours) == 4 * 37
    best = {
        key
        for key in colours
        if TABLE[state_of(*key[:2]), key[2]] == TABLE[state_of(*key[:2])].max()
    }
    assert {colours[key] for key in best} == {"#cfe8d5"}
    assert "#cfe8d5" not in {colours[key] for key in colours.keys() - best}


def test_the_two_cells_of_the_section_are_outlined():
    [axes] = values_figure(TABLE).axes
    outlines = [c for c in axes.collections if len(c.get_paths()) == 1]
    places = {tuple(corners(outline.get_paths()[0]).min(axis=0)) for outline in outlines}
    assert places == {(6.0, 2.0), (6.0, 1.0)}


@pytest.mark.parametrize("alphas", [[0.0195], [0.5, 0.499, 0.0195]])
def test_maps_show_in_orange_what_each_threshold_overrides(alphas):
    drawing = overrides_figure(TABLE, alphas)
    shown = [axes for axes in drawing.axes if axes.get_visible()]
    titles = [axes.get_title(loc="left") for axes in shown]
    assert titles == [f"α = {alpha:g}" for alpha in alphas]
    for axes, alpha in zip(shown, alphas, strict=True):
        decided = overridden(TABLE, alpha)
        colours = triangles(axes)
        orange = {key for key, ink in colours.items() if ink == ORANGE}
        assert orange == {key for key in colours if decided[state_of(*key[:2]), key[2]]}
        white = {key for key, ink in colours.items() if ink == WHITE}
        assert white == {
            key
            for key in colours
            if TABLE[state_of(*key[:2]), key[2]] == TABLE[state_of(*key[:2])].max()
        }


def test_shares_fall_in_steps_at_the_critical_thresholds():
    moves = suboptimal_moves(TABLE)
    [axes] = shares_figure(moves).axes
    assert axes.get_xscale() == "log"
    assert axes.get_xlabel() == "threshold α (logarithmic)"
    assert [text.get_text() for text in axes.get_xticklabels()] == ["0.001", "0.01", "0.1", "1"]
    assert axes.get_ylabel() == "suboptimal moves\noverridden, per cent"
    assert [text.get_text() for text in present(axes.get_legend()).get_texts()] == list(KINDS)
    for kind, line in enumerate(axes.lines):
        own = [move.critical for move in moves if move.kind == kind]
        assert line.get_drawstyle() == "steps-post"
        alphas, shares = xs(line), ys(line)
        assert {0.001, 1.0} <= set(alphas)
        for alpha in (0.002, 0.0105, 0.0185, 0.3, 0.75, 1.0):
            place = np.searchsorted(alphas, alpha, side="right") - 1
            expected = 100 * sum(critical > alpha for critical in own) / len(own)
            assert shares[place] == pytest.approx(expected)
