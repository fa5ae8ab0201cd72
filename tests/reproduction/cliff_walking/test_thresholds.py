"""Section 4.1: the paper's numbers, from distances counted here anew."""

from collections import deque
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from qbumpers.reproduction.cliff_walking.thresholds import (
    KINDS,
    distinct_behaviours,
    distinct_thresholds,
    overridden,
    overridden_share,
    positions,
    suboptimal_moves,
    summarise_thresholds,
)
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.cliff_walking import state_of
from qbumpers.values import solve

TABLE = solve(cliff_walking()).table
MOVES = suboptimal_moves(TABLE)
STEPS = {"up": (-1, 0), "right": (0, 1), "down": (1, 0), "left": (0, -1)}
GOAL, START = (3, 11), (3, 0)
CLIFF = {(3, column) for column in range(1, 11)}
PAPER = [
    1.0, 0.5, 0.1, 0.0197, 0.0195, 0.0193, 0.0191, 0.0189, 0.0187, 0.0186, 0.0184, 0.0182, 0.0181,
    0.0,
]  # fmt: skip


def after(cell, step):
    row, column = cell[0] + step[0], cell[1] + step[1]
    return (row, column) if 0 <= row < 4 and 0 <= column < 12 else cell


def distances():
    """Steps from every cell to the goal around the cliff, breadth first."""
    found, waiting = {GOAL: 0}, deque([GOAL])
    while waiting:
        here = waiting.popleft()
        for step in STEPS.values():
            there = after(here, step)
            if there not in found and there not in CLIFF:
                found[there] = found[here] + 1
                waiting.append(there)
    return found


DISTANCE = distances()


def value(cell, step):
    """-1 a step and 100 at the goal; a fall is -100 and the way from the start."""
    there = after(cell, step)
    if there in CLIFF:
        return -100 + 100 - DISTANCE[START]
    return 100 - 1 - DISTANCE[there]


def critical_values():
    """(best - value) / (best - worst) of every suboptimal move, as fractions."""
    found = {}
    for cell in DISTANCE.keys() - {GOAL}:
        values = {name: value(cell, step) for name, step in STEPS.items()}
        best, worst = max(values.values()), min(values.values())
        for name in values:
            if values[name] < best:
                found[*cell, name] = Fraction(best - values[name], best - worst)
    return found


CRITICAL = critical_values()


def test_the_values_are_those_that_the_paper_prints():
    by_name = dict(zip(STEPS, TABLE[state_of(2, 6)], strict=True))
    assert by_name == {"up": 92, "right": 94, "down": -13, "left": 92}
    by_name = dict(zip(STEPS, TABLE[state_of(1, 6)], strict=True))
    assert by_name == {"up": 91, "right": 93, "down": 93, "left": 91}


def test_a_walker_acts_everywhere_but_on_the_cliff_and_the_goal():
    assert set(positions()) == DISTANCE.keys() - {GOAL}
    assert len(positions()) == 48 - 10 - 1


def test_critical_thresholds_are_those_of_distances_counted_anew():
    names = list(STEPS)
    found = {(m.row, m.column, names[m.action]): m.critical for m in MOVES}
    assert found == pytest.approx({move: float(share) for move, share in CRITICAL.items()})


def test_beside_the_cliff_backwards_needs_the_papers_threshold():
    # The paper's own example: (94 - 92) / (94 + 13).
    assert CRITICAL[2, 6, "up"] == CRITICAL[2, 6, "left"] == Fraction(2, 107)
    for action in (0, 3):
        state = state_of(2, 6)
        assert overridden(TABLE, 2 / 107 - 1e-9)[state, action]
        assert not overridden(TABLE, 2 / 107 + 1e-9)[state, action]
    assert round(2 / 107, 4) == 0.0187


@pytest.mark.parametrize("alpha", [0.0, 0.0187, 0.5, 0.999999])
def test_one_row_up_every_threshold_below_1_overrides_every_detour(alpha):
    assert overridden(TABLE, alpha)[state_of(1, 6)].tolist() == [True, False, False, True]


def test_no_move_is_overridden_at_threshold_1():
    assert not overridden(TABLE, 1.0).any()
    assert not overridden(TABLE, 1.0, second=True).any()


@pytest.mark.parametrize("alpha", [0.0, 0.01, 0.0185, 0.0187, 0.0197, 0.3, 0.499, 0.5, 0.9, 1.0])
def test_the_rule_overrides_exactly_the_moves_below_their_critical_value(alpha):
    decided = overridden(TABLE, alpha)
    found = {
        (row, column, name)
        for row, column in positions()
        for action, name in enumerate(STEPS)
        if decided[state_of(row, column), action]
    }
    # 1e-9 apart, no threshold of this test is in doubt by rounding.
    assert found == {move for move, share in CRITICAL.items() if alpha < float(share) - 1e-9}


def test_second_best_overrides_leave_the_second_best_alone():
    decided = overridden(TABLE, 0.0, second=True)
    # At (2, 6) up and left are second best; at (1, 6) they are worst and second best at once.
    assert decided[state_of(2, 6)].tolist() == [False, False, True, False]
    assert not decided[state_of(1, 6)].any()


def test_there_are_13_thresholds_at_which_the_behaviour_changes():
    beside = [Fraction(2, 101 + column) for column in range(1, 11)]
    expected = sorted([Fraction(1), Fraction(1, 2), *beside, Fraction(1, 100)], reverse=True)
    assert sorted(set(CRITICAL.values()), reverse=True) == expected
    assert len(expected) == 13
    found = distinct_thresholds(MOVES)
    assert found == sorted(found, reverse=True)
    assert found == pytest.approx([float(share) for share in expected])


def test_the_papers_thresholds_stand_between_the_critical_ones():
    # A move is overridden below its critical value: alpha < critical.
    between = [
        sum(low < share <= high for share in distinct_thresholds(MOVES))
        for high, low in pairwise(PAPER)
    ]
    # One in each gap, but for none within (0.0197, 0.1] and the two smallest below 0.0181.
    assert between == [1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2]


def test_the_papers_thresholds_give_13_behaviours_or_two():
    assert distinct_behaviours(TABLE, PAPER, second=False) == 13
    assert distinct_behaviours(TABLE, PAPER, second=True) == 2
    assert distinct_behaviours(TABLE, [0.1, 0.0197], second=False) == 1
    assert distinct_behaviours(TABLE, PAPER[1:], second=True) == 1


def test_kinds_tell_falls_from_moves_beside_the_cliff_from_the_rest():
    names = list(STEPS)
    for move in MOVES:
        cell = (move.row, move.column)
        falls = after(cell, STEPS[names[move.action]]) in CLIFF
        beside = cell == START or after(cell, STEPS["down"]) in CLIFF
        assert (move, move.kind) == (move, 0 if falls else 1 if beside else 2)


def test_the_kinds_have_as_many_moves_as_one_counts():
    # Falls: from ten cells above the cliff and the start. Beside it: two more from each of these.
    # The rest: two from 22 cells of the upper rows, three from (2, 0) and in the last column.
    counted = [sum(move.kind == kind for move in MOVES) for kind in range(len(KINDS))]
    assert counted == [11, 11 * 2, 22 * 2 + 4 * 3]


def test_shares_count_the_moves_of_a_kind():
    alphas = np.array([0.0, 0.005, 0.0185, 0.019, 0.3, 0.7, 0.9999])
    for kind in range(len(KINDS)):
        own = [critical_of(move) for move in MOVES if move.kind == kind]
        expected = [sum(alpha < share for share in own) / len(own) for alpha in alphas]
        assert overridden_share(MOVES, kind, alphas) == pytest.approx(expected)
        assert overridden_share(MOVES, kind, np.array([1.0])) == 0


def critical_of(move):
    return CRITICAL[move.row, move.column, list(STEPS)[move.action]]


def test_the_story_tells_the_two_cells_and_the_behaviours():
    story = summarise_thresholds(TABLE, PAPER)
    found = {(row, column, name): rest for row, column, name, *rest in story.examples}
    assert found == {
        (1, 6, "up"): [91, 93, 1.0],
        (1, 6, "left"): [91, 93, 1.0],
        (2, 6, "up"): [92, 94, pytest.approx(2 / 107)],
        (2, 6, "down"): [-13, 94, 1.0],
        (2, 6, "left"): [92, 94, pytest.approx(2 / 107)],
    }
    assert (story.alphas, story.behaviours_best, story.behaviours_second) == (PAPER, 13, 2)
    assert story.thresholds == distinct_thresholds(MOVES)
