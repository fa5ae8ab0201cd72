import numpy as np
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.errors import RequestError
from qbumpers.learners import QLearner, Schedule
from qbumpers.simulation import make_condition, record, run, simulate
from qbumpers.tasks import TabularTask, cliff_walking
from qbumpers.values import solve
from tests.narrowing import present
from tests.simulation.conditions import BUMPERS, in_a_random_world, on_the_cliff

CONSTANT = Schedule(1.0, 1.0, 0.0)


def assert_same(first, second):
    for mine, yours in zip(first, second, strict=True):
        for field, array in mine._asdict().items():
            assert np.array_equal(array, getattr(yours, field)), field


@pytest.mark.parametrize("make", [lambda: on_the_cliff(BUMPERS), in_a_random_world])
@pytest.mark.parametrize("workers", [2, 3, 20])
def test_workers_change_no_number(make, workers):
    condition = make()
    assert_same(run(condition, trials=7, seed=5, workers=workers), run(condition, trials=7, seed=5))


@pytest.mark.parametrize(
    "blocks",
    [[range(3), range(3, 7)], [range(i, i + 1) for i in range(7)], [range(6), range(6, 7)]],
    ids=["two", "seven", "uneven"],
)
def test_blocks_of_trials_change_no_number(blocks):
    condition = in_a_random_world()
    whole = run(condition, trials=7, seed=5)
    parts = [run(condition, trials=block, seed=5) for block in blocks]
    for field, array in whole.outcomes._asdict().items():
        pieces = [getattr(part.outcomes, field) for part in parts]
        assert np.array_equal(np.concatenate(pieces), array), field
    for field, array in present(whole.counts)._asdict().items():
        assert np.array_equal(sum(getattr(part.counts, field) for part in parts), array), field


@pytest.mark.parametrize("workers", [1, 2])
def test_every_second_trial_can_be_asked_for(workers):
    condition = on_the_cliff(BUMPERS)
    whole = run(condition, trials=6, seed=5).outcomes
    chosen = run(condition, trials=range(1, 6, 2), seed=5, workers=workers).outcomes
    assert np.array_equal(chosen.assisted_return, whole.assisted_return[[1, 3, 5]])


def test_seeds_and_trials_differ():
    condition = on_the_cliff(BUMPERS)
    returns = [run(condition, trials=4, seed=seed).outcomes.assisted_return for seed in (0, 1)]
    assert len(np.unique(np.concatenate(returns), axis=0)) == 8


def test_simulate_is_make_condition_and_run():
    found = simulate(
        cliff_walking(), make_assistant(BUMPERS[0], **BUMPERS[1]), episodes=12, trials=3, seed=4
    )
    assert_same(found, run(on_the_cliff(BUMPERS), trials=3, seed=4))


def test_counts_and_lengths_tell_the_same_number_of_steps():
    found = run(in_a_random_world(), trials=5)
    counts = present(found.counts)
    assert counts.assisted.sum() == found.outcomes.assisted_length.sum()
    assert counts.unassisted.sum() == found.outcomes.unassisted_length.sum()
    assert counts.overridden.sum() == found.outcomes.overrides.sum()
    assert found.steps == counts.assisted.sum() + counts.unassisted.sum()


def one_step_task(first_ends):
    """Two actions, one step: 0 pays 1, 1 pays 2; the second always ends, the first as asked.

    Where the first does not end, the episode is cut off all the same, by its limit of one step.
    """
    return TabularTask(
        name="one step",
        next_state=np.array([[[1], [1]], [[1], [1]]]),
        probability=np.ones((2, 2, 1)),
        reward=np.array([[[1.0], [2.0]], [[0.0], [0.0]]]),
        terminated=np.array([[[first_ends], [True]], [[True], [True]]]),
        start=np.array([1.0, 0.0]),
        discount=0.5,
        episode_limit=1,
    )


@pytest.mark.parametrize(("first_ends", "greedy_return"), [(False, 1.0), (True, 2.0)])
def test_truncation_is_bootstrapped_through_and_termination_is_not(first_ends, greedy_return):
    # With values of 5 at first and a rate of 1, the first action is learned to be worth
    # 1 + 0.5 * 5 = 3.5 if the limit cuts the episode off and 1 if it ends; the second is
    # worth 2, and would be 4.5 if the end were bootstrapped through.
    learner = QLearner(0.5, epsilon=CONSTANT, learning_rate=CONSTANT, initial_value=5.0)
    condition = make_condition(one_step_task(first_ends), "none", learner=learner, episodes=30)
    outcomes = run(condition, trials=20).outcomes
    # Both actions were tried by then: one is missed with probability 2 * 2**-29 a trial.
    assert (outcomes.unassisted_return[:, -1] == greedy_return).all()
    assert (outcomes.unassisted_length == 1).all()


def test_an_episode_limit_stops_an_episode_that_never_ends():
    task = TabularTask(
        name="treadmill",
        next_state=np.zeros((1, 2, 1), np.int64),
        probability=np.ones((1, 2, 1)),
        reward=np.ones((1, 2, 1)),
        terminated=np.zeros((1, 2, 1), np.bool_),
        start=np.ones(1),
        discount=0.5,
        episode_limit=17,
    )
    outcomes = simulate(task, "none", episodes=3, trials=2).outcomes
    assert (outcomes.assisted_length == 17).all()
    assert (outcomes.assisted_return == 17.0).all()  # undiscounted, as documented
    assert (outcomes.assisted_events == 16).all()  # the limit, and nothing else
    assert (outcomes.unassisted_events == 16).all()


def test_the_learner_has_the_tasks_discount_unless_told_otherwise():
    assert make_condition(one_step_task(True), "none").learner == QLearner(discount=0.5)


@pytest.mark.parametrize("episodes", [0, -3])
def test_fewer_than_one_episode_is_refused(episodes):
    with pytest.raises(RequestError, match=f"episodes = {episodes}"):
        make_condition(cliff_walking(), "none", episodes=episodes)


@pytest.mark.parametrize("trials", [0, -3, range(0), range(5, 2)])
def test_fewer_than_one_trial_is_refused(trials):
    with pytest.raises(RequestError, match="trials = "):
        run(on_the_cliff(BUMPERS), trials=trials)


@pytest.mark.parametrize("begin", [run, record], ids=["run", "record"])
def test_a_negative_seed_is_refused(begin):
    arguments = {"trials": 1} if begin is run else {}
    with pytest.raises(RequestError, match="seed = -1"):
        begin(on_the_cliff(BUMPERS), seed=-1, **arguments)


def test_an_unknown_perception_is_refused_with_the_nearest_name():
    with pytest.raises(RequestError, match=r"perception 'transitive'.*did you mean 'transition'"):
        make_condition(cliff_walking(), "none", perception="transitive")


def test_an_unknown_assistant_is_refused_with_the_nearest_name():
    with pytest.raises(RequestError, match=r"assistant 'nobody'.*Known: .*none"):
        make_condition(cliff_walking(), "nobody")


def spoiled(value):
    table = solve(cliff_walking()).table.copy()
    table[7, 2] = value
    return table.__getitem__


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (lambda state: np.zeros(3), r"in state 0 have shape \(3,\).*\(4,\)"),
        (lambda state: 0.0, r"in state 0 have shape \(\)"),
        (lambda state: np.zeros((1, 4)), r"in state 0 have shape \(1, 4\)"),
        (spoiled(np.nan), "in state 7 .*nan.*finite"),
        (spoiled(np.inf), "in state 7 .*inf.*finite"),
    ],
    ids=["narrow", "scalar", "deep", "nan", "infinite"],
)
def test_values_that_do_not_fit_the_task_are_refused(values, message):
    with pytest.raises(RequestError, match=message):
        make_condition(cliff_walking(), "none", values=values)


@pytest.mark.parametrize("v_min", [87.0, 200.0])
def test_a_lower_bound_at_or_above_the_start_value_is_refused(v_min):
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.7, v_min=v_min)
    with pytest.raises(RequestError, match=rf"v_min = {v_min:g} .*V\*\(s_0\) = 87"):
        make_condition(cliff_walking(), assistant)
