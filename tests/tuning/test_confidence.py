"""Stated confidence, by simulation; and the whole grid of Cliff Walking."""

import os
from typing import Any

import numpy as np
import pytest
import scipy.stats

from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.reproduction.experiments import reproduction
from qbumpers.simulation import run
from qbumpers.tuning import tune
from tests.narrowing import present
from tests.tuning.made_up import tuned


@pytest.fixture(autouse=True)
def careless_writing(monkeypatch):
    """Files need not outlast a power cut here."""
    monkeypatch.setattr(os, "fsync", lambda file: None)


@pytest.mark.slow
def test_intervals_of_the_choice_cover_as_often_as_they_say(tmp_path):
    """Eight equal conditions: the winner of the race is flattered by it.

    At 80% confidence its interval from the race would miss about every second time.
    """
    repeats, misses = 80, 0
    for seed in range(repeats):
        means = [(3, 0)] * 8
        found, _ = tuned(tmp_path / str(seed), means, seed=seed, trials=10, confidence=0.8)
        _, low, high = present(found.choice).unassisted
        misses += not low <= 0 <= high
    # Three standard deviations of a count with probability 0.2.
    assert abs(misses - 0.2 * repeats) < 3 * np.sqrt(repeats * 0.2 * 0.8)


@pytest.mark.slow
def test_a_condition_at_the_floor_is_rarely_chosen(tmp_path):
    """Eight conditions, none above the floor.

    By the race alone at 80% confidence, one would be chosen in more than half of the repeats.
    """
    repeats, chosen = 40, 0
    for seed in range(repeats):
        means = [(0, 0)] * 8
        found, _ = tuned(tmp_path / str(seed), means, seed=seed, trials=10, confidence=0.8)
        chosen += found.choice is not None
    assert chosen <= 0.2 * repeats


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "floor"), [(0, 50.0), (1, 50.0), (2, 55.0), (3, 60.0)])
def test_cliff_walking_is_tuned_with_a_third_of_the_trials_of_its_grid(tmp_path, seed, floor):
    """The choice is the grid's, or one that the grid's 1,000 trials cannot tell from it."""
    plan = make_plan(reproduction("cliff-walking", trials=1000, seed=seed))
    found = tune(plan, tmp_path, floor, backend=ThisMachine(2))
    assert found.trials <= found.grid_trials / 3
    grid = {}
    for named, content in plan.named:
        outcomes = run(plan.conditions[content], trials=1000, seed=seed, workers=2).outcomes
        assisted = outcomes.assisted_return.mean(axis=1)
        bound = assisted.mean() - scipy.stats.t.ppf(0.95, 999) * scipy.stats.sem(assisted)
        if bound > floor:
            grid[named.condition] = outcomes.unassisted_return.mean(axis=1)
    best = max(grid, key=lambda condition: grid[condition].mean())
    chosen = present(found.choice).condition
    if chosen != best:
        test: Any = scipy.stats.ttest_ind(
            grid[chosen], grid[best], equal_var=False, alternative="less"
        )
        assert test.pvalue > 0.05
