"""Values of states that look alike to the assistant."""

import dataclasses

import numpy as np
import pytest

from qbumpers import RequestError, SharedControl, make_assistant, make_task, simulate, solve
from qbumpers.tasks import TabularTask
from qbumpers.tasks.hidden_goal import hidden_goal
from qbumpers.values import learn_values
from qbumpers.values.hidden import averaged
from tests.tasks.examples import random_task

UNKNOWN = "closest-acceptable-unknown-goal"


def two_doors():
    """One step: door 0 or 1; behind that of the state is 1, behind the other one -1."""
    return TabularTask(
        name="two-doors",
        next_state=np.zeros((2, 2, 1), int),
        probability=np.ones((2, 2, 1)),
        reward=np.array([[[1.0], [-1.0]], [[-1.0], [1.0]]]),
        terminated=np.ones((2, 2, 1), bool),
        start=np.array([0.5, 0.5]),
        discount=1.0,
        episode_limit=1,
        seen=np.array([0, 0]),
    )


def test_values_of_what_is_seen_are_means_over_states_that_look_alike():
    task = dataclasses.replace(random_task(1, 6, 2), seen=np.array([0, 1, 1, 0, 2, 1]))
    full = solve(dataclasses.replace(task, seen=None)).table
    expected = [(full[0] + full[3]) / 2, (full[1] + full[2] + full[5]) / 3, full[4]]
    assert solve(task).table == pytest.approx(np.array(expected))
    assert averaged(dataclasses.replace(task, seen=None), full) is full
    alike = simulate(task, "maximal", trials=3, episodes=5)
    given = simulate(task, "maximal", trials=3, episodes=5, values=np.array(expected))
    assert np.array_equal(alike.outcomes.assisted_return, given.outcomes.assisted_return)


def test_learned_values_are_of_what_is_seen_too():
    values = learn_values(two_doors(), episodes=2_000)
    assert values.table == pytest.approx(np.zeros((1, 2)), abs=0.05)


def test_each_goal_has_its_own_values():
    task = hidden_goal()
    found = solve(task, others=("goals",))
    full = solve(dataclasses.replace(task, seen=None)).table
    assert list(found.others) == ["goals_0", "goals_1", "goals_2"]
    for goal in range(3):
        assert np.array_equal(found.others[f"goals_{goal}"].table, full[goal::3])
    assert found.table == pytest.approx(np.mean([v.table for v in found.others.values()], axis=0))


def test_goals_of_unequal_number_have_no_values_each():
    task = dataclasses.replace(random_task(1, 6, 2), seen=np.array([0, 1, 1, 0, 2, 1]))
    with pytest.raises(RequestError, match="between 1 and 3 states look alike"):
        solve(task, others=("goals",))


def test_of_a_task_that_is_all_seen_the_only_goal_has_the_values():
    found = solve(make_task("cliff-walking"), others=("goals",))
    assert np.array_equal(found.others["goals_0"].table, found.table)


def test_what_a_proposal_tells_is_weighed_by_how_often_the_pilot_errs():
    """The pilot means its door 7 times in 10, else either: 85 in 100 are right."""
    found = solve(two_doors(), others=("proposals",)).others
    # Some 1,000 visits at least: a standard error of 0.03 at most by the last step sizes.
    assert found["proposals_0"].table == pytest.approx(np.array([[0.7, -0.7]]), abs=0.1)
    assert found["proposals_1"].table == pytest.approx(np.array([[-0.7, 0.7]]), abs=0.1)


def test_a_row_for_each_proposal_is_needed():
    task = hidden_goal()
    values = solve(task, others=("proposals",))
    others = {name: row for name, row in values.others.items() if name != "proposals_3"}
    few = dataclasses.replace(values, others=others)
    with pytest.raises(RequestError, match="proposals_3, one for each proposal"):
        simulate(task, make_assistant(UNKNOWN, alpha=0.5), values=few, trials=1, episodes=1)


def test_the_wrapper_shows_the_assistant_what_it_may_see():
    task = hidden_goal()
    values = solve(task, others=("goals",))
    env = SharedControl(task.make_environment(), "better-for-all-goals", values)
    state, info = env.reset(seed=3)
    assert info["assistance"]["state"] == state // 3
    _, _, _, _, info = env.step(2)  # down, against the wall
    record = info["assistance"]
    assert (record["proposed"], record["overridden"]) == (2, True)
    assert record["executed"] in (0, 1, 3)


@pytest.mark.parametrize(
    "begin",
    [
        lambda task, rule: SharedControl(task.make_environment(), rule, solve(task)),
        lambda task, rule: simulate(task, rule, trials=1, episodes=1),
    ],
)
def test_rules_that_follow_transitions_are_refused_where_states_are_half_seen(begin):
    rule = make_assistant("trajectory-bumpers", path=(0, 1), reach=1)
    with pytest.raises(RequestError, match="transitions"):
        begin(hidden_goal(), rule)
