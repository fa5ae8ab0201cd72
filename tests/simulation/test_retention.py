"""Further episodes without the assistant; `test_loops` compares every step with the plain trial."""

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import make_condition, record, run
from qbumpers.tasks import cliff_walking
from tests.narrowing import present
from tests.simulation.conditions import (
    BUMPERS,
    in_a_random_world,
    on_slippery_ice,
    on_the_cliff,
)

STEADY = QLearner(epsilon=Schedule(0.3, 0.3, 0.0), learning_rate=Schedule(0.5, 0.5, 0.0))


@pytest.mark.parametrize("make", [in_a_random_world, on_slippery_ice])
@pytest.mark.parametrize("common", [False, True], ids=["own numbers", "common numbers"])
def test_what_follows_the_training_does_not_change_it(make, common):
    trained = run(make(common_random_numbers=common), trials=4, seed=6)
    longer = run(make(common_random_numbers=common, retention=8), trials=4, seed=6)
    episodes = trained.outcomes.overrides.shape[1]
    for field, array in longer.outcomes._asdict().items():
        assert array.shape == (4, episodes + 8), field
        assert np.array_equal(array[:, :episodes], getattr(trained.outcomes, field)), field
    for field, array in present(longer.counts)._asdict().items():  # of the training alone
        assert np.array_equal(array, getattr(trained.counts, field)), field


def test_the_assistant_is_gone():
    # It never lets a walker leave the best way while it is there: 87, the paper's V*(s_0).
    condition = on_the_cliff(("maximal", {}), episodes=5, retention=5, learner=STEADY)
    outcomes = run(condition, trials=10, seed=1).outcomes
    assert (outcomes.assisted_return[:, :5] == 87).all()
    assert (outcomes.overrides[:, :5].sum(axis=1) > 0).all()
    assert (outcomes.overrides[:, 5:] == 0).all()
    assert (outcomes.assisted_return[:, 5:].min(axis=1) < 87).all()


def test_learners_without_an_assistant_notice_no_difference():
    """At a steady rate, on numbers that depend on the episode alone, training simply goes on."""
    settings = {"learner": STEADY, "common_random_numbers": True}
    none = ("none", {})
    parted = run(on_the_cliff(none, episodes=6, retention=9, **settings), trials=5, seed=2)
    whole = run(on_the_cliff(none, episodes=15, **settings), trials=5, seed=2)
    for field, array in parted.outcomes._asdict().items():
        assert np.array_equal(array, getattr(whole.outcomes, field)), field


@pytest.mark.parametrize("retention", [0, 3])
def test_recorded_steps_reach_to_the_last_episode(retention):
    condition = in_a_random_world(retention=retention)
    steps = record(condition, trial=2, seed=4)
    lengths = run(condition, trials=3, seed=4).outcomes.assisted_length[2]
    assert np.bincount(steps.episode).tolist() == lengths.tolist()
    assert len(lengths) == 30 + retention


def test_fewer_than_no_further_episodes_are_refused():
    with pytest.raises(RequestError, match=r"retention = -1; 0 or more is needed"):
        make_condition(cliff_walking(), "none", retention=-1)


def test_without_being_asked_nobody_goes_on_unassisted():
    assert run(on_the_cliff(BUMPERS), trials=1).outcomes.overrides.shape == (1, 12)
