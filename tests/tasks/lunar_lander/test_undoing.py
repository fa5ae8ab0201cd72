"""Undone steps of the lander: every later number is as if they had never been taken."""

import gymnasium
import numpy as np
import pytest

from qbumpers.tasks.lunar_lander.environment import LunarLander
from qbumpers.tasks.lunar_lander.stepper import Lander
from qbumpers.tasks.undoing import undo_of
from tests.narrowing import of_kind
from tests.tasks.landing import actions_of

NAME = "qbumpers/LunarLander-v0"


def undo_some(step, snapshot, restore, generator):
    """Sometimes take a few steps, and take them back."""
    if generator.random() < 0.15:
        before = snapshot()
        for action in generator.integers(4, size=generator.integers(1, 4)):
            step(int(action))
        restore(before)


@pytest.mark.parametrize("seed", [None, 3])
@pytest.mark.parametrize("policy", ["random", "landing"])
def test_the_stepper_goes_on_as_if_nothing_had_been_undone(seed, policy):
    lander, undisturbed, choose = Lander(seed), Lander(seed), actions_of(policy, 0)
    generator = np.random.default_rng(1)
    legs = 0
    for _ in range(2):
        mine, expected, events = lander.reset(0.0), undisturbed.reset(0.0), 0
        while not events:
            assert mine.tobytes() == expected.tobytes()
            undo_some(lander.step, lander.snapshot, lander.restore, generator)
            action = choose(expected)
            mine, reward, events = lander.step(action)
            expected, *outcome = undisturbed.step(action)
            assert (reward, events) == tuple(outcome)
            legs += expected[6] + expected[7]
        assert mine.tobytes() == expected.tobytes()
    assert (legs > 20) == (policy == "landing")  # undone on the ground too


def test_an_end_is_undone():
    lander, undisturbed, choose = Lander(), Lander(), actions_of("random", 0)
    lander.reset()
    undisturbed.reset()
    events, taken, before = 0, [], ()
    while not events:
        before = lander.snapshot()
        taken.append(choose(None))
        events = lander.step(taken[-1])[2]
    assert before == tuple(taken[:-1])
    lander.restore(before)
    for action in before:
        undisturbed.step(action)
    mine, expected = lander.step(2), undisturbed.step(2)
    assert mine[0].tobytes() == expected[0].tobytes()
    assert mine[1:] == expected[1:]


def test_a_snapshot_stays_as_it_is():
    lander = Lander()
    lander.reset()
    before = lander.snapshot()
    lander.step(1)
    assert before == ()
    assert lander.snapshot() == (1,)


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
@pytest.mark.parametrize("seed", [None, 3])
@pytest.mark.parametrize("policy", ["random", "landing"])
def test_the_environment_goes_on_as_if_nothing_had_been_undone(render_mode, seed, policy):
    environment = gymnasium.make(NAME, seed=seed, render_mode=render_mode)
    undisturbed, choose = Lander(seed), actions_of(policy, 0)
    inner, generator = environment.unwrapped, np.random.default_rng(1)
    mine, expected, ended = environment.reset(seed=0)[0], undisturbed.reset(0.0), False
    own_chance = inner.np_random.bit_generator.state
    undo = undo_of(environment)
    while not ended:
        assert mine.tobytes() == expected.tobytes()
        undo_some(inner.step, *undo, generator)
        action = choose(expected)
        mine, reward, ended, *_ = environment.step(action)
        expected, my_reward, events = undisturbed.step(action)
        assert (reward, ended) == (my_reward, bool(events))
    assert mine.tobytes() == expected.tobytes()
    assert inner.render_mode == render_mode
    assert inner.np_random.bit_generator.state == own_chance
    environment.close()


def test_the_noise_of_the_environment_is_where_it_was():
    environment = of_kind(LunarLander, gymnasium.make(NAME).unwrapped)
    environment.reset(seed=0)
    for action in (2, 1, 0):
        environment.step(action)
    snapshot, noise = environment.snapshot(), repr(environment._chance.bit_generator.state)
    environment.step(3)
    assert repr(environment._chance.bit_generator.state) != noise
    environment.restore(snapshot)
    assert repr(environment._chance.bit_generator.state) == noise


def test_the_picture_is_of_the_state_that_was_put_back():
    environment = gymnasium.make(NAME, render_mode="rgb_array")
    environment.reset()
    for _ in range(5):
        environment.step(0)
    inner = of_kind(LunarLander, environment.unwrapped)
    before, picture = inner.snapshot(), of_kind(np.ndarray, environment.render())
    for _ in range(9):
        environment.step(0)
    assert not np.array_equal(of_kind(np.ndarray, environment.render()), picture)
    inner.restore(before)
    assert np.array_equal(of_kind(np.ndarray, environment.render()), picture)
    environment.close()
