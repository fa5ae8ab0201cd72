"""Exact probabilities of crashes and success against plain loops, closed forms and Q* itself."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers import RequestError, solve
from qbumpers.tasks import TabularTask, cliff_walking, make_task
from qbumpers.tasks.cliff_walking import is_cliff, state_of
from qbumpers.values import load_values

UP, RIGHT, DOWN, LEFT = range(4)


def plain_row(task, event, first):
    """The probability of no crash (first = 1) or of success (first = 0), by loops."""
    table = np.full((task.states, task.actions), float(first))
    for _ in range(3000):
        previous = table.max(axis=1)
        table = np.zeros_like(table)
        for s, a, k in np.ndindex(task.next_state.shape):
            if event[s, a, k]:
                worth = 1 - first
            elif task.terminated[s, a, k]:
                worth = first
            else:
                worth = previous[task.next_state[s, a, k]]
            table[s, a] += task.probability[s, a, k] * worth
        if np.abs(table.max(axis=1) - previous).max() < 1e-14:
            return table
    raise AssertionError("the loops did not converge")


@st.composite
def tasks_with_events(draw):
    """Four states, two actions, two outcomes each, of which some end, crash or succeed."""
    generator = np.random.default_rng(draw(st.integers(0, 10_000)))
    shape = (4, 2, 2)
    chance = draw(st.sampled_from([0.5, 0.25, 1.0]))
    crash, success = generator.random((2, *shape)) < 0.2
    return TabularTask(
        name="eventful", next_state=generator.integers(0, 4, shape),
        probability=np.broadcast_to([chance, 1 - chance], shape), reward=np.zeros(shape),
        terminated=generator.random(shape) < 0.3, start=np.eye(4)[0], discount=0.9,
        episode_limit=9, crash=crash & ~success, success=success,
    )  # fmt: skip


@settings(max_examples=40)
@given(tasks_with_events())
def test_probabilities_are_those_of_plain_loops(task):
    others = solve(task, others=("success", "safety")).others
    for name, event, first in (("safety", task.crash, 1), ("success", task.success, 0)):
        np.testing.assert_allclose(
            others[name].table, plain_row(task, event, first), rtol=0, atol=2e-9, err_msg=name
        )


def test_on_cliff_walking_only_steps_off_the_cliff_are_unsafe():
    table = solve(cliff_walking(), others=("safety",)).others["safety"].table
    beside = [state_of(2, column) for column in range(1, 11)]
    falls = {(state, DOWN) for state in beside} | {(state_of(3, 0), RIGHT)}
    stood_on = {s for s in range(48) if is_cliff(*divmod(s, 12))}
    found = {(s, a) for s, a in np.argwhere(table == 0).tolist() if s not in stood_on}
    assert found - {(state_of(3, 11), LEFT)} == falls
    assert set(np.unique(table)) == {0.0, 1.0}


def test_the_lake_is_crossed_with_probability_14_17_as_its_undiscounted_values_say():
    lake = make_task("FrozenLake-v1", discount=1.0, is_slippery=True)
    values = solve(lake, others=("success", "safety"))
    assert values.others["success"](0).max() == pytest.approx(14 / 17, abs=1e-9)
    np.testing.assert_allclose(values.others["success"].table, values.table, rtol=0, atol=2e-9)
    # In the first cell one can walk against the walls for ever.
    assert values.others["safety"](0).max() == 1.0
    assert list(values.others) == ["success", "safety"]


def test_a_task_that_announces_no_such_event_is_refused():
    task = TabularTask.from_arrays(
        np.ones((1, 1, 1)), [[0.0]], [False], 0, discount=0.5, episode_limit=3, name="still"
    )
    with pytest.raises(RequestError, match="task still announces no success"):
        solve(task, others=("success",))


def test_unknown_rows_are_named_with_the_nearest():
    with pytest.raises(RequestError, match=r"'safty'.*did you mean 'safety'"):
        solve(cliff_walking(), others=("safty",))


def test_they_are_kept_with_the_values(tmp_path):
    values = solve(cliff_walking(), others=("safety",))
    values.save(tmp_path / "values.npz")
    again: Any = load_values(tmp_path / "values.npz")
    assert np.array_equal(again.others["safety"].table, values.others["safety"].table)
    assert again.digest() == values.digest() != solve(cliff_walking()).digest()
