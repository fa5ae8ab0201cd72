"""Greedy choice and `AgentAction` against plain Python."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.choice import best_value, candidate_value, pick, second_value, worst_value

# Whole numbers make ties common; the others make sure that nothing is rounded.
some_values = st.lists(
    st.integers(-3, 3).map(float) | st.floats(-1e9, 1e9), min_size=1, max_size=6
).map(np.array)
chances = st.floats(0, 1, exclude_max=True)


@given(some_values)
def test_best_and_worst_are_the_extremes(values):
    assert best_value(values) == max(values.tolist())
    assert worst_value(values) == min(values.tolist())


@given(some_values)
def test_second_is_the_next_distinct_value_below_the_best(values):
    distinct = sorted(set(values.tolist()))
    assert second_value(values) == (distinct[-2] if len(distinct) > 1 else distinct[-1])


@given(some_values, st.booleans())
def test_candidate_is_second_or_best_as_asked(values, second):
    expected = second_value(values) if second else best_value(values)
    assert candidate_value(values, second) == expected


@given(some_values, st.data(), chances)
def test_pick_returns_an_action_of_the_target_value(values, data, tie):
    target = data.draw(st.sampled_from(values.tolist()))
    assert values[pick(values, target, tie)] == target


@given(some_values, st.data(), st.integers(1, 4))
def test_pick_spreads_ties_evenly_over_equal_actions(values, data, each):
    target = data.draw(st.sampled_from(values.tolist()))
    equal = np.flatnonzero(values == target)
    ties = (np.arange(each * len(equal)) + 0.5) / (each * len(equal))
    picked = [pick(values, target, tie) for tie in ties]
    assert picked == np.repeat(equal, each).tolist()


@pytest.mark.parametrize("actions", range(1, 65))
def test_pick_stays_within_the_equal_actions_at_the_ends_of_the_interval(actions):
    values = np.zeros(actions)
    assert pick(values, 0.0, 0.0) == 0
    assert pick(values, 0.0, np.nextafter(1.0, 0.0)) == actions - 1


@pytest.mark.parametrize(
    "function",
    [best_value, worst_value, second_value, candidate_value, pick],
    ids=lambda f: f.__name__,
)
@given(values=some_values, second=st.booleans(), tie=chances)
def test_compiled_and_interpreted_choices_are_the_same(function, values, second, tie):
    arguments = {"candidate_value": (second,), "pick": (values[0], tie)}.get(function.__name__, ())
    assert function(values, *arguments) == function.py_func(values, *arguments)
