"""FrozenLake and Taxi by names of this package, held to the steps of Gymnasium's environments."""

from collections import Counter
from typing import Any

import gymnasium
import numpy as np
import pytest

from qbumpers.tasks import make_task
from qbumpers.values import solve
from tests.narrowing import present
from tests.tasks.examples import outcomes

NAMES = {"frozen-lake": "FrozenLake-v1", "frozen-lake-8x8": "FrozenLake8x8-v1", "taxi": "Taxi-v4"}


@pytest.mark.parametrize("name", NAMES)
def test_its_steps_are_those_of_gymnasium(name):
    """Three thousand steps: each is one that the task gives some probability."""
    task: Any = make_task(name)
    environment: Any = gymnasium.make(NAMES[name])
    assert task.episode_limit == environment.spec.max_episode_steps
    environment.action_space.seed(1)
    state, _ = environment.reset(seed=1)
    firsts = {int(state)}
    for _ in range(3000):
        action = int(environment.action_space.sample())
        following, reward, terminated, truncated, _ = environment.step(action)
        outcome = (int(following), float(reward), bool(terminated))
        assert outcomes(task, int(state), action)[outcome] > 0
        state = following
        if terminated or truncated:
            state, _ = environment.reset()
            firsts.add(int(state))
    assert firsts <= set(np.flatnonzero(task.start).tolist())


def test_a_lake_slips_to_either_side_a_third_of_the_time_each():
    environment: Any = gymnasium.make("FrozenLake-v1").unwrapped
    environment.reset(seed=3)
    found: Counter = Counter()
    for _ in range(3000):
        environment.s = 9  # a hole is above to the left and below to the left
        found[int(environment.step(1)[0])] += 1
    expected = outcomes(make_task("frozen-lake"), 9, 1)  # type: ignore[arg-type]
    assert len(expected) == 3
    for (to, _, _), probability in expected.items():
        assert found[to] / 3000 == pytest.approx(probability, abs=0.04)  # 4.6 standard errors


def values_of(table: Any, states: int, discount: float) -> np.ndarray:
    """V* by value iteration over Gymnasium's own table, in plain Python."""
    values = np.zeros(states)
    while True:
        before = values.copy()
        for state in range(states):
            values[state] = max(
                sum(p * (r + discount * (0 if end else values[to])) for p, to, r, end in rows)
                for rows in table[state].values()
            )
        if np.abs(values - before).max() < 1e-12:
            return values


@pytest.mark.parametrize(("name", "discount"), [("frozen-lake", 0.99), ("taxi", 1.0)])
def test_its_values_are_those_of_a_second_value_iteration(name, discount):
    table = gymnasium.make(NAMES[name]).unwrapped.P  # type: ignore[attr-defined]
    task = make_task(name)
    starts = np.flatnonzero(task.start)
    expected = values_of(table, task.states, discount)
    assert solve(task).table.max(axis=1)[starts] == pytest.approx(expected[starts], abs=1e-7)


def test_their_events_are_those_that_can_happen():
    lake: Any = make_task("frozen-lake")
    holes, goal = {5, 7, 11, 12}, 15
    walked = [state for state in range(16) if state not in {*holes, goal}]
    assert set(lake.next_state[walked][lake.crash[walked]].tolist()) == holes
    assert set(lake.next_state[walked][lake.success[walked]].tolist()) == {goal}
    taxi: Any = make_task("taxi")
    assert taxi.events == {"success"}
    assert set(taxi.reward[present(taxi.success)].tolist()) == {20.0}


@pytest.mark.parametrize("name", NAMES)
def test_its_numbers_are_fixed(name):
    with pytest.raises(ValueError, match=f"'{name}' takes no arguments"):
        make_task(name, discount=0.5)
    assert make_task(name).name == name


def test_they_are_shown_as_gymnasiums():
    assert make_task("frozen-lake").display.actions == ("left", "down", "right", "up")
    assert make_task("taxi").display.actions[4:] == ("pick up", "drop off")
