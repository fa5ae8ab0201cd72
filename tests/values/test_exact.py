"""Exact values against the published figures, closed forms and a plain value iteration."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers import RequestError, solve
from qbumpers.tasks import TabularTask, cliff_walking, make_task
from tests.tasks.examples import chain, outcomes, random_task, random_tasks

UP, RIGHT, DOWN, LEFT = range(4)


def plain_value_iteration(task: TabularTask, discount: float) -> np.ndarray:
    """Q* [S, A] by loops over states, actions and outcomes."""
    table = np.zeros((task.states, task.actions))
    for _ in range(2000):
        previous = table.copy()
        for s, a in np.ndindex(table.shape):
            table[s, a] = sum(
                p * (reward + (0.0 if ends else discount * previous[to].max()))
                for (to, reward, ends), p in outcomes(task, s, a).items()
            )
        if np.abs(table - previous).max() < 1e-13:
            return table
    raise AssertionError("value iteration did not converge")


def small(transition, reward, terminal, **changes) -> TabularTask:
    arguments = {"start": 0, "discount": 1.0, "episode_limit": 10, "name": "small", **changes}
    return TabularTask.from_arrays(np.array(transition, float), reward, terminal, **arguments)


def test_cliff_walking_has_the_published_values():
    values = solve(cliff_walking())
    assert values(2 * 12 + 6).tolist() == [92, 94, -13, 92]
    assert values(1 * 12 + 6).tolist() == [91, 93, 93, 91]
    assert values(3 * 12).max() == 87


def test_cliff_walking_is_worth_100_less_the_way_to_the_goal():
    values = solve(cliff_walking())
    for row, column in np.ndindex(3, 12):
        steps = (3 - row) + (11 - column)
        assert values(12 * row + column).max() == 100 - steps


def test_the_undiscounted_lake_is_reached_with_probability_14_17():
    values = solve(make_task("FrozenLake-v1", discount=1.0, is_slippery=True))
    assert values(0).max() == pytest.approx(14 / 17, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(random_tasks, st.sampled_from([0.3, 0.9]))
def test_discounted_values_are_those_of_value_iteration(task, discount):
    expected = plain_value_iteration(task, discount)
    np.testing.assert_allclose(solve(task, discount).table, expected, rtol=0, atol=2e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.integers(1, 4))
def test_undiscounted_values_are_those_of_value_iteration(seed, states, actions):
    task = random_task(seed, states, actions, discount=1.0, ending=0.2)
    expected = plain_value_iteration(task, 1.0)
    np.testing.assert_allclose(solve(task).table, expected, rtol=0, atol=2e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.9, 1.0]))
def test_equally_good_actions_have_equal_values(seed, discount):
    # A copy of each action with its outcomes in another order differs by round-off alone.
    task = random_task(seed, 5, 2, discount=discount, ending=0.1)
    doubled = {
        field: np.concatenate([array, array[:, :, ::-1]], axis=1)
        for field in ("next_state", "probability", "reward", "terminated")
        for array in [getattr(task, field)]
    }
    table = solve(dataclasses.replace(task, **doubled)).table
    assert (table[:, :2] == table[:, 2:]).all()


def test_ties_hold_that_round_off_would_break():
    # 0.1 + 0.2 is not 0.3 in floating point; both ways are worth the same.
    task = small(
        [[[0, 1, 0], [0, 0, 1]], [[0, 0, 1]] * 2, [[0, 0, 1]] * 2],
        np.array([[0.1, 0.3], [0.2, 0.2], [0, 0]]),
        [False, False, True],
    )
    values = solve(task)
    assert values(0)[0] == values(0)[1] == 0.3


def test_no_value_is_a_negative_zero():
    task = small([[[0, 1]], [[0, 1]]], np.array([[-1e-12], [0]]), [False, True])
    assert not np.signbit(solve(task).table).any()


@pytest.mark.parametrize("discount", [0.5, 0.99, 1.0])
def test_a_chain_is_worth_its_discounted_rewards(discount):
    table = solve(chain(6, -1.0, 10.0, discount)).table
    for state in range(6):
        steps = 5 - state
        lost = sum(discount**i for i in range(steps))
        assert table[state, 0] == pytest.approx(10 * discount**steps - lost, abs=1e-9)


def test_a_loop_is_worth_a_geometric_series():
    task = small([[[1]]], np.array([[3.0]]), [False], discount=0.75)
    assert solve(task).table.tolist() == [[12.0]]


@pytest.mark.parametrize("forwards", [0.5, 0.4])
def test_a_gambler_wins_with_the_classical_probability(forwards):
    # Purses 0 and 5 end the game; with r = (1 - p) / p, P(win | i) = (1 - r^i) / (1 - r^5).
    transition = np.zeros((6, 1, 6))
    for purse in range(1, 5):
        transition[purse, 0, [purse - 1, purse + 1]] = 1 - forwards, forwards
    transition[[0, 5], 0, [0, 5]] = 1
    reward = np.zeros((6, 1, 6))
    reward[4, 0, 5] = 1
    task = small(transition, reward, [True, *[False] * 4, True], start=2)
    ratio = (1 - forwards) / forwards
    table = solve(task).table
    for purse in range(1, 5):
        fair = forwards == 0.5
        expected = purse / 5 if fair else (1 - ratio**purse) / (1 - ratio**5)
        assert table[purse, 0] == pytest.approx(expected, abs=2e-9)


def test_values_are_exact_where_episodes_end_slowly():
    # Waiting costs 1 and ends with probability 0.01: worth -99, exactly as giving up at once.
    transition = [[[0.99, 0.01], [0, 1]], [[0, 1], [0, 1]]]
    reward = np.array([[[-1.0, 0], [0, -99]], [[0, 0], [0, 0]]])
    values = solve(small(transition, reward, [False, True]))
    assert values(0).tolist() == [-99.0, -99.0]


def test_a_pointless_loop_without_reward_does_no_harm():
    task = small([[[1, 0], [0, 1]], [[0, 1]] * 2], np.array([[0, 1.0], [0, 0]]), [False, True])
    assert solve(task)(0).tolist() == [1.0, 1.0]


def test_the_step_limit_plays_no_part():
    task = cliff_walking()
    short = dataclasses.replace(task, episode_limit=1)
    assert (solve(short).table == solve(task).table).all()


def test_another_discount_may_be_asked_for():
    task = chain(3, 0.0, 1.0, 1.0)
    values = solve(task, discount=0.5)
    assert values.discount == 0.5
    assert values.table[:3, 0].tolist() == [0.25, 0.5, 1.0]
    assert solve(task).discount == 1.0


@pytest.mark.parametrize("discount", [0, 1.5, -0.1, float("nan")])
def test_a_discount_out_of_range_is_refused(discount):
    with pytest.raises(RequestError, match=f"discount = {discount}; it must lie in"):
        solve(cliff_walking(), discount=discount)


def test_an_undiscounted_trap_is_refused_by_its_state():
    # From state 0 one may end (2) or step into state 1, which nothing leaves.
    transition = [[[0, 0, 1], [0, 1, 0]], [[0, 1, 0]] * 2, [[0, 0, 1]] * 2]
    task = small(transition, np.zeros((3, 2)), [False, False, True])
    with pytest.raises(RequestError, match="task small: from state 1 no policy ends the episode"):
        solve(task)
    assert solve(task, discount=0.9).table.shape == (3, 2)


def test_an_end_that_is_only_likely_is_refused():
    # State 0's one action may end the episode or fall into the trap at state 1.
    transition = [[[0, 0.5, 0.5]], [[0, 1, 0]], [[0, 0, 1]]]
    with pytest.raises(RequestError, match="from state 0 no policy ends"):
        solve(small(transition, np.zeros((3, 1)), [False, False, True]))


def test_a_trap_that_no_episode_reaches_is_worth_nothing():
    transition = [[[0, 0, 1]], [[0, 1, 0]], [[0, 0, 1]]]
    task = small(transition, np.array([[5.0], [-1.0], [0.0]]), [False, False, True])
    assert solve(task).table.tolist() == [[5.0], [0.0], [0.0]]


def test_reward_that_can_be_collected_for_ever_is_refused():
    task = small([[[1, 0], [0, 1]], [[0, 1]] * 2], np.array([[1.0, 0], [0, 0]]), [False, True])
    with pytest.raises(RequestError, match=r"task small: .*reward can be collected for ever"):
        solve(task)


def test_the_values_say_where_they_come_from():
    values = solve(cliff_walking())
    assert (values.task, values.method) == ("cliff-walking", "exact dynamic programming")
