"""The records that every host shares, and the projected return."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.decisions import Decision, Noise, Situation, Step, projected_return

rewards = st.lists(st.floats(-100, 100), max_size=20)


@given(rewards, st.floats(0.1, 1), st.floats(-100, 100))
def test_projected_return_is_the_discounted_sum_of_rewards_and_value(past, discount, value):
    powers = discount ** np.arange(len(past) + 1)
    earned = float(np.sum(powers[:-1] * past))
    expected = float(np.sum(powers * [*past, value]))
    assert projected_return(earned, powers[-1], value) == pytest.approx(expected, abs=1e-9)


def test_projected_return_at_the_start_is_the_value_itself():
    assert projected_return(0.0, 1.0, 87.0) == 87.0


@pytest.mark.parametrize(
    ("record", "fields"),
    [
        (Situation, "values proposed earned discount start_value"),
        (Noise, "coin tie"),
        (Decision, "action probability"),
        (
            Step,
            "proposed executed credited overridden probability coin tie values projected_return "
            "reward",
        ),
    ],
    ids=lambda item: getattr(item, "__name__", ""),
)
def test_records_keep_the_fields_that_stored_sessions_and_rules_rely_on(record, fields):
    assert list(record._fields) == fields.split()
