import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant
from qbumpers.conformance import check_conformance, slippery_corridor
from qbumpers.decisions import Decision, Noise
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import model_of, situation_of, situations

FALL = situation_of([-13.0, 94.0], 0, start_value=87.0)
HALF = {"name": "random-override", "probability": 0.5}


def decide(of, situation, episode, coin, half_life=2.0):
    assistant = make_assistant("fading", of=of, half_life=half_life)
    memory = assistant.start(model_of())
    return assistant.decide(situation._replace(episode=episode), Noise(coin, 0.5), memory)


@pytest.mark.parametrize(("episode", "kept"), [(0, 1.0), (2, 0.5), (4, 0.25), (6, 0.125)])
def test_the_share_of_overrides_that_is_kept_halves_with_each_half_life(episode, kept):
    assert decide("maximal", FALL, episode, kept - 0.001) == Decision(1, kept)
    if kept < 1:
        assert decide("maximal", FALL, episode, kept) == Decision(0, kept)


@pytest.mark.parametrize("episode", [0, 1, 3])
def test_of_a_random_rule_the_same_share_is_kept_over_all_coins(episode):
    coins = (np.arange(4000) + 0.5) / 4000
    found = [decide(HALF, FALL, episode, coin) for coin in coins]
    expected = 0.5 * 2 ** (-episode / 2)
    assert np.mean([decision.action == 1 for decision in found]) == pytest.approx(
        expected, abs=1e-3
    )
    assert {decision.probability for decision in found} == {expected}


@given(situations(), st.floats(0, 1, exclude_max=True), st.integers(0, 20))
def test_it_overrides_only_if_the_other_rule_does_and_then_alike(situation, coin, episode):
    of = {"name": "stochastic-q-bumpers", "alpha": 0.5}
    own = make_assistant(**of).decide(situation._replace(episode=episode), Noise(coin, 0.5))
    found = decide(of, situation, episode, coin)
    assert found.action in (own.action, situation.proposed)
    assert found.probability == own.probability * 2 ** (-episode / 2)


def test_an_undone_step_fades_too():
    assert decide("undo", FALL, 2, 0.4) == Decision(0, 0.5, True)
    assert decide("undo", FALL, 2, 0.6) == Decision(0, 0.5, False)


def test_falls_happen_in_late_episodes_which_the_bumpers_below_go_on_stopping():
    of = {"name": "stochastic-q-bumpers", "alpha": 0.7}
    assert decide(of, FALL, 10, 0.5).action == 0
    assert bumpers(FALL._replace(episode=10), Noise(0.5, 0.5)) == Decision(1, 1.0)


@pytest.mark.parametrize("half_life", [0.0, -1.0, float("inf")])
def test_the_half_life_is_a_finite_number_above_0(half_life):
    with pytest.raises(RequestError, match=f"assistant fading: half_life = {half_life}"):
        make_assistant("fading", of="maximal", half_life=half_life)


def test_over_a_rule_that_undoes_it_does_the_same_in_every_host():
    assistant = make_assistant("fading", of="undo", half_life=2.0)
    assert assistant.needs == {"undo"}
    assert check_conformance(assistant, tasks=[slippery_corridor()])
