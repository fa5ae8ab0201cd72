"""Random tasks: what they are drawn from, and that the end can be reached."""

from typing import Any

import numpy as np
import pytest

from qbumpers import RequestError
from qbumpers.random_streams import ENVIRONMENT, trial_streams
from qbumpers.tasks import make_task
from qbumpers.tasks.random_mdp import random_mdp
from qbumpers.values import solve
from qbumpers.values.exact import proper_states


def sfc64(state: np.ndarray) -> np.random.Generator:
    """NumPy's generator in the given state."""
    bits = np.random.SFC64()
    bits.state = {**bits.state, "state": {"state": state}}
    return np.random.Generator(bits)


def test_its_numbers_are_those_of_numpys_generator():
    """Drawn once more, in the order that the description gives; the ladder comes last."""
    states, actions, branches = 7, 3, 2
    content = ["random-mdp", states, actions, branches]
    chance = sfc64(trial_streams(5, content, range(1))[0, ENVIRONMENT])
    task = random_mdp(5, states, actions, branches)
    drawn = np.empty((states, actions, branches), int)
    for state, action in np.ndindex(states, actions):
        left = list(range(states))
        drawn[state, action] = [left.pop(int(len(left) * chance.random())) for _ in range(2)]
        cut = chance.random()
        assert task.probability[state, action].tolist() == [cut, 1 - cut]
        cost, brought = chance.random(), np.where(task.terminated[state, action], 10.0, 0.0)
        assert task.reward[state, action].tolist() == (brought - cost).tolist()
    differing = np.argwhere(drawn != task.next_state)
    assert all(task.next_state[s, a, k] == s + 1 and k == 0 for s, a, k in differing)


@pytest.mark.parametrize("seed", range(20))
def test_the_end_can_be_reached_from_everywhere_and_every_branch_is_another_state(seed):
    task = random_mdp(seed, states=12, actions=2, branches=2)
    assert proper_states(task).all()
    pairs = task.next_state.reshape(-1, 2)
    assert (pairs[:, 0] != pairs[:, 1]).all()
    assert (task.probability > 0).all()


def test_arguments_decide_and_nothing_else():
    first, again, other = (make_task("random-mdp", seed=seed) for seed in (3, 3, 4))
    assert first.digest() == again.digest() != other.digest()
    assert (first.states, first.actions) == (20, 4)
    small: Any = make_task("random-mdp", states=2, actions=1, branches=1)
    assert solve(small)(0) == pytest.approx([10 + float(small.reward[0, 0, 0]) - 10])


def test_it_is_the_same_on_every_machine():
    digest = "0248b114764d0b956c606f730f2868ed6eb39aeca48148c87e59c161bdc2c82e"
    assert random_mdp().digest() == digest


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": -1}, r"seed = -1; it must lie in \[0, "),
        ({"states": 1}, r"states = 1; it must lie in \[2, 1,000\]"),
        ({"actions": 0}, r"actions = 0; it must lie in \[1, 100\]"),
        ({"states": 5, "branches": 6}, r"branches = 6; it must lie in \[1, 5\]"),
        ({"branches": 2.5}, r"branches = 2.5; a whole number in \[1, 20\] is needed"),
    ],
)
def test_a_number_out_of_range_is_named(arguments, message):
    with pytest.raises(RequestError, match=f"task 'random-mdp': {message}"):
        make_task("random-mdp", **arguments)
