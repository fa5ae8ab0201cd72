import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.learners import QLearner, Schedule
from qbumpers.learners.epsilon_greedy import epsilon_greedy, greedy
from qbumpers.learners.q_learning import q_update
from qbumpers.learners.schedules import scheduled

unit = st.floats(0, 1)
chances = st.floats(0, 1, exclude_max=True)
amounts = st.floats(-1e3, 1e3)
rows = st.lists(st.integers(-3, 3).map(float), min_size=1, max_size=5).map(np.array)


@given(unit, unit, unit, st.integers(1, 200), st.data())
def test_a_schedule_falls_on_a_line_and_then_stays(start, end, fraction, episodes, data):
    episode = data.draw(st.integers(0, episodes - 1))
    decay = int(fraction * episodes)
    expected = np.interp(episode, [0, decay], [start, end]) if decay else end
    found = scheduled(Schedule(start, end, fraction), episode, episodes)
    assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("fraction", [0.0, 0.009])
def test_a_schedule_without_a_whole_episode_of_decay_is_at_its_end_at_once(fraction):
    assert scheduled(Schedule(1.0, 0.25, fraction), 0, 100) == 0.25


def test_the_papers_schedule_decays_over_nine_tenths_of_the_episodes():
    found = [scheduled(QLearner().epsilon, episode, 100) for episode in range(100)]
    expected = [1 - 0.98 * min(episode / 90, 1) for episode in range(100)]
    assert found == pytest.approx(expected, abs=1e-12)
    assert QLearner().epsilon == QLearner().learning_rate


def test_the_papers_learner_is_undiscounted_and_starts_at_zero():
    assert (QLearner().discount, QLearner().initial_value) == (1.0, 0.0)


@given(rows, chances, chances)
def test_greedy_choice_is_a_best_action(row, coin, tie):
    assert row[greedy(row, tie)] == row.max()
    assert epsilon_greedy(row, 0.0, coin, tie) == greedy(row, tie)


@given(rows, chances, unit, chances)
def test_exploration_happens_where_the_coin_falls_below_epsilon(row, coin, epsilon, tie):
    expected = int(tie * len(row)) if coin < epsilon else greedy(row, tie)
    assert epsilon_greedy(row, epsilon, coin, tie) == expected


@pytest.mark.parametrize("actions", [1, 2, 3, 4, 7])
def test_exploration_spreads_over_all_actions_evenly(actions):
    ties = (np.arange(5 * actions) + 0.5) / (5 * actions)
    chosen = [epsilon_greedy(np.arange(float(actions)), 1.0, 0.5, tie) for tie in ties]
    assert chosen == np.repeat(np.arange(actions), 5).tolist()


@given(amounts, amounts, amounts, unit)
def test_the_update_moves_by_the_rate_towards_the_target(old, reward, next_value, rate):
    expected = (1 - rate) * old + rate * (reward + next_value)
    assert q_update(old, reward, next_value, rate) == pytest.approx(expected, abs=1e-9)


@given(amounts, amounts, st.floats(0.05, 1), st.integers(1, 50))
def test_repeated_updates_close_the_gap_geometrically(old, target, rate, updates):
    value = old
    for _ in range(updates):
        value = q_update(value, target, 0.0, rate)
    assert value == pytest.approx(target + (1 - rate) ** updates * (old - target), abs=1e-9)
