from hypothesis import given

from qbumpers.assistants.maximal import MaximalOptions, maximal
from qbumpers.decisions import Decision
from tests import reference_simulation as plain
from tests.assistants.situations import (
    assert_decides,
    assert_overrides_only_by_better,
    noises,
    situations,
)


@given(situations(), noises)
def test_agrees_with_the_plain_rule(situation, noise):
    assert_decides(maximal, situation, noise, MaximalOptions(), plain.maximal(situation, noise))


@given(situations(), noises)
def test_executes_a_best_action_and_keeps_the_proposal_where_it_is_one(situation, noise):
    values = situation.values
    decision = maximal(situation, noise, MaximalOptions())
    assert values[decision.action] == values.max()
    if values[situation.proposed] == values.max():
        assert decision == Decision(situation.proposed, 0.0)
    else:
        assert decision.probability == 1.0


@given(situations(), noises)
def test_never_overrides_by_an_action_that_is_no_better(situation, noise):
    assert_overrides_only_by_better(maximal, situation, noise, MaximalOptions())
