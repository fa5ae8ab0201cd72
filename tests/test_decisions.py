"""The records that every host shares, and the projected return."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.compilation import compiled_for_session
from qbumpers.decisions import (
    Account,
    Decision,
    Execution,
    Noise,
    begin,
    execution_of,
    projected_return,
    settle,
    situate,
    step_of,
)
from qbumpers.errors import RequestError

rewards = st.lists(st.floats(-100, 100), max_size=20)


@given(rewards, st.floats(0.1, 1), st.floats(-100, 100))
def test_projected_return_is_the_discounted_sum_of_rewards_and_value(past, discount, value):
    powers = discount ** np.arange(len(past) + 1)
    earned = float(np.sum(powers[:-1] * past))
    expected = float(np.sum(powers * [*past, value]))
    assert projected_return(earned, powers[-1], value) == pytest.approx(expected, abs=1e-9)


def test_projected_return_at_the_start_is_the_value_itself():
    assert projected_return(0.0, 1.0, 87.0) == 87.0


@given(rewards, st.floats(0.1, 1), st.lists(st.floats(-100, 100), min_size=1, max_size=5))
def test_the_account_of_an_episode_is_the_discounted_sum_of_what_it_brought(past, gamma, values):
    account = begin(np.array(values), 7)
    for reward in past:
        account = settle(account, reward, gamma)
    powers = gamma ** np.arange(len(past) + 1)
    assert account.earned == pytest.approx(float(np.sum(powers[:-1] * past)), abs=1e-9)
    assert account.discount == pytest.approx(powers[-1], rel=1e-12)
    assert (account.start_value, account.episode, account.step) == (max(values), 7, len(past))


def test_a_situation_holds_the_account_as_it_stands():
    account = Account(-3.0, 0.5, 9.0, 2, 4)
    row, others = np.array([1.0, 2.0]), np.array([[3.0, 4.0]])
    situation = situate(account, 17, row, others, 1)
    assert situation.values is row
    assert situation.others is others
    assert (situation.state, situation.proposed) == (17, 1)
    seen = [getattr(situation, field) for field in Account._fields]
    assert seen == [-3.0, 0.5, 9.0, 2, 4]


@pytest.mark.parametrize(
    ("executed", "undone", "overridden"),
    [(1, False, False), (0, False, True), (1, True, True), (0, True, True)],
)
def test_a_step_is_overridden_if_another_action_was_executed_or_it_was_undone(
    executed, undone, overridden
):
    situation = situate(
        Account(-3.0, 0.5, 9.0, 2, 4), 17, np.array([1.0, 2.0]), np.zeros((0, 2)), 1
    )
    step = step_of(situation, Noise(0.25, 0.75), Execution(executed, undone, 0.4), 1, -1.0, 18, 16)
    assert step.overridden == overridden
    assert step.projected_return == -3.0 + 0.5 * 2.0
    assert (step.state, step.next_state, step.events) == (17, 18, 16)
    assert (step.executed, step.undone, step.probability) == (executed, undone, 0.4)
    assert (step.coin, step.tie, step.reward, step.credited) == (0.25, 0.75, -1.0, 1)


execution_in_compiled_code = compiled_for_session(lambda *given: execution_of(*given))


@pytest.mark.parametrize("execute", [execution_of, execution_in_compiled_code])
@pytest.mark.parametrize("action", [-1, 3, 10**9, 1.5, -0.5, np.nan, np.inf])
def test_an_action_that_there_is_not_is_refused(execute, action):
    with pytest.raises(RequestError, match=r"whole number in \[0, number of actions\)"):
        execute(Decision(action, 0.5, False), False, 3)


@pytest.mark.parametrize("execute", [execution_of, execution_in_compiled_code])
@pytest.mark.parametrize("probability", [2.0, 1 + 1e-15, -1e-300, np.nan, -np.inf])
def test_a_probability_outside_0_and_1_is_refused(execute, probability):
    with pytest.raises(RequestError, match=r"does not lie in \[0, 1\]"):
        execute(Decision(1, probability, False), False, 3)


@pytest.mark.parametrize("execute", [execution_of, execution_in_compiled_code])
@pytest.mark.parametrize("probability", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("action", [0, 2, np.int64(1), 2.0])
def test_what_can_be_done_is_executed(execute, action, probability):
    found = execute(Decision(action, probability, False), True, 3)
    assert found == (action, True, probability)
    assert isinstance(found.executed, int)


def test_a_rule_may_leave_undo_out():
    assert Decision(1, 0.5) == (1, 0.5, False)
