import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant
from qbumpers.assistants.hard_bumpers import HardBumpersOptions, hard_bumpers
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

options_of_any_kind = st.builds(
    HardBumpersOptions,
    alpha=fractions(0, 1, 16),
    v_min=fractions(-100, 0, 4),
    second=st.booleans(),
)


@given(situations(), noises, options_of_any_kind)
def test_agrees_with_the_plain_rule(situation, noise, options):
    expected = plain.hard_bumpers(situation, noise, **options._asdict())
    assert_decides(hard_bumpers, situation, noise, options, expected)


@given(situations(), noises, options_of_any_kind)
def test_never_overrides_by_an_action_that_is_no_better(situation, noise, options):
    assert_overrides_only_by_better(hard_bumpers, situation, noise, options)


@pytest.mark.parametrize(("own", "decision"), [(50.0, Decision(0, 0.0)), (49.75, Decision(1, 1.0))])
def test_the_line_is_the_lower_value_which_itself_is_allowed(own, decision):
    # The lower value is 100 - 0.5 * 100 = 50.
    situation = situation_of([own, 90.0, 80.0], 0, start_value=100.0)
    assert hard_bumpers(situation, Noise(0.0, 0.5), HardBumpersOptions(0.5)) == decision


def test_what_was_lost_before_counts_and_the_candidate_replaces():
    # 60 lost of the 50 that may be: 100 - (-40 + 80).
    situation = situation_of([80.0, 90.0, 85.0], 0, earned=-40.0, start_value=100.0)
    noise = Noise(0.999, 0.5)
    assert hard_bumpers(situation, noise, HardBumpersOptions(0.5)) == Decision(1, 1.0)
    second = HardBumpersOptions(0.5, second=True)
    assert hard_bumpers(situation, noise, second) == Decision(2, 1.0)


def test_a_loss_of_nine_tenths_is_allowed_which_bumpers_nearly_always_override():
    situation, noise = situation_of([10.0, 100.0], 0, start_value=100.0), Noise(0.9, 0.5)
    assert hard_bumpers(situation, noise, HardBumpersOptions(1.0)) == Decision(0, 0.0)
    decision = bumpers(situation, noise, alpha=1.0)
    assert decision.action == 1
    assert decision.probability > 0.99


@pytest.mark.parametrize(
    ("options", "message"),
    [({"alpha": 1.1}, "alpha = 1.1"), ({"alpha": 0.5, "v_min": float("inf")}, "v_min = inf")],
)
def test_options_have_bounds(options, message):
    with pytest.raises(RequestError, match=f"assistant hard-bumpers: {message}"):
        make_assistant("hard-bumpers", **options)


def test_the_lower_bound_must_lie_below_the_value_of_the_start():
    with pytest.raises(RequestError, match=r"v_min = 0 must be below .*V\*\(s_0\) = -1"):
        make_assistant("hard-bumpers", alpha=0.5).check_start(-1.0)
