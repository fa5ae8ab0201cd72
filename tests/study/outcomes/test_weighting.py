"""Importance weights: against the truth of fresh games, and refused without overlap."""

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Game
from qbumpers.play.setup import Setup
from qbumpers.study.outcomes.weighting import self_normalised, weighted_return

SETUP = Setup("cliff-walking", step_limit=5)


def played(probability, seed, episodes):
    """Episodes of somebody who presses keys at random, under random overrides."""
    game, steps = Game(SETUP, seed), []
    generator = np.random.default_rng(seed)
    for _ in range(episodes):
        game.begin(Choice("random-override", {"probability": probability}))
        steps.append([])
        while game.playing:
            steps[-1].append(game.propose(int(generator.integers(4))))
    return steps


def test_another_setting_is_estimated_as_it_turns_out():
    log, fresh = played(0.5, 1, 1500), played(0.7, 2, 1500)
    truth = [sum(step.reward for step in steps) for steps in fresh]
    found = weighted_return(SETUP, "random-override", {"probability": 0.7}, log)
    error = np.std(truth) / np.sqrt(len(truth))
    assert found.low - 2 * error < np.mean(truth) < found.high + 2 * error
    unweighted = np.mean([sum(step.reward for step in steps) for steps in log])
    assert abs(found.mean - np.mean(truth)) < abs(unweighted - np.mean(truth))
    assert 100 < found.effective < 1500


def test_the_same_setting_has_equal_weights():
    log = played(0.5, 3, 40)
    found = weighted_return(SETUP, "random-override", {"probability": 0.5}, log)
    assert found.effective == pytest.approx(40)
    assert found.mean == pytest.approx(np.mean([sum(s.reward for s in steps) for steps in log]))


@pytest.mark.parametrize(("logged", "name"), [(0.0, "maximal"), (1.0, "none")])
def test_without_overlap_nothing_is_said(logged, name):
    log = played(logged, 4, 40)
    with pytest.raises(RequestError, match="there is no overlap"):
        weighted_return(SETUP, name, {}, log)


def test_too_few_effective_episodes_are_refused():
    with pytest.raises(RequestError, match=r"of 20 episodes, 1\.0 count"):
        self_normalised(np.array([0.0, *[-50.0] * 19]), np.ones(20))
    with pytest.raises(RequestError, match="it remembers"):
        weighted_return(SETUP, "fading", {"of": {"name": "maximal"}, "half_life": 2.0},
                        played(0.5, 5, 20))  # fmt: skip
