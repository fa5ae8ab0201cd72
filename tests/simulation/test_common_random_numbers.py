"""Trials of equal number that draw equal numbers, whatever the condition.

Bound of the statistical tests: 4 standard errors, which a right simulation exceeds in one of 16,000
comparisons; with the seeds fixed the outcome is always the same.
"""

import hashlib
from itertools import combinations, pairwise

import numpy as np
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import make_condition, record, run, simulate
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.reference_simulation import seeded_bit_generators
from tests.simulation.conditions import BUMPERS, THRESHOLDS, in_a_random_world, on_the_cliff

STANDARD_ERRORS = 4
ALWAYS, NEVER = Schedule(1.0, 1.0, 0.0), Schedule(0.0, 0.0, 0.0)
SETTINGS = {"learner": QLearner(epsilon=ALWAYS), "episodes": 8}
DIFFERENT = {
    "alone": on_the_cliff(("none", {}), common_random_numbers=True, **SETTINGS),
    "bumpers": on_the_cliff(BUMPERS, common_random_numbers=True, **SETTINGS),
    "thresholds": on_the_cliff(
        THRESHOLDS, perception="interruption", common_random_numbers=True, **SETTINGS
    ),
    "more episodes, another learner": on_the_cliff(
        ("maximal", {}),
        common_random_numbers=True,
        learner=QLearner(discount=0.5, epsilon=ALWAYS, initial_value=-7.0),
        episodes=11,
        retention=2,
    ),
}


def shared_steps(first, second, episode, field):
    """A column of an episode of two recordings, as far as both go."""
    columns = [getattr(steps, field)[steps.episode == episode] for steps in (first, second)]
    length = min(map(len, columns))
    return columns[0][:length], columns[1][:length]


@pytest.mark.parametrize("trial", [0, 5])
@pytest.mark.parametrize("pair", list(combinations(DIFFERENT, 2)), ids=" and ".join)
def test_exploration_and_noise_are_equal_whatever_happened_before(pair, trial):
    # Who always explores proposes what is drawn, whatever they have learned.
    first, second = (record(DIFFERENT[name], trial=trial, seed=3) for name in pair)
    lengths = [np.bincount(steps.episode)[:8] for steps in (first, second)]
    assert (lengths[0] != lengths[1]).any()
    for episode in range(8):
        for field in ("proposed", "coin", "tie"):
            mine, yours = shared_steps(first, second, episode, field)
            assert len(mine) > 0
            assert np.array_equal(mine, yours), (episode, field)


def test_greedy_episodes_and_starts_are_equal_too():
    # Who learns nothing walks at random in greedy episodes: by what is drawn for them alone.
    names = ("none", "maximal")
    conditions = [
        make_condition(
            in_a_random_world().task,
            name,
            learner=QLearner(discount=0.9, epsilon=ALWAYS, learning_rate=NEVER),
            episodes=20,
            common_random_numbers=True,
        )
        for name in names
    ]
    first, second = (run(condition, trials=6, seed=2).outcomes for condition in conditions)
    assert np.array_equal(first.unassisted_return, second.unassisted_return)
    assert len(np.unique(first.unassisted_return)) > 20
    assert not np.array_equal(first.assisted_return, second.assisted_return)
    starts = [
        steps.state[np.flatnonzero(np.diff(steps.episode, prepend=-1))].tolist()
        for steps in (record(condition, seed=2) for condition in conditions)
    ]
    assert starts[0] == starts[1]
    assert len(set(starts[0])) == 3


def test_trials_episodes_and_seeds_draw_different_numbers():
    condition = DIFFERENT["alone"]
    drawn = {
        tuple(steps.coin[steps.episode == episode][:3])
        for seed in range(2)
        for trial in range(4)
        for steps in [record(condition, trial=trial, seed=seed)]
        for episode in range(8)
    }
    assert len(drawn) == 2 * 4 * 8


def test_conditions_draw_different_numbers_unless_they_are_asked_to_share():
    first, second = (
        record(on_the_cliff(assistant, **SETTINGS), seed=3) for assistant in (("none", {}), BUMPERS)
    )
    for episode in range(8):
        mine, yours = shared_steps(first, second, episode, "coin")
        assert not (mine == yours).any()


def test_the_first_episodes_do_not_depend_on_how_many_follow():
    steady = Schedule(0.5, 0.5, 0.0)
    learner = QLearner(epsilon=steady, learning_rate=steady)
    few, many = (
        run(
            on_the_cliff(BUMPERS, episodes=episodes, learner=learner, common_random_numbers=True),
            trials=4,
        ).outcomes
        for episodes in (5, 12)
    )
    for field, array in few._asdict().items():
        assert np.array_equal(array, getattr(many, field)[:, :5]), field


@pytest.mark.parametrize("chosen", [range(3, 6), range(1, 7, 2)])
def test_trials_do_not_depend_on_those_asked_with_them(chosen):
    condition = in_a_random_world(common_random_numbers=True)
    whole = run(condition, trials=7, seed=5).outcomes
    part = run(condition, trials=chosen, seed=5, workers=2).outcomes
    for field, array in part._asdict().items():
        assert np.array_equal(array, getattr(whole, field)[list(chosen)]), field


TRIALS = 400


def mean_returns(alpha, common, seed=0):
    """Mean assisted and unassisted return of each trial."""
    assistant = make_assistant("stochastic-q-bumpers", alpha=alpha, second=True)
    outcomes = simulate(
        cliff_walking(), assistant, trials=TRIALS, seed=seed, workers=2,
        common_random_numbers=common,
    ).outcomes  # fmt: skip
    return outcomes.assisted_return.mean(axis=1), outcomes.unassisted_return.mean(axis=1)


@pytest.fixture(scope="module")
def neighbours():
    """Returns of alpha 0.6, 0.7 and 0.8, with numbers of their own and in common."""
    return {
        common: [mean_returns(alpha, common) for alpha in (0.6, 0.7, 0.8)]
        for common in (False, True)
    }


def fisher_z(first, second):
    """Correlation on a scale in which its standard error is 1 / sqrt(N - 3)."""
    return np.arctanh(np.corrcoef(first, second)[0, 1]) * np.sqrt(TRIALS - 3)


@pytest.mark.parametrize("kind", [0, 1], ids=["assisted", "unassisted"])
def test_paired_differences_of_neighbours_vary_less(neighbours, kind):
    for first, second in pairwise(neighbours[True]):
        assert fisher_z(first[kind], second[kind]) > STANDARD_ERRORS
        paired = np.var(first[kind] - second[kind], ddof=1)
        unpaired = np.var(first[kind], ddof=1) + np.var(second[kind], ddof=1)
        # A variance of N numbers errs by about sqrt(2 / N) of itself, here 7%: 0.75 is far below 1.
        assert paired < 0.75 * unpaired
    for first, second in pairwise(neighbours[False]):
        assert abs(fisher_z(first[kind], second[kind])) < STANDARD_ERRORS


@pytest.mark.parametrize("kind", [0, 1], ids=["assisted", "unassisted"])
def test_sharing_numbers_changes_no_mean_and_no_spread(neighbours, kind):
    for own, common in zip(neighbours[False], neighbours[True], strict=True):
        mine, shared = own[kind], common[kind]
        error = np.sqrt((np.var(mine, ddof=1) + np.var(shared, ddof=1)) / TRIALS)
        assert abs(mine.mean() - shared.mean()) < STANDARD_ERRORS * error
        spread = np.log(np.std(mine, ddof=1) / np.std(shared, ddof=1))
        # Of a standard deviation's logarithm: sqrt((kurtosis - 1) / 4 N), for two of them.
        kurtosis = max(np.mean(((x - x.mean()) / x.std()) ** 4) for x in (mine, shared))
        assert abs(spread) < STANDARD_ERRORS * np.sqrt((kurtosis - 1) / (2 * TRIALS))


@pytest.mark.parametrize("retention", [0, 4])
def test_without_sharing_what_is_trained_decides_what_is_drawn_and_nothing_else(retention):
    task = cliff_walking()
    condition = on_the_cliff(BUMPERS, retention=retention)
    schedule = {"start": 1.0, "end": 0.02, "fraction": 0.9}
    trained = {
        "task": task.digest(),
        "values": hashlib.sha256(solve(task).table.tobytes()).hexdigest(),
        "discount": 1.0,
        "assistant": "stochastic-q-bumpers",
        "options": {
            "alpha": 0.7, "v_min": 0.0, "p_max": 0.999,
            "second": True, "escalate": True, "clip": True,
        },
        "learner": {
            "discount": 1.0, "epsilon": schedule, "learning_rate": schedule,
            "initial_value": 0.0, "penalty": 1.0,
        },
        "perception": "transition",
        "episodes": 12,
    }  # fmt: skip
    steps = record(condition, trial=4, seed=9)
    noise = np.random.Generator(seeded_bit_generators(9, trained, 4)[1])
    drawn = noise.random((len(steps.coin), 2))
    assert np.array_equal(np.stack([steps.coin, steps.tie], axis=1), drawn)
