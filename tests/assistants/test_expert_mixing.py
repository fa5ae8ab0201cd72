import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant
from qbumpers.assistants.expert_mixing import ExpertMixingOptions, expert_mixing
from qbumpers.decisions import Decision, Noise
from tests import reference_rules as plain
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import (
    assert_decides,
    fractions,
    noises,
    situation_of,
    situations,
)

options_of_any_kind = st.builds(
    ExpertMixingOptions, share=fractions(0, 1, 4), decay=st.sampled_from([0.0, 0.5, 1.0])
)


@given(situations(), noises, options_of_any_kind, st.integers(0, 9))
def test_agrees_with_the_plain_rule(situation, noise, options, episode):
    situation = situation._replace(episode=episode)
    expected = plain.expert_mixing(situation, noise, **options._asdict())
    assert_decides(expert_mixing, situation, noise, options, expected)


@pytest.mark.parametrize(("episode", "beta"), [(0, 0.8), (1, 0.4), (2, 0.2), (3, 0.1)])
def test_the_experts_share_falls_by_a_factor_per_episode(episode, beta):
    situation = situation_of([1.0, 3.0], 0)._replace(episode=episode)
    options = ExpertMixingOptions(0.8, 0.5)
    assert expert_mixing(situation, Noise(beta - 0.01, 0.5), options).action == 1
    found = expert_mixing(situation, Noise(beta + 0.01, 0.5), options)
    assert found.action == 0
    assert found.probability == pytest.approx(beta, abs=1e-12)


def test_without_decay_the_share_stays():
    situation = situation_of([1.0, 3.0], 0)._replace(episode=500)
    assert expert_mixing(situation, Noise(0.6, 0.5), ExpertMixingOptions(0.75, 1.0)).action == 1


def test_first_a_trifle_is_mended_and_later_a_fall_happens_unlike_with_bumpers():
    noise, options = Noise(0.5, 0.5), ExpertMixingOptions()
    trifle = situation_of([85.0, 87.0], 0, start_value=87.0)
    fall = situation_of([-13.0, 94.0], 0, start_value=87.0)._replace(episode=50)
    assert expert_mixing(trifle, noise, options) == Decision(1, 1.0)
    assert bumpers(trifle, noise).action == 0
    assert expert_mixing(fall, noise, options).action == 0
    assert bumpers(fall, noise) == Decision(1, 1.0)


@pytest.mark.parametrize(("option", "value"), [("share", 1.5), ("decay", -0.5), ("decay", 1.25)])
def test_options_are_shares(option, value):
    with pytest.raises(RequestError, match=f"expert-mixing: {option} = {value}"):
        make_assistant("expert-mixing", **{option: value})
