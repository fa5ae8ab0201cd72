import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.assistants.local_q_thresholding import (
    LocalQThresholdingOptions,
    local_q_thresholding,
)
from qbumpers.decisions import Decision, Noise
from tests import reference_simulation as plain
from tests.assistants.situations import (
    assert_decides,
    assert_overrides_only_by_better,
    fractions,
    noises,
    situation_of,
    situations,
)

options_of_any_kind = st.builds(
    LocalQThresholdingOptions, alpha=fractions(0, 1, 16), second=st.booleans()
)

UP, RIGHT, DOWN, LEFT = range(4)
BESIDE_THE_CLIFF = np.array([92.0, 94.0, -13.0, 92.0])  # at (2, 6), up right down left
ONE_ROW_UP = np.array([91.0, 93.0, 93.0, 91.0])  # at (1, 6)
THRESHOLD = (94 - 92) / (94 + 13)


def decide(values, proposed, alpha, second=False):
    situation = situation_of(values, proposed, start_value=87.0)
    return local_q_thresholding(
        situation, Noise(0.5, 0.0), LocalQThresholdingOptions(alpha, second)
    )


@given(situations(), noises, options_of_any_kind)
def test_agrees_with_the_plain_rule(situation, noise, options):
    expected = plain.local_q_thresholding(situation, noise, **options._asdict())
    assert_decides(local_q_thresholding, situation, noise, options, expected)


@given(situations(), noises, options_of_any_kind)
def test_never_overrides_by_an_action_that_is_no_better(situation, noise, options):
    assert_overrides_only_by_better(local_q_thresholding, situation, noise, options)


@given(situations(), noises, st.booleans())
def test_alpha_1_never_overrides(situation, noise, second):
    decision = local_q_thresholding(situation, noise, LocalQThresholdingOptions(1.0, second))
    assert decision == Decision(situation.proposed, 0.0)


@given(situations(), noises, st.booleans())
def test_alpha_0_overrides_every_action_worse_than_the_candidate(situation, noise, second):
    decision = local_q_thresholding(situation, noise, LocalQThresholdingOptions(0.0, second))
    candidate = plain.replacement_value(situation.values.tolist(), second)
    worse = situation.values[situation.proposed] < candidate
    assert decision.probability == float(worse)
    assert situation.values[decision.action] == (
        candidate if worse else situation.values[situation.proposed]
    )


@pytest.mark.parametrize("proposed", [UP, LEFT])
@pytest.mark.parametrize(("alpha", "overridden"), [(THRESHOLD - 1e-9, 1), (THRESHOLD + 1e-9, 0)])
def test_beside_the_cliff_moving_away_is_overridden_below_the_papers_threshold(
    proposed, alpha, overridden
):
    decision = decide(BESIDE_THE_CLIFF, proposed, alpha)
    assert decision == Decision(*(RIGHT, 1.0) if overridden else (proposed, 0.0))


@pytest.mark.parametrize("alpha", [0.0, THRESHOLD, 0.5, 0.999])
def test_beside_the_cliff_stepping_off_is_overridden_at_every_alpha_below_1(alpha):
    assert decide(BESIDE_THE_CLIFF, DOWN, alpha) == Decision(RIGHT, 1.0)


@pytest.mark.parametrize("alpha", [0.0, THRESHOLD, 0.5, 0.999])
@pytest.mark.parametrize("proposed", [UP, LEFT])
def test_one_row_up_moving_away_is_overridden_at_every_alpha_below_1(proposed, alpha):
    assert decide(ONE_ROW_UP, proposed, alpha) == Decision(RIGHT, 1.0)


def test_one_row_up_nothing_is_worse_than_the_second_best():
    for proposed in range(4):
        assert decide(ONE_ROW_UP, proposed, 0.0, second=True) == Decision(proposed, 0.0)


def test_second_best_replaces_the_step_off_the_cliff():
    assert decide(BESIDE_THE_CLIFF, DOWN, 0.5, second=True) == Decision(UP, 1.0)
