"""A tabular task as an environment: how often it does what, and what it reports."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from qbumpers import RequestError
from qbumpers.tasks import TabularEnvironment, TabularTask, make_task
from tests.narrowing import of_kind
from tests.tasks.examples import outcomes, random_task


def test_it_passes_gymnasiums_checks():
    check_env(TabularEnvironment(random_task(1, 5, 3)), skip_render_check=True)


def test_spaces_are_as_large_as_the_task():
    environment = TabularEnvironment(random_task(1, 5, 3))
    assert environment.observation_space == gymnasium.spaces.Discrete(5)
    assert environment.action_space == gymnasium.spaces.Discrete(3)


def test_outcomes_are_as_frequent_as_their_probabilities():
    task = of_kind(TabularTask, make_task("FrozenLake-v1", discount=0.99, is_slippery=True))
    environment = TabularEnvironment(task)
    actions = np.random.default_rng(0).integers(4, size=60_000)
    counts: dict[tuple[int, int], dict[tuple[int, float, bool], int]] = {}
    state, _ = environment.reset(seed=0)
    for action in actions.tolist():
        following, reward, terminated, _, _ = environment.step(action)
        pair = counts.setdefault((state, action), {})
        outcome = (following, reward, terminated)
        pair[outcome] = pair.get(outcome, 0) + 1
        state = environment.reset()[0] if terminated else following
    assert len(counts) == 11 * 4  # the lake has 11 cells to walk on
    for (state, action), seen in counts.items():
        expected = outcomes(task, state, action)
        trials = sum(seen.values())
        assert set(seen) <= set(expected)
        for outcome, p in expected.items():
            # z = 4.5 standard errors of a proportion: about 120 checks, each false alarm 7e-6.
            bound = 4.5 * np.sqrt(p * (1 - p) / trials) + 1e-12
            assert abs(seen.get(outcome, 0) / trials - p) <= bound


def test_episodes_start_as_often_in_each_state_as_the_task_says():
    start = np.array([0.2, 0.0, 0.5, 0.3, 0.0])
    task = TabularTask.from_arrays(
        np.ones((5, 1, 5)) / 5, np.zeros((5, 1)), np.zeros(5), start,
        discount=0.9, episode_limit=10,
    )  # fmt: skip
    environment = TabularEnvironment(task)
    environment.reset(seed=1)
    seen = np.bincount([environment.reset()[0] for _ in range(10_000)], minlength=5)
    bound = 4 * np.sqrt(start * (1 - start) / 10_000)  # z = 4 standard errors
    assert (np.abs(seen / 10_000 - start) <= bound).all()


def test_info_tells_success_and_crash():
    task = make_task("FrozenLake-v1", discount=0.99, is_slippery=False)
    environment = TabularEnvironment(task)
    assert environment.reset(seed=0)[1] == {"success": False, "crash": False}
    down, right = 1, 2
    infos = [environment.step(action)[4] for action in (down, down, right, down, right, right)]
    assert infos[:-1] == [{"success": False, "crash": False}] * 5
    assert infos[-1] == {"success": True, "crash": False}
    environment.reset(seed=0)
    environment.step(right)
    assert environment.step(down)[2:] == (True, False, {"success": False, "crash": True})


def test_a_task_that_knows_no_success_reports_none():
    task = random_task(2, 4, 2)
    assert task.success is None
    environment = TabularEnvironment(task)
    environment.reset(seed=0)
    infos = [environment.step(step % 2)[4] for step in range(50)]
    assert infos == [{"success": False, "crash": False}] * 50


def test_equal_seeds_give_equal_episodes_and_others_do_not():
    def walk(seed: int) -> list[int]:
        environment = TabularEnvironment(random_task(5, 6, 2))
        state, _ = environment.reset(seed=seed)
        return [state, *(environment.step(step % 2)[0] for step in range(40))]

    assert walk(3) == walk(3)
    assert len({tuple(walk(seed)) for seed in range(5)}) > 1


@pytest.mark.parametrize("action", [-1, 3])
def test_an_action_that_does_not_exist_is_refused(action):
    environment = TabularEnvironment(random_task(1, 5, 3))
    environment.reset(seed=0)
    with pytest.raises(RequestError, match=rf"action = {action}; it must lie in \[0, 3\)"):
        environment.step(action)
