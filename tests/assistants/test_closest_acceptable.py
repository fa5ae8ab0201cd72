from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.assistants.closest_acceptable import ClosestAcceptableOptions, closest_acceptable
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import cliff_walking
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import fractions, noises, situation_of, situations
from tests.reference_rules import PlainClosestAcceptable

NOISE = Noise(0.5, 0.75)
IN_A_ROW = np.abs(np.subtract.outer(np.arange(5.0), np.arange(5.0)))


class Placed:
    """A task whose actions have places, as the plain rule asks for it."""

    def __init__(self, action_distance):
        self.action_distance = action_distance


def decide(values, proposed, alpha, distance=IN_A_ROW, noise=NOISE):
    options: Any = ClosestAcceptableOptions(alpha)
    return closest_acceptable(
        situation_of(values, proposed, start_value=87.0), noise, options, distance
    )


@given(situations(), noises, fractions(0, 1, 16), st.permutations(range(5)))
def test_agrees_with_the_plain_rule(situation, noise, alpha, order):
    order = [place for place in order if place < len(situation.values)]
    apart = IN_A_ROW[np.ix_(order, order)]
    distance = np.ascontiguousarray((apart + 1) // 2)  # so that some are equally far
    expected = PlainClosestAcceptable(alpha, Placed(distance)).decide(situation, noise)
    options = ClosestAcceptableOptions(alpha)
    for function in (closest_acceptable, closest_acceptable.py_func):  # type: ignore[attr-defined]
        assert function(situation, noise, options, distance) == Decision(*expected)


def test_the_nearest_acceptable_action_is_executed_though_a_better_one_is_farther_away():
    # Q' is 0, 60, 80, 100 and at least 50 is acceptable.
    assert decide([-20.0, 40.0, 60.0, 80.0], 0, 0.5) == Decision(1, 1.0)


def test_what_is_just_acceptable_stays():
    assert decide([0.0, 50.0, 100.0], 1, 0.5) == Decision(1, 0.0)
    assert decide([0.0, 49.0, 100.0], 1, 0.5) == Decision(2, 1.0)


def test_of_equally_near_actions_the_best_and_of_these_one_by_chance():
    assert decide([90.0, 0.0, 100.0], 1, 0.5) == Decision(2, 1.0)
    for tie, action in ((0.0, 0), (0.499, 0), (0.5, 2), (0.999, 2)):
        assert decide([90.0, 0.0, 90.0, 95.0], 1, 0.5, noise=Noise(0.5, tie)).action == action


def test_alpha_0_leaves_best_actions_alone_and_alpha_1_all():
    values = [3.0, 1.0, 2.0, 3.0]
    assert [decide(values, each, 0.0).action for each in range(4)] == [0, 0, 3, 3]
    assert [decide(values, each, 1.0).action for each in range(4)] == [0, 1, 2, 3]


def test_a_neighbour_that_will_do_is_executed_and_bumpers_execute_the_best():
    values = [-13.0, 92.0, 94.0]
    assert decide(values, 0, 0.1) == Decision(1, 1.0)
    situation = situation_of(values, 0, start_value=87.0)
    assert bumpers(situation, NOISE) == Decision(2, 1.0)


def test_a_task_without_distances_is_refused():
    with pytest.raises(RequestError, match="cliff-walking has no distance between actions"):
        simulate(cliff_walking(), make_assistant("closest-acceptable", alpha=0.5))


@pytest.mark.parametrize("alpha", [-0.5, 1.5])
def test_alpha_is_a_share(alpha):
    with pytest.raises(RequestError, match=f"closest-acceptable: alpha = {alpha}"):
        make_assistant("closest-acceptable", alpha=alpha)
