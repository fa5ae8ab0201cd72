"""What helps training on any task."""

import numpy as np

from qbumpers.experts.exploring import (
    JUDGING,
    HeldActions,
    Snapshots,
    for_plain_observations,
    observed_spread,
)
from qbumpers.experts.normalisation import Normalisation
from qbumpers.random_streams import trial_streams
from qbumpers.tasks import make_task
from tests.narrowing import present
from tests.values.networks import constant, network_of

CAR = make_task("MountainCar-v0", discount=0.99)
POLE = make_task("CartPole-v1", discount=0.99)


def stream(seed=0):
    return trial_streams(seed, ["a test"], range(1))[0][0]


def test_random_actions_are_held_as_long_as_stated():
    held, lengths, previous = HeldActions(1_000_000, stream()), [], None
    for _ in range(40_000):
        action = held.action(1.0)
        if action == previous:
            lengths[-1] += 1
        else:
            lengths.append(1)
        previous = action
    # 1 / (n (n + 1)): half of them last one step, a sixth two, a twelfth three.
    shares = [np.mean(np.array(lengths) == n) for n in (1, 2, 3)]
    tolerance = 5 * np.sqrt(0.25 / len(lengths))
    assert np.abs(np.array(shares) - [1 / 2, 1 / 6, 1 / 12]).max() < tolerance


def test_nothing_is_held_without_exploration_or_into_the_next_episode():
    held = HeldActions(3, stream())
    assert {held.action(0.0) for _ in range(50)} == {-1}
    starts = set()
    for _ in range(50):
        held.action(1.0)
        held.begin()
        starts.add(held.action(0.0))
    assert starts == {-1}


def test_observations_of_random_episodes_are_standardised():
    seen = observed_spread(CAR, stream())
    place, speed = seen.spread
    assert -0.7 < seen.mean[0] < -0.3  # the car starts there
    assert 0.01 < place < 0.5
    assert 0.001 < speed < 0.07
    assert seen.clip == np.inf


def test_values_of_plain_observations_are_those_of_standardised_ones():
    values = network_of(inputs=4, actions=2)
    generator = np.random.default_rng(1)
    seen = Normalisation(generator.normal(size=4), generator.uniform(0.1, 3, 4), np.inf)
    plain = for_plain_observations(values, seen)
    observations = generator.normal(size=(20, 4))
    expected = values(seen.normalised(observations))
    assert np.allclose(plain(observations), expected, atol=1e-4)
    assert not np.allclose(values(observations), expected, atol=0.1)


def test_the_best_snapshot_of_the_second_half_is_kept():
    # A push to one side for ever falls at once; values that are all alike push at random.
    bad, better = constant(0, 4, 2), network_of(inputs=4, actions=2, scale=0.0)
    now = [bad]
    snapshots = Snapshots(POLE, 40, lambda: now[0])
    looked = []
    for done in range(1, 41):
        now[0] = better if done in (5, 30) else bad
        before = snapshots.best
        snapshots.look(done)
        if snapshots.best is not before:
            looked.append(done)
    assert looked == [21, 30]
    assert present(snapshots.best).values is better
    assert JUDGING == 20
