"""Importance weights: against the truth of fresh games, and refused without overlap."""

import contextlib

import numpy as np
import pytest

from qbumpers.analysis.statistics import mean_interval
from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Game
from qbumpers.play.setup import Setup
from qbumpers.study.outcomes.weighting import compare_settings, self_normalised, weighted_return
from tests.study.flow.studies import block, study_of

SETUP = Setup("cliff-walking", step_limit=5)


def played(name, options, seed, episodes):
    """Episodes of somebody who presses keys at random, each as of another participant."""
    game, steps = Game(SETUP, seed), []
    generator = np.random.default_rng(seed)
    for _ in range(episodes):
        game.begin(Choice(name, options))
        steps.append([])
        while game.playing:
            steps[-1].append(game.propose(int(generator.integers(4))))
    return [[each] for each in steps]


def at_random(probability, seed, episodes):
    return played("random-override", {"probability": probability}, seed, episodes)


def returns_of(participants):
    return [sum(step.reward for step in steps) for each in participants for steps in each]


def test_another_setting_is_estimated_as_it_turns_out():
    log, fresh = at_random(0.5, 1, 1500), at_random(0.7, 2, 1500)
    truth = returns_of(fresh)
    found = weighted_return(SETUP, "random-override", {"probability": 0.7}, log)
    error = np.std(truth) / np.sqrt(len(truth))
    assert found.low - 2 * error < np.mean(truth) < found.high + 2 * error
    unweighted = np.mean(returns_of(log))
    assert abs(found.mean - np.mean(truth)) < abs(unweighted - np.mean(truth))
    assert 100 < found.effective < 1500


def test_equal_weights_are_the_mean_with_its_interval():
    log = at_random(0.5, 3, 40)
    found = weighted_return(SETUP, "random-override", {"probability": 0.5}, log)
    assert found.effective == pytest.approx(40)
    assert found[:3] == pytest.approx(mean_interval(np.array(returns_of(log))))


def test_the_interval_is_over_participants():
    returns = np.random.default_rng(1).normal(0, 1, (7, 4)) + np.arange(7)[:, None]
    found = self_normalised(np.zeros(28), returns.ravel(), np.repeat(np.arange(7), 4))
    assert found[:3] == pytest.approx(mean_interval(returns.mean(axis=1)))
    assert found[3:] == (pytest.approx(28), 28, 7)


@pytest.mark.parametrize(("logged", "name"), [(0.0, "maximal"), (1.0, "none")])
def test_without_overlap_nothing_is_said(logged, name):
    log = at_random(logged, 4, 40)
    with pytest.raises(RequestError, match="there is no overlap"):
        weighted_return(SETUP, name, {}, log)


@pytest.mark.parametrize(
    ("more", "overlaps"), [({}, False), ({"clip": False, "escalate": False}, True)]
)
def test_bumpers_overlap_with_a_larger_alpha_if_no_override_is_sure(more, overlaps):
    # A fall loses 100 of the 187 between V*(s_0) and v_min.
    name, settings = "stochastic-q-bumpers", {"v_min": -100.0, **more}
    log = played(name, {"alpha": 0.5, **settings}, 5, 60)
    smaller = weighted_return(SETUP, name, {"alpha": 0.45, **settings}, log)
    assert smaller.effective > 10
    refused = contextlib.nullcontext() if overlaps else pytest.raises(RequestError, match="overlap")
    with refused:
        weighted_return(SETUP, name, {"alpha": 0.6, **settings}, log)


def test_too_little_is_refused():
    with pytest.raises(RequestError, match=r"of 20 episodes, 1\.0 count"):
        self_normalised(np.array([0.0, *[-50.0] * 19]), np.ones(20), np.arange(20))
    with pytest.raises(RequestError, match="of 1 participant; at least 2 are needed"):
        self_normalised(np.zeros(20), np.ones(20), np.zeros(20, int))
    with pytest.raises(RequestError, match="it remembers"):
        weighted_return(SETUP, "fading", {"of": {"name": "maximal"}, "half_life": 2.0},
                        at_random(0.5, 5, 20))  # fmt: skip


def test_a_condition_of_a_study_is_weighted(study, setups, participants):
    totals = {
        condition: [
            [episode.total for episode in block.episodes if episode.choice.assisted]
            for each in participants
            if each.now.condition == condition
            for block in each.blocks
            if block.phase == "training"
        ]
        for condition in ("helped/no", "helped/yes")
    }
    condition, theirs = max(totals.items(), key=lambda pair: len(pair[1]))  # others may drop out
    [found] = compare_settings(study, setups, participants, condition, {"probability": 0.52})
    assert found.block == "training"
    assert found.logged.participants == found.other.participants == len(theirs)
    assert found.logged.mean == pytest.approx(np.mean(theirs))
    assert found.logged.effective == pytest.approx(3 * len(theirs))
    assert found.other.effective < found.logged.effective
    for changes, name, message in [
        ({"probability": 0.6}, "helped", "unknown condition 'helped'"),
        ({}, condition, "nothing is changed"),
        ({"probability": 2.0}, condition, "probability = 2.0"),
        ({"alpha": 0.5}, condition, "alpha"),
    ]:
        with pytest.raises(RequestError, match=message):
            compare_settings(study, setups, participants, name, changes)
    with pytest.raises(RequestError, match="nobody has finished its training yet"):
        compare_settings(study, setups, [], condition, {"probability": 0.6})


def test_a_yoked_condition_has_no_rule_to_be_changed():
    yoked = [{"name": "helped", "assistant": "maximal"}, {"name": "yoked", "yoked_to": "helped"}]
    study = study_of(block("training"), conditions=yoked)
    with pytest.raises(RequestError, match="it is yoked to helped"):
        compare_settings(study, {}, [], "yoked", {"probability": 0.5})
