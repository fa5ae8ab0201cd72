import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.assistants.penalised_interventions import (
    PenalisedInterventionsOptions,
    next_price,
    penalised_interventions,
)
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import cliff_walking
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import (
    fractions,
    model_of,
    noises,
    situation_of,
    situations,
    step_of,
)
from tests.reference_rules import PlainPenalised

NOISE = Noise(0.5, 0.5)
SITUATION = situation_of([85.0, 87.0], 0, start_value=87.0)


@given(situations(), noises, fractions(0, 20, 4))
def test_agrees_with_the_plain_rule(situation, noise, price):
    expected = Decision(*PlainPenalised(0.5, price=price).decide(situation, noise))
    options = PenalisedInterventionsOptions(0.5)
    for function in (penalised_interventions, penalised_interventions.py_func):  # type: ignore[attr-defined]
        assert function(situation, noise, options, price) == expected


@pytest.mark.parametrize(("price", "action"), [(1.75, 1), (2.0, 0), (2.25, 0)])
def test_only_a_gain_above_the_price_is_worth_an_override(price, action):
    options = PenalisedInterventionsOptions(0.5)
    assert penalised_interventions(SITUATION, NOISE, options, price).action == action


def test_an_override_raises_the_price_by_what_is_above_the_target_and_others_lower_it_to_0():
    options, price, found = PenalisedInterventionsOptions(0.25, 1.0), 0.5, []
    for executed in (1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1):
        price = next_price(price, step_of(SITUATION, executed), options)
        found.append(price)
    assert found == [1.25, 2.0, 1.75, 1.5, 1.25, 1.0, 0.75, 0.5, 0.25, 0.0, 0.75]
    undone = step_of(SITUATION, 0, undone=True)
    assert next_price(0.0, undone, options) == 0.75


@given(st.lists(fractions(0, 8, 4), min_size=200, max_size=200))
def test_the_share_of_overrides_is_at_most_the_target_up_to_what_the_price_holds(gains):
    # The price sums up rate (override - target), so the overrides beyond the target are bounded by
    # the largest price, which no override passes by more than one step of it.
    target, rate = 0.25, 1.0
    assistant = make_assistant("penalised-interventions", target=target, rate=rate)
    memory, overrides = assistant.start(model_of()), 0
    for gain in gains:
        situation = situation_of([10.0 - gain, 10.0], 0)
        decision = assistant.decide(situation, NOISE, memory)
        overrides += decision.action != 0
        memory = assistant.observe(memory, step_of(situation, decision.action))
    assert overrides - target * len(gains) <= (8 + rate) / rate


def test_in_a_simulation_the_target_is_approached():
    assistant = make_assistant("penalised-interventions", target=0.125, rate=10.0)
    found = simulate(cliff_walking(), assistant, trials=8, episodes=100).outcomes
    late = slice(50, None)
    share = found.overrides[:, late].sum() / found.assisted_length[:, late].sum()
    assert share == pytest.approx(0.125, abs=0.03)


def test_at_price_0_a_trifle_is_mended_which_bumpers_let_pass():
    options = PenalisedInterventionsOptions(0.25)
    assert penalised_interventions(SITUATION, NOISE, options, 0.0) == Decision(1, 1.0)
    assert bumpers(SITUATION, NOISE).action == 0


@pytest.mark.parametrize(
    ("option", "value"), [("target", 1.5), ("rate", -1.0), ("price", float("inf"))]
)
def test_options_have_bounds(option, value):
    options = {"target": 0.5, option: value}
    with pytest.raises(RequestError, match=f"penalised-interventions: {option} = {value}"):
        make_assistant("penalised-interventions", **options)
