"""Tabular tasks from arrays and tables: their meaning, what is refused, what the digest covers."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, solve
from qbumpers.tasks import TabularTask
from tests.narrowing import present
from tests.tasks.examples import outcomes, random_task

TRANSITION = np.array([[[0.25, 0.75], [0.0, 1.0]], [[1.0, 0.0], [0.5, 0.5]]])
REWARD = np.array([[1.0, 2.0], [3.0, 4.0]])
TABLE = {
    0: {0: [(0.25, 0, 1.0, False), (0.75, 1, 5.0, True)], 1: [(1.0, 1, 0.0, True)]},
    1: {0: [(1.0, 0, -1.0, False)], 1: [(1.0, 1, 0.0, True)]},
}


def from_arrays(**changes) -> TabularTask:
    arguments = {
        "transition": TRANSITION,
        "reward": REWARD,
        "terminal": [False, True],
        "start": 0,
        "discount": 0.9,
        "episode_limit": 10,
        "name": "two",
    }
    return TabularTask.from_arrays(**{**arguments, **changes})


def from_table(table=TABLE, **changes) -> TabularTask:
    arguments = {"start": np.array([1.0, 0.0]), "discount": 0.9, "episode_limit": 10}
    return TabularTask.from_table(table, **{**arguments, **changes})


@given(
    st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 3), st.booleans(), st.booleans()
)
def test_arrays_mean_what_they_say(seed, states, actions, by_next_state, spread):
    generator = np.random.default_rng(seed)
    weight = generator.random((states, actions, states))
    weight *= generator.random(weight.shape) < (1.0 if spread else 0.4)
    weight[:, :, 0] += 0.1
    transition = weight / weight.sum(axis=2, keepdims=True)
    reward = generator.normal(size=transition.shape if by_next_state else transition.shape[:2])
    terminal = generator.random(states) < 0.5
    task = from_arrays(transition=transition, reward=reward, terminal=terminal)
    assert (task.states, task.actions) == (states, actions)
    for s, a in np.ndindex(states, actions):
        assert outcomes(task, s, a) == {
            (to, reward[s, a, to] if by_next_state else reward[s, a], bool(terminal[to])): p
            for to, p in enumerate(transition[s, a].tolist())
            if p > 0
        }


def test_flags_of_states_mark_the_outcomes_that_enter_them():
    task = from_arrays(success=[False, True], crash=[True, False])
    possible = task.probability > 0
    assert (present(task.success)[possible] == (task.next_state == 1)[possible]).all()
    assert (present(task.crash)[possible] == (task.next_state == 0)[possible]).all()
    assert from_arrays().success is None
    assert from_arrays().crash is None


def test_a_start_is_a_state_or_a_distribution():
    assert from_arrays(start=1).start.tolist() == [0.0, 1.0]
    assert from_arrays(start=[0.25, 0.75]).start.tolist() == [0.25, 0.75]


def test_tables_mean_what_they_say():
    task = from_table()
    for state, actions in TABLE.items():
        for action, rows in actions.items():
            expected = {(to, reward, ends): p for p, to, reward, ends in rows}
            assert outcomes(task, state, action) == expected


def test_endings_that_pay_are_successes_and_the_others_crashes():
    task = from_table()
    success, crash = present(task.success), present(task.crash)
    assert success[0, 0].tolist() == [False, True]
    assert crash[0, 0].tolist() == [False, False]
    assert crash[0, 1].tolist() == [True, False]
    assert success[1, 0].tolist() == crash[1, 0].tolist() == [False, False]


def test_success_is_unknown_where_no_ending_pays():
    task = from_table({0: {0: [(0.5, 0, 9.0, False), (0.5, 0, -1.0, True)]}}, start=[1.0])
    assert task.success is None
    assert task.crash is None


def test_given_judges_decide_alone():
    seen = set()

    def judge(state, action, to, reward, terminated):
        seen.add((state, action, to, reward, terminated))
        return reward == -1.0

    task = from_table(crash=judge)
    assert task.success is None
    assert np.argwhere(present(task.crash)).tolist() == [[1, 0, 0]]
    assert seen == {
        (s, a, to, reward, ends)
        for s, actions in TABLE.items()
        for a, rows in actions.items()
        for _, to, reward, ends in rows
    }


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"transition": TRANSITION[0]}, r"transition has shape \(2, 2\)"),
        ({"transition": TRANSITION[:, :, :1]}, r"transition has shape \(2, 2, 1\)"),
        (
            {"transition": TRANSITION * [[[1], [1]], [[1], [0.9]]]},
            r"\(state, action\) = \(1, 1\) sums to 0\.9;",
        ),
        ({"transition": TRANSITION - [1, -1]}, "transition holds a number that is no probability"),
        ({"transition": TRANSITION * np.nan}, "transition holds a number that is no probability"),
        ({"reward": REWARD[0]}, r"reward has shape \(2,\)"),
        ({"reward": REWARD * np.inf}, "task two: reward holds a number that is not finite"),
        ({"reward": REWARD * np.nan}, "task two: reward holds a number that is not finite"),
        ({"terminal": [False]}, r"terminal has shape \(1,\)"),
        ({"success": [False] * 3}, r"success has shape \(3,\)"),
        ({"crash": [[False, True]]}, r"crash has shape \(1, 2\)"),
        ({"start": 2}, r"start = 2; it must lie in \[0, 2\)"),
        ({"start": -1}, r"start = -1; it must lie in \[0, 2\)"),
        ({"start": [1.0]}, r"task two: start has shape \(1,\)"),
        ({"start": [0.5, 0.4]}, r"task two: start sums to 0\.9"),
        ({"discount": 0}, "task two: discount = 0;"),
        ({"discount": 1.1}, r"task two: discount = 1\.1;"),
        ({"discount": float("nan")}, "task two: discount = nan;"),
        ({"episode_limit": 0}, "task two: episode_limit = 0;"),
        ({"grid": (2, 2)}, r"task two: grid \(2, 2\) does not hold 2 states"),
    ],
)
def test_wrong_arrays_are_refused_by_name(changes, message):
    with pytest.raises(RequestError, match=message):
        from_arrays(**changes)


def test_a_wrong_row_of_a_table_is_refused_with_its_state_and_action():
    table = {**TABLE, 1: {0: [(0.5, 0, 0.0, False)], 1: TABLE[1][1]}}
    with pytest.raises(RequestError, match=r"\(state, action\) = \(1, 0\) sums to 0\.5"):
        from_table(table)


@pytest.mark.parametrize("table", [{}, {**TABLE, 1: {0: TABLE[1][0]}}, {0: TABLE[0], 5: TABLE[1]}])
def test_a_table_with_gaps_is_refused(table):
    with pytest.raises(RequestError, match=r"table\b.*states 0, 1, .* actions"):
        from_table(table)


@pytest.mark.parametrize("state", [-1, 2])
def test_a_next_state_that_does_not_exist_is_refused(state):
    table = {**TABLE, 1: {0: [(1.0, state, 0.0, False)], 1: TABLE[1][1]}}
    with pytest.raises(RequestError, match=r"next_state must lie in \[0, 2\)"):
        from_table(table)


@pytest.mark.parametrize("field", ["probability", "reward", "terminated", "success", "crash"])
def test_fields_of_different_shapes_are_refused(field):
    task = random_task(0, 3, 2)
    with pytest.raises(RequestError, match=rf"{field} has shape \(3, 2\)"):
        dataclasses.replace(task, **{field: np.zeros((3, 2))})


def test_a_next_state_without_outcomes_is_refused():
    with pytest.raises(RequestError, match=r"next_state has shape \(3, 2\); \[S, A, K\]"):
        dataclasses.replace(random_task(0, 3, 2), next_state=np.zeros((3, 2), int))


def test_the_digest_is_that_of_the_behaviour():
    assert from_arrays().digest() == from_arrays(name="other").digest()
    repeated = np.repeat(REWARD[:, :, None], 2, axis=2)
    assert from_arrays().digest() == from_arrays(reward=repeated).digest()


@pytest.mark.parametrize(
    "changes",
    [
        {"transition": TRANSITION[:, ::-1]},
        {
            "transition": TRANSITION * [[[0.8], [1]], [[1], [1]]]
            + [[[0, 0.2], [0, 0]], [[0, 0]] * 2]
        },
        {"reward": [[1.0, 2.0], [3.0, 4.0 + 1e-9]]},
        {"terminal": [False, False]},
        {"start": 1},
        {"start": [0.5, 0.5]},
        {"discount": 0.8},
        {"episode_limit": 11},
        {"success": [False, True]},
        {"crash": [False, True]},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_the_digest_changes_with_the_behaviour(changes):
    assert from_arrays(**changes).digest() != from_arrays().digest()


def test_success_and_crash_have_different_digests():
    flags = [False, True]
    assert from_arrays(success=flags).digest() != from_arrays(crash=flags).digest()


@pytest.mark.parametrize("states", [3, 7, 100])
def test_probabilities_rounded_to_float32_are_those_that_were_meant(states):
    generator = np.random.default_rng(states)
    exact = generator.dirichlet(np.ones(states), (states, 2))
    rounded = exact.astype(np.float32)
    assert (rounded.sum(axis=2, dtype=np.float64) != 1).any()
    reward = generator.normal(size=(states, 2))
    terminal = np.arange(states) == states - 1
    made = [
        TabularTask.from_arrays(each, reward, terminal, 0, discount=0.99, episode_limit=10)
        for each in (exact, rounded)
    ]
    np.testing.assert_allclose(made[1].probability.sum(axis=2), 1, rtol=1e-12)
    values = [np.array([solve(task)(state) for state in range(states)]) for task in made]
    np.testing.assert_allclose(values[1], values[0], atol=1e-4)


def test_a_sum_is_shown_with_all_its_digits():
    transition = np.array([[[0.999998, 0.0], [1.0, 0.0]], [[0.0, 1.0], [0.0, 1.0]]])
    with pytest.raises(RequestError, match=r"sums to 0\.999998; it must sum to 1"):
        from_arrays(transition=transition)


def test_a_fraction_is_no_next_state_of_a_table():
    table = {**TABLE, 1: {**TABLE[1], 0: [(1.0, 0.5, 0.0, False)]}}
    with pytest.raises(RequestError, match=r"table\[1\]\[0\]: next state = 0\.5; a whole number"):
        from_table(table)


def test_fractions_are_no_next_states():
    task = random_task(0, 3, 2)
    with pytest.raises(RequestError, match="next_state holds float64; whole numbers are needed"):
        dataclasses.replace(task, next_state=task.next_state + 0.5)


@pytest.mark.parametrize("field", ["terminated", "success", "crash"])
def test_a_half_truth_is_refused(field):
    task = random_task(0, 3, 2)
    with pytest.raises(RequestError, match=f"{field} must hold nothing but true and false"):
        dataclasses.replace(task, **{field: np.full(task.next_state.shape, 0.5)})
