"""Tasks from Gymnasium's toy-text environments: the same transitions as the environment's own."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.toy_text import FrozenLakeEnv

from qbumpers import RequestError
from qbumpers.tasks import TabularTask
from tests.narrowing import present
from tests.tasks.examples import outcomes

TAXI = max(i for i in gymnasium.registry if i.startswith("Taxi-v"))
ENVIRONMENTS = {
    "slippery": ("FrozenLake-v1", {"is_slippery": True}),
    "frozen": ("FrozenLake-v1", {"is_slippery": False}),
    "large": ("FrozenLake-v1", {"is_slippery": True, "map_name": "8x8"}),
    "taxi": (TAXI, {}),
    "cliff": ("CliffWalking-v1", {}),
    "slippery cliff": ("CliffWalking-v1", {"is_slippery": True}),
}


def made(key: str) -> gymnasium.Env:
    name, arguments = ENVIRONMENTS[key]
    return gymnasium.make(name, **arguments)


def inner_of(key: str) -> Any:
    """The environment itself, whose class depends on the key."""
    return made(key).unwrapped


def task_of(key: str, **arguments) -> TabularTask:
    return TabularTask.from_gymnasium(
        made(key), discount=0.95, **{"episode_limit": 150, **arguments}
    )


@pytest.mark.parametrize("key", ENVIRONMENTS)
def test_transitions_are_exactly_the_environments(key):
    table, task = inner_of(key).P, task_of(key)
    assert (task.states, task.actions) == (len(table), len(table[0]))
    for state, actions in table.items():
        for action, rows in actions.items():
            expected: dict[tuple[int, float, bool], float] = {}
            for probability, to, reward, terminated in rows:
                outcome = (int(to), float(reward), bool(terminated))
                expected[outcome] = expected.get(outcome, 0.0) + probability
            assert outcomes(task, state, action) == expected


@pytest.mark.parametrize("key", ENVIRONMENTS)
def test_episodes_start_as_the_environments(key):
    assert (task_of(key).start == inner_of(key).initial_state_distrib).all()


def test_the_taxi_has_300_starts():
    assert (task_of("taxi").start > 0).sum() == 300


def test_the_limit_is_the_environments_unless_given():
    lake = made("slippery")
    assert TabularTask.from_gymnasium(lake, discount=1.0).episode_limit == 100
    assert TabularTask.from_gymnasium(lake, discount=1.0, episode_limit=7).episode_limit == 7


def test_reaching_the_goal_of_the_lake_is_a_success_and_a_hole_a_crash():
    letters = inner_of("slippery").desc.ravel().astype(str)
    task = task_of("slippery")
    walked_on = np.isin(letters, ["S", "F"])
    possible = (task.probability > 0) & walked_on[:, None, None]
    into = letters[task.next_state]
    assert (present(task.success)[possible] == (into == "G")[possible]).all()
    assert (present(task.crash)[possible] == (into == "H")[possible]).all()


def test_a_delivery_is_a_success_and_the_taxi_cannot_crash():
    task = task_of("taxi")
    assert (task.success == (task.reward == 20)).all()
    assert not present(task.crash).any()


def test_the_cliff_of_gymnasium_states_no_success_unless_asked():
    task = task_of("cliff")
    assert task.success is None
    assert task.crash is None
    judged = task_of("cliff", crash=lambda s, a, to, reward, ends: reward == -100)
    assert (judged.crash == (judged.reward == -100)).all()
    assert present(judged.crash).any()


def test_a_map_is_a_grid_only_where_its_cells_are_the_states():
    assert task_of("large").grid == (8, 8)
    assert task_of("taxi").grid is None
    assert task_of("cliff").grid is None


def test_the_name_is_the_environments_id():
    assert task_of("taxi").name == TAXI
    bare = TabularTask.from_gymnasium(FrozenLakeEnv(), discount=0.9, episode_limit=5)
    assert bare.name == "FrozenLakeEnv"


def test_an_environment_without_a_limit_is_refused():
    with pytest.raises(RequestError, match="FrozenLakeEnv has no step limit: give episode_limit"):
        TabularTask.from_gymnasium(FrozenLakeEnv(), discount=0.9)


def test_an_environment_without_a_table_is_refused():
    with pytest.raises(RequestError, match="CartPole-v1 has no attribute P"):
        TabularTask.from_gymnasium(gymnasium.make("CartPole-v1"), discount=0.9)


def test_the_id_of_an_environment_is_none():
    with pytest.raises(
        RequestError, match="environment = 'FrozenLake-v1'; a Gymnasium environment"
    ):
        TabularTask.from_gymnasium("FrozenLake-v1", discount=0.9)


def test_an_environment_without_a_start_is_refused():
    lake = FrozenLakeEnv()
    del lake.initial_state_distrib
    with pytest.raises(RequestError, match="transitions P but no initial_state_distrib: set"):
        TabularTask.from_gymnasium(lake, discount=0.9, episode_limit=5)


def test_a_discount_out_of_range_is_refused():
    with pytest.raises(RequestError, match=r"FrozenLake-v1: discount = 1\.5"):
        TabularTask.from_gymnasium(made("slippery"), discount=1.5)


def test_a_limit_below_1_is_refused():
    with pytest.raises(RequestError, match="FrozenLake-v1: episode_limit = 0; at least 1"):
        TabularTask.from_gymnasium(made("slippery"), discount=0.9, episode_limit=0)
