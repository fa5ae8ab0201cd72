"""Tables that are estimated by sampling, held to environments whose table is known."""

import dataclasses
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeLimit

from qbumpers import RequestError, SharedControl, TabularTask, make_task, solve
from qbumpers.tasks.estimation import EstimateWarning
from tests.narrowing import of_kind, present
from tests.tasks.worlds import Hidden, World

TRUE = of_kind(TabularTask, make_task("FrozenLake-v1", discount=0.95))
DRY = of_kind(TabularTask, make_task("FrozenLake-v1", discount=0.95, is_slippery=False))


def estimated(steps, seed=0, discount=0.95, **arguments):
    environment = TimeLimit(Hidden(**arguments), 100)
    return TabularTask.estimated(environment, discount=discount, steps=steps, seed=seed)


@pytest.fixture
def hidden():
    """A registered lake without its table."""
    entry_point: Any = Hidden
    gymnasium.register("Hidden-v0", entry_point=entry_point, max_episode_steps=100)
    yield "Hidden-v0"
    del gymnasium.registry["Hidden-v0"]


def probabilities(task):
    """p(s', terminated | s, a) of each pair, [S, A, S, 2]."""
    dense = np.zeros((task.states, task.actions, task.states, 2))
    for place in np.argwhere(task.probability > 0):
        s, a, k = map(int, place)
        dense[s, a, task.next_state[s, a, k], int(task.terminated[s, a, k])] += task.probability[
            s, a, k
        ]
    return dense


def test_a_table_without_chance_is_found_exactly():
    task = estimated(12_000, is_slippery=False)
    met = present(task.estimate).met
    assert np.array_equal(probabilities(task)[met], probabilities(DRY)[met])
    assert solve(task).table[met].tolist() == solve(DRY).table[met].tolist()
    assert met.sum() == 11  # all but four holes and the goal
    assert task.start.tolist() == DRY.start.tolist()


def test_frequencies_are_near_probabilities():
    task = estimated(30_000)
    estimate = present(task.estimate)
    met = estimate.met
    visits = estimate.visits[met][:, :, None, None]
    error = np.abs(probabilities(task) - probabilities(TRUE))[met]
    # Five standard deviations of a frequency, at most sqrt(1 / 4 N) each.
    assert (error < 5 * np.sqrt(0.25 / visits)).all()
    assert estimate.visits.sum() == estimate.steps == 30_000


def test_endings_that_pay_are_successes_and_the_others_crashes():
    task = estimated(12_000, is_slippery=False)
    ends = (
        task.terminated & (present(task.estimate).visits > 0)[:, :, None] & (task.probability > 0)
    )
    assert np.array_equal(present(task.success)[ends], task.next_state[ends] == 15)
    assert np.array_equal(present(task.crash)[ends], task.next_state[ends] != 15)


def test_equal_seeds_give_equal_tables():
    assert estimated(9_000, seed=3).digest() == estimated(9_000, seed=3).digest()
    assert estimated(9_000, seed=3).digest() != estimated(9_000, seed=4).digest()


def test_states_are_counted_from_zero():
    task = estimated(12_000, is_slippery=False, first=7)
    assert task.first_state == 7
    assert task.digest() == estimated(12_000, is_slippery=False).digest()


class Tolls(gymnasium.Env[Any, Any]):
    """Two states; the second action of the second state is never needed: it would pay 100."""

    observation_space = gymnasium.spaces.Discrete(2)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.state = 0
        return 0, {}

    def step(self, action):
        self.state, before = 1, self.state
        return 1, -3.0 if before == 0 else 100.0 * action, before == 1, False, {}


@pytest.mark.parametrize(("discount", "weighed"), [(1.0, 10), (0.5, (1 - 0.5**10) / 0.5)])
def test_what_was_never_tried_counts_as_the_worst_in_every_step(discount, weighed):
    environment = TimeLimit(Tolls(), 10)
    with pytest.warns(EstimateWarning, match="4 were tried fewer than 10 times, 3 of them never"):
        task = TabularTask.estimated(environment, discount=discount, steps=1)
    estimate = present(task.estimate)
    assert (estimate.least, estimate.untried, estimate.median) == (0, 3, 0)
    table = solve(task).table
    untried = estimate.visits == 0
    assert table[untried].tolist() == pytest.approx([-3.0 * weighed] * 3)
    assert task.terminated[untried].all()


def test_every_pair_is_tried_as_often_as_the_other_actions_of_its_state():
    task = TabularTask.estimated(TimeLimit(Tolls(), 10), discount=0.9, steps=44)
    assert present(task.estimate).visits.tolist() == [[11, 11], [11, 11]]


def test_few_tries_are_warned_of():
    with pytest.warns(EstimateWarning, match="Hidden: .* give more than 200 steps"):
        estimated(200)


def test_it_is_made_by_name_on_request(hidden):
    task = of_kind(TabularTask, make_task(hidden, discount=0.95, estimated=9_000))
    assert present(task.estimate).steps == 9_000
    assert make_task(hidden, discount=0.95).observation_size == 16


def test_values_of_an_estimate_assist_in_its_environment(hidden):
    task = of_kind(TabularTask, make_task(hidden, discount=0.95, estimated=9_000))
    values = solve(task)
    assert "estimated from 9,000 steps" in values.method
    for environment in (gymnasium.make(hidden), task.make_environment()):
        shared = SharedControl(environment, "maximal", values)
        _, info = shared.reset(seed=0)
        assert info["assistance"]["values"].tolist() == values(0).tolist()


def test_an_estimate_is_no_part_of_the_digest():
    task = estimated(12_000, is_slippery=False)
    assert dataclasses.replace(task, estimate=None).digest() == task.digest()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": 0}, "steps = 0; a whole number of at least 1"),
        ({"steps": 1.5}, r"steps = 1\.5; a whole number"),
        ({"steps": 9, "seed": -1}, "seed = -1; a whole number of at least 0"),
        ({"steps": 9, "discount": 1.5}, r"discount = 1\.5"),
        ({"steps": 9, "episode_limit": 0}, "episode_limit = 0"),
    ],
)
def test_wrong_numbers_are_named(arguments, message):
    with pytest.raises(RequestError, match=message):
        TabularTask.estimated(TimeLimit(Hidden(), 9), **{"discount": 0.9, **arguments})


def test_only_numbered_states_can_be_counted():
    with pytest.raises(RequestError, match="World: its observation space is MultiBinary"):
        TabularTask.estimated(TimeLimit(World("bits"), 9), discount=0.9, steps=9)
    with pytest.raises(RequestError, match="Hidden has no step limit: give episode_limit"):
        TabularTask.estimated(Hidden(), discount=0.9, steps=9)
