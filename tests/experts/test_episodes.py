"""Episodes as arrays: against Gymnasium's own environment, and played again."""

import gymnasium
import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.experts.episodes import (
    discounted_return,
    epsilon_greedy,
    greedy,
    play,
    play_several,
    replay_then,
)
from qbumpers.tasks import make_task
from tests.values.networks import network_of


@pytest.fixture(scope="module")
def task():
    return make_task("CartPole-v1", discount=0.9)


def test_an_episode_is_what_the_environment_gives(task):
    generator = np.random.default_rng(0)
    episode = play(task, task.make_stepper(), lambda o, t: int(generator.integers(2)), 0.25)
    environment = gymnasium.make("CartPole-v1")
    (observation, _), terminated = environment.reset(seed=2**30), False
    for step, action in enumerate(episode.actions):
        assert np.array_equal(episode.observations[step], observation)
        observation, reward, terminated, _, _ = environment.step(int(action))
        assert episode.rewards[step] == reward
    assert np.array_equal(episode.observations[-1], observation)
    assert terminated
    assert episode.terminated
    assert episode.observations.shape == (len(episode.actions) + 1, 4)


def test_a_prefix_repeats_what_happened_and_then_others_decide(task):
    stepper = task.make_stepper()
    generator = np.random.default_rng(1)
    first = play(task, stepper, lambda o, t: int(generator.integers(2)), 0.5)
    again = play(task, stepper, replay_then(first.actions, lambda o, t: 0), 0.5)
    assert np.array_equal(again.observations, first.observations)
    parted = play(task, stepper, replay_then(first.actions[:4], lambda o, t: 1), 0.5)
    assert np.array_equal(parted.observations[:5], first.observations[:5])
    assert (parted.actions[4:] == 1).all()


def test_the_step_limit_truncates_and_is_no_end(task):
    shorter = make_task("MountainCar-v0", discount=0.9, episode_limit=7)
    episode = play(shorter, shorter.make_stepper(), lambda o, t: 0, 0.5)
    assert (len(episode.actions), episode.terminated) == (7, False)


def test_greedy_actions_are_best_and_starts_random(task):
    values = network_of(inputs=4)
    for episode in play_several(task, values, 3, seed=2):
        assert np.array_equal(episode.actions, values(episode.observations[:-1]).argmax(axis=1))
    starts = [e.actions[:5].tolist() for e in play_several(task, values, 20, random_start=5)]
    assert len({tuple(actions) for actions in starts}) > 10


def test_random_actions_come_as_often_as_asked_for():
    generator = np.random.default_rng(4)
    policy = epsilon_greedy(lambda o, t: 0, 0.3, 3, generator, random_start=100)
    chosen = np.array([policy(np.zeros(1), step) for step in range(5100)])
    assert np.bincount(chosen[:100]).min() > 20
    assert (chosen[100:] == 0).mean() == pytest.approx(0.8, abs=0.03)


def test_equally_good_actions_are_all_taken():
    policy = greedy(lambda _: [1.0, 0.0, 1.0], 3, np.random.default_rng(0))
    chosen = [policy(np.zeros(1), step) for step in range(200)]
    assert np.bincount(chosen).tolist()[1] == 0
    assert 70 < np.bincount(chosen)[0] < 130


def test_the_first_episodes_do_not_depend_on_how_many_follow(task):
    few, many = (play_several(task, network_of(inputs=4), n, epsilon=0.5) for n in (2, 4))
    for first, second in zip(few, many[:2], strict=True):
        assert np.array_equal(first.observations, second.observations)


def test_discounted_returns_weigh_by_powers():
    assert discounted_return(np.array([1.0, 2.0, 4.0]), 0.5) == 3.0


@pytest.mark.parametrize("field", ["episodes", "epsilon", "random_start", "seed"])
def test_numbers_out_of_range_are_named(task, field):
    with pytest.raises(RequestError, match=rf"{field} = -1.*needed"):
        play_several(task, network_of(inputs=4), **{"episodes": 1, field: -1})


def test_values_that_are_not_finite_are_named(task):
    with pytest.raises(RequestError, match=r"Q values at step 0 are \[nan, 1\.0\]"):
        play_several(task, lambda _: [np.nan, 1.0], 1)


class Broken:
    def reset(self, chance):
        return np.zeros(2, np.float32)

    def step(self, action):
        return np.zeros(2, np.float32), np.nan if action else 0.0, 0


def test_rewards_that_are_not_finite_are_named_with_their_step(task):
    with pytest.raises(RequestError, match=r"step 3: observation .*, reward nan; every number"):
        play(task, Broken(), lambda o, t: int(t == 2), 0.5)
