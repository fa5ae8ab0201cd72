"""The fast lander against Gymnasium's class, number for number."""

import collections
import gc
import os
from pathlib import Path

import numpy as np
import pytest

from qbumpers import RequestError
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED
from qbumpers.tasks.lunar_lander import bodies
from qbumpers.tasks.lunar_lander.stepper import Lander, chance_of
from tests.tasks.landing import PAPER_SEED, OriginalLander, actions_of

STATM = Path("/proc/self/statm")
LANDED, CRASHED = TERMINATED | SUCCESS, TERMINATED | CRASH


def compare(ours, original, policy, steps, limit=1000):
    """Step through both, as far as they agree; how often an episode ended in which way."""
    ends = collections.Counter()
    observation, mine, length = original.reset(), ours.reset(0.5), 0
    for _ in range(steps):
        assert mine.dtype == observation.dtype == np.float32
        assert mine.tobytes() == observation.tobytes()
        action = policy(observation)
        observation, reward, terminated = original.step(action)
        mine, my_reward, events = ours.step(action)
        assert my_reward == reward
        assert events == (0 if not terminated else LANDED if reward > 0 else CRASHED)
        length += 1
        if terminated or length == limit:
            ends[events] += 1
            observation, mine, length = original.reset(), ours.reset(0.5), 0
    return ends


@pytest.mark.parametrize("seed", [None, 0, 7])
@pytest.mark.parametrize(
    ("policy", "expected"),
    [("random", {CRASHED}), ("landing", {LANDED}), ("unsteady", {LANDED, CRASHED})],
)
def test_every_number_is_gymnasiums(seed, policy, expected):
    ends = compare(Lander(seed), OriginalLander(seed), actions_of(policy, 0), 6_000)
    assert set(ends) == expected


def test_noise_is_drawn_on_when_an_episode_is_long():
    steps = 2_500
    hovering = actions_of("hovering", 0)
    assert not compare(Lander(), OriginalLander(None), hovering, steps, limit=steps + 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [None, *range(1, 6)])
@pytest.mark.parametrize("policy", ["random", "landing", "unsteady", "hovering"])
def test_every_number_is_gymnasiums_for_long(seed, policy):
    assert compare(Lander(seed), OriginalLander(seed), actions_of(policy, 1), 40_000)


@pytest.mark.parametrize("policy", ["random", "unsteady"])
def test_copied_attributes_give_the_same_numbers(monkeypatch, policy):
    monkeypatch.setattr(bodies, "_lies_as_expected", lambda: False)
    assert compare(Lander(), OriginalLander(None), actions_of(policy, 2), 2_000)


def test_the_bodies_of_this_box2d_are_read_in_place():
    assert bodies._lies_as_expected()


@pytest.mark.parametrize("skipped", [4, 8, 16, 20])
def test_bodies_that_lie_elsewhere_are_not_read_in_place(monkeypatch, skipped):
    monkeypatch.setattr(bodies, "_SKIPPED_BYTES", skipped)
    assert not bodies._lies_as_expected.__wrapped__()


def test_the_chance_is_the_papers():
    generator, original = chance_of(None), np.random.RandomState(PAPER_SEED)
    heights = generator.uniform(0, 400 / 30 / 2, size=12)
    assert heights.tolist() == original.uniform(0, 400 / 30 / 2, size=12).tolist()
    force = generator.uniform(-1000, 1000, size=2)
    np.testing.assert_allclose(force, [-74.1265, 259.2959], atol=5e-5)
    assert force.tolist() == [original.uniform(-1000, 1000) for _ in range(2)]
    noise = generator.uniform(-1, 1, size=(500, 2))
    assert noise.ravel().tolist() == [original.uniform(-1, 1) for _ in range(1000)]


def test_landers_do_not_disturb_each_other_and_observations_are_kept():
    policy = actions_of("random", 3)
    actions = [policy(None) for _ in range(60)]
    alone = Lander()
    expected = [alone.reset(0.0), *(alone.step(action)[0] for action in actions)]
    first, second = Lander(), Lander(4)
    observations = [first.reset(0.9)]
    for action in actions:
        second.reset(0.1)
        observations.append(first.step(action)[0])
        second.step(2)
    assert np.array_equal(observations, expected)


@pytest.mark.skipif(not STATM.exists(), reason="the system does not tell a process's memory")
def test_thousands_of_episodes_leave_nothing_in_memory():
    lander = Lander()

    def after(episodes):
        for _ in range(episodes):
            lander.reset(0.0)
        gc.collect()
        return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    before = after(1_000)
    assert after(6_000) - before < 1_000_000  # an edge of the ground that is lost costs 70 bytes


@pytest.mark.parametrize("seed", [-1, 0.5, "0", True])
def test_a_seed_is_a_whole_number(seed):
    with pytest.raises(RequestError, match=r"seed = .* a whole number of 0 or more is needed"):
        Lander(seed)


@pytest.mark.parametrize("action", [-1, 4])
def test_an_action_is_one_of_four(action):
    with pytest.raises(RequestError, match=rf"action = {action}; it must lie in \[0, 4\)"):
        Lander().step(action)
