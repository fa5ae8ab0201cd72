"""Tables held to steps of their environments: right ones pass, wrong ones are refused."""

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.toy_text import FrozenLakeEnv
from scipy.stats import binom

from qbumpers import RequestError, TabularTask, make_task, solve
from qbumpers.tasks.agreement import _log_bound, _relative_entropy
from tests.tasks import lakes
from tests.tasks.examples import outcomes


def task_of(environment, episode_limit=50):
    return TabularTask.from_gymnasium(environment, discount=0.9, episode_limit=episode_limit)


@pytest.mark.parametrize("seed", range(12))
def test_a_right_table_passes(seed):
    environment = lakes.Tabled(seed)
    found, true = task_of(environment), environment.task_of_table
    for state, action in np.ndindex(6, 3):
        assert outcomes(found, state, action) == pytest.approx(outcomes(true, state, action))


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        (lakes.Paid, r"led to state 15 with reward 1\.5 and the end; the table has only"),
        (lakes.Slipperier, r"came \+\d+ times too often"),
        (lakes.Steadier, r"in state 0 action 1 led to state 4 with reward 0 32 times of 32"),
        (lakes.Elsewhere, "an episode began in state 1, where by initial_state_distrib none"),
        (lakes.Impatient, "truncated an episode after 12 steps.*50: .*give episode_limit=12"),
    ],
)
def test_a_step_that_does_more_than_the_table_is_refused(environment, message):
    with pytest.raises(RequestError, match=f"{environment.__name__}: its steps.*({message})"):
        task_of(environment())


def test_an_environment_that_truncates_by_itself_has_the_limit_at_which_it_does():
    assert task_of(lakes.Impatient(), episode_limit=12).episode_limit == 12


def test_the_passenger_of_the_taxi_who_changes_the_goal_is_no_part_of_its_table():
    with pytest.raises(RequestError, match="Taxi-v4: its steps do not do what its transition"):
        make_task("Taxi-v4", discount=0.9, fickle_passenger=True)


class Rounded(FrozenLakeEnv):
    """Shows its state as a float."""

    def step(self, a) -> Any:
        observation, *rest = super().step(a)
        return float(observation), *rest


class Wider(FrozenLakeEnv):
    def __init__(self):
        super().__init__()
        self.observation_space = spaces.Discrete(17)


class Placed(FrozenLakeEnv):
    def __init__(self):
        super().__init__()
        self.observation_space = spaces.MultiDiscrete([4, 4])


class Fewer(FrozenLakeEnv):
    def __init__(self):
        super().__init__()
        self.action_space = spaces.Discrete(3)


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        (Rounded, r"it shows \d+\.0, which is no number of a state"),
        (Wider, r"its observation space is Discrete\(17\); its table has 16 states"),
        (Placed, r"its observation space is MultiDiscrete\(\[4 4\]\); its table has 16 states"),
        (Fewer, r"its action space is Discrete\(3\); its table has 4 actions"),
    ],
)
def test_spaces_and_observations_are_those_of_the_table(environment, message):
    with pytest.raises(RequestError, match=message):
        task_of(environment())


@pytest.mark.parametrize("alike", [True, False])
def test_numbers_that_start_elsewhere_count_from_0_in_the_task(alike):
    shifted = task_of(lakes.Tabled(3, 7, 2, table_counts_alike=alike))
    plain = task_of(lakes.Tabled(3))
    assert shifted.digest() == plain.digest()
    assert np.array_equal(solve(shifted).table, solve(plain).table)
    assert shifted.observation_space == spaces.Discrete(6, start=7)
    assert shifted.action_space == spaces.Discrete(3, start=2)


def test_the_callers_environment_goes_on_as_if_nothing_had_been():
    def rest(look):
        environment = gymnasium.make("FrozenLake-v1")
        environment.reset(seed=3)
        if look:
            task_of(environment)
        return [environment.step(action)[0] for action in (1, 2, 1)]

    assert rest(look=True) == rest(look=False)


class Shown(FrozenLakeEnv):
    """Has a window, which cannot be copied, and draws every step if it is shown."""

    def __init__(self):
        super().__init__(render_mode="human")
        self.drawn = 0

    def __deepcopy__(self, memory):
        raise TypeError("a window cannot be copied")

    def render(self):
        self.drawn += 1


def test_nothing_is_drawn_meanwhile():
    environment = Shown()
    task_of(environment)
    assert (environment.drawn, environment.render_mode) == (0, "human")


@pytest.mark.parametrize(("number", "probability"), [(8, 0.3), (40, 0.05), (100, 1 / 3)])
def test_the_bound_holds_for_binomials(number, probability):
    counts = np.arange(number + 1)
    pair = np.array([probability, 1 - probability])
    distances = np.array([_relative_entropy(np.array([k, number - k]), pair) for k in counts])
    chances = binom.pmf(counts, number, probability)
    for distance in distances:
        beyond = chances[distances >= distance - 1e-12].sum()
        assert beyond <= math.exp(_log_bound(float(distance), 1)) * (1 + 1e-9)
    assert _log_bound(40.0, 1) < math.log(1e-6)  # it can refuse
