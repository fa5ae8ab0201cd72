import pytest
from hypothesis import given

from qbumpers.assistants.correct import CorrectOptions, correct
from qbumpers.assistants.maximal import MaximalOptions, maximal
from qbumpers.decisions import Decision, Noise
from tests import reference_rules as plain
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import (
    assert_decides,
    assert_overrides_only_by_better,
    fractions,
    noises,
    situation_of,
    situations,
)

NOISE = Noise(0.5, 0.5)


@given(situations(), noises, fractions(0, 50, 4))
def test_agrees_with_the_plain_rule(situation, noise, tolerance):
    expected = plain.correct(situation, noise, tolerance)
    assert_decides(correct, situation, noise, CorrectOptions(tolerance), expected)
    assert_overrides_only_by_better(correct, situation, noise, CorrectOptions(tolerance))


@given(situations(), noises)
def test_without_tolerance_it_is_maximal_assistance(situation, noise):
    found = correct(situation, noise, CorrectOptions())
    assert found == maximal(situation, noise, MaximalOptions())


@pytest.mark.parametrize(("own", "action"), [(7.0, 0), (6.75, 1)])
def test_a_loss_above_the_tolerance_is_corrected(own, action):
    assert correct(situation_of([own, 9.0], 0), NOISE, CorrectOptions(2.0)).action == action


def test_a_step_backwards_at_the_start_is_corrected_which_bumpers_let_pass():
    situation = situation_of([85.0, 87.0], 0, start_value=87.0)
    assert correct(situation, NOISE, CorrectOptions()) == Decision(1, 1.0)
    assert bumpers(situation, NOISE).action == 0
