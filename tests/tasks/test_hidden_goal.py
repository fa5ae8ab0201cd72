"""The task whose goal only the learner knows."""

import dataclasses

import numpy as np
import pytest

from qbumpers import solve
from qbumpers.tasks.displays.hidden_goal import MAP
from qbumpers.tasks.drawing import picture
from qbumpers.tasks.hidden_goal import hidden_goal

START, GOALS = (4, 3), (0, 3, 6)


def test_it_is_worth_30_less_the_way_to_each_goal():
    task = hidden_goal()
    table = solve(dataclasses.replace(task, seen=None)).table
    ways = [7, 6, 7]  # in rows and columns; the one straight up makes way for a pit
    for goal, way in enumerate(ways):
        assert table[(4 * 7 + 3) * 3 + goal].max() == 30 - way
    assert task.start[(4 * 7 + 3) * 3 : (4 * 7 + 3) * 3 + 3] == pytest.approx([1 / 3] * 3)


def test_pits_and_other_goals_crash_and_the_goal_stays_the_same():
    task = hidden_goal()
    for cell in range(len(MAP) * len(MAP[0])):
        for goal in range(3):
            state = cell * 3 + goal
            assert (task.next_state[state] % 3 == goal).all()
    above_the_pit = (1 * 7 + 1) * 3
    assert task.reward[above_the_pit, 2, 0] == -20
    assert task.next_state[above_the_pit, 2, 0] == (4 * 7 + 3) * 3
    below = (1 * 7 + 3) * 3
    assert task.crash is not None
    assert task.success is not None
    for goal in range(3):
        assert task.terminated[below + goal, 0, 0]
        assert task.reward[below + goal, 0, 0] == (29 if goal == 1 else -20)
        assert task.success[below + goal, 0, 0] == (goal == 1)
        assert task.crash[below + goal, 0, 0] == (goal != 1)


def test_the_learner_is_shown_its_goal():
    display = hidden_goal().display
    pictures = [picture(display, state) for state in range(3)]
    assert not np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[1], pictures[2])
