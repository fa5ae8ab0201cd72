from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.assistants.stochastic_q_bumpers import (
    StochasticQBumpersOptions,
    logistic,
    override_probability,
    stochastic_q_bumpers,
)
from qbumpers.decisions import Decision, Noise
from tests import reference_simulation as plain
from tests.assistants.situations import (
    PROBABILITY_TOLERANCE,
    assert_decides,
    assert_overrides_only_by_better,
    fractions,
    noises,
    situation_of,
    situations,
)

SECOND, BEST = 1, 2

some_p_max = st.sampled_from([0.999, 0.9, 0.51])
options_of_any_kind = st.builds(
    StochasticQBumpersOptions,
    alpha=fractions(0, 1, 16),
    v_min=fractions(-100, 0, 4),
    p_max=some_p_max,
    second=st.booleans(),
    escalate=st.booleans(),
    clip=st.booleans(),
)


@given(situations(), noises, options_of_any_kind)
def test_agrees_with_the_plain_rule(situation, noise, options):
    expected = plain.stochastic_q_bumpers(situation, noise, **options._asdict())
    assert_decides(stochastic_q_bumpers, situation, noise, options, expected)


@given(situations(), noises, options_of_any_kind)
def test_never_overrides_by_an_action_that_is_no_better(situation, noise, options):
    assert_overrides_only_by_better(stochastic_q_bumpers, situation, noise, options)


@given(situations(), noises, options_of_any_kind)
def test_alpha_0_overrides_every_action_worse_than_the_candidate(situation, noise, options):
    options = options._replace(alpha=0.0)
    candidate = plain.replacement_value(situation.values.tolist(), options.second)
    decision = stochastic_q_bumpers(situation, noise, options)
    if situation.values[situation.proposed] >= candidate:
        assert decision == Decision(situation.proposed, 0.0)
    else:
        assert decision.probability == 1.0
        assert situation.values[decision.action] >= candidate


@given(situations(), noises, options_of_any_kind)
def test_an_escalated_override_executes_a_best_action_surely(situation, noise, options):
    options = options._replace(escalate=True, second=True)
    values, proposed = situation.values, situation.proposed
    earned, discount, start_value = situation.earned, situation.discount, situation.start_value
    candidate = plain.replacement_value(values.tolist(), True)
    lower_value = start_value - options.alpha * (start_value - options.v_min)
    decision = stochastic_q_bumpers(situation, noise, options)
    if values[proposed] < candidate and earned + discount * candidate <= lower_value:
        assert values[decision.action] == values.max()
        assert decision.probability == 1.0
    else:
        assert decision.action == proposed or values[decision.action] == candidate


@given(some_p_max)
def test_logistic_goes_from_1_minus_p_max_through_a_half_to_p_max(p_max):
    assert logistic(0.0, p_max) == pytest.approx(1 - p_max, abs=PROBABILITY_TOLERANCE)
    assert logistic(0.5, p_max) == 0.5
    assert logistic(1.0, p_max) == pytest.approx(p_max, abs=PROBABILITY_TOLERANCE)


@given(st.floats(-1e6, 1e6), some_p_max)
def test_logistic_is_geometric_in_the_odds(ratio, p_max):
    expected = plain.logistic(ratio, p_max)
    assert logistic(ratio, p_max) == pytest.approx(expected, abs=PROBABILITY_TOLERANCE)


@given(st.floats(-500, 500), fractions(0, 100, 4), some_p_max)
def test_clipping_is_certain_outside_the_interval_and_logistic_inside(lost, room, p_max):
    probability = override_probability(lost, room, p_max, True)
    if room == 0 or lost >= room:
        assert probability == 1.0
    elif lost <= 0:
        assert probability == 0.0
    else:
        assert probability == pytest.approx(plain.logistic(lost / room, p_max), abs=1e-12)


@given(st.floats(-500, 500), fractions(1, 100, 4), some_p_max)
def test_without_clipping_every_ratio_goes_through_the_logistic(lost, room, p_max):
    probability = override_probability(lost, room, p_max, False)
    assert probability == pytest.approx(plain.logistic(lost / room, p_max), abs=1e-12)


@given(
    st.lists(st.floats(-500, 500), min_size=2, max_size=10),
    fractions(0, 100, 4),
    some_p_max,
    st.booleans(),
)
def test_probability_never_falls_as_more_return_is_lost(losses, room, p_max, clip):
    found = [override_probability(lost, room, p_max, clip) for lost in sorted(losses)]
    assert all(less <= more for less, more in pairwise(found))
    assert all(0 <= probability <= 1 for probability in found)


@given(situations(), noises, options_of_any_kind, st.lists(fractions(-100, 100, 4), min_size=2))
def test_worse_proposals_are_overridden_with_no_smaller_probability(
    situation, noise, options, own_values
):
    best = 101.0
    found = []
    for own in sorted(own_values):
        moment = situation._replace(values=np.array([own, best]), proposed=0)
        found.append(stochastic_q_bumpers(moment, noise, options).probability)
    assert all(worse >= better for worse, better in pairwise(found))


@pytest.mark.parametrize("proposed", [0, 2])
def test_coin_below_the_probability_overrides_and_at_it_does_not(proposed):
    # V = 87, earned -10, so Q* 86 loses 11 of the 60.9 that alpha 0.7 allows.
    situation = situation_of([86.0, 97.0, 86.0, 90.0], proposed, -10.0, start_value=87.0)
    options = StochasticQBumpersOptions(0.7)
    probability = stochastic_q_bumpers(situation, Noise(0.5, 0.5), options).probability
    assert probability == pytest.approx(plain.logistic(11 / 60.9, 0.999), abs=1e-12)
    below, at = Noise(np.nextafter(probability, 0.0), 0.5), Noise(probability, 0.5)
    assert stochastic_q_bumpers(situation, below, options) == Decision(1, probability)
    assert stochastic_q_bumpers(situation, at, options) == Decision(proposed, probability)


@pytest.mark.parametrize(
    ("candidate", "executed"), [(50.0, BEST), (50.25, SECOND)], ids=["at the value", "above it"]
)
def test_escalation_begins_where_the_candidate_only_reaches_the_lower_value(candidate, executed):
    # The lower value is 100 - 0.5 * 100 = 50.
    situation = situation_of([40.0, candidate, 60.0], 0, start_value=100.0)
    options = StochasticQBumpersOptions(0.5, second=True)
    assert stochastic_q_bumpers(situation, Noise(0.9999, 0.5), options) == Decision(executed, 1.0)


@pytest.mark.parametrize(("clip", "probability"), [(True, 1.0), (False, 0.999)])
def test_an_action_that_loses_all_the_room_is_overridden_surely_where_clipped(clip, probability):
    situation = situation_of([50.0, 60.0, 90.0], 0, start_value=100.0)
    decision = stochastic_q_bumpers(
        situation, Noise(0.5, 0.5), StochasticQBumpersOptions(0.5, clip=clip)
    )
    assert decision.action == BEST
    assert decision.probability == pytest.approx(probability, abs=PROBABILITY_TOLERANCE)
