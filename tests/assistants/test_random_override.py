import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant
from qbumpers.assistants.random_override import RandomOverrideOptions, random_override
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
    RandomOverrideOptions, probability=fractions(0, 1, 16), second=st.booleans()
)


@given(situations(), noises, options_of_any_kind)
def test_agrees_with_the_plain_rule(situation, noise, options):
    expected = plain.random_override(situation, noise, **options._asdict())
    assert_decides(random_override, situation, noise, options, expected)


@given(situations(), noises, options_of_any_kind)
def test_never_overrides_by_an_action_that_is_no_better(situation, noise, options):
    assert_overrides_only_by_better(random_override, situation, noise, options)


@pytest.mark.parametrize(("coin", "action"), [(0.0, 1), (0.2499, 1), (0.25, 0), (0.999, 0)])
def test_the_coin_alone_decides_about_a_worse_proposal(coin, action):
    for worse in (-1000.0, 1.75):
        situation = situation_of([worse, 2.0], 0)
        found = random_override(situation, Noise(coin, 0.5), RandomOverrideOptions(0.25))
        assert found == Decision(action, 0.25)


def test_every_other_fall_happens_which_bumpers_all_but_rule_out():
    # Beside the cliff at (2, 6) of Cliff Walking after nine steps; down falls.
    situation = situation_of([92.0, 94.0, -13.0, 92.0], 2, earned=-9.0, start_value=87.0)
    noise = Noise(0.5, 0.5)
    assert random_override(situation, noise, RandomOverrideOptions(0.5)) == Decision(2, 0.5)
    assert bumpers(situation, noise) == Decision(1, 1.0)


@pytest.mark.parametrize("probability", [-0.1, 1.1])
def test_the_probability_is_one(probability):
    with pytest.raises(RequestError, match=f"random-override: probability = {probability}"):
        make_assistant("random-override", probability=probability)
