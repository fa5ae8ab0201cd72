import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.errors import RequestError
from qbumpers.learners import PERCEPTIONS, perceive, perception
from tests.reference_simulation import learned_from

PROPOSED, EXECUTED, REWARD, PENALTY = 1, 2, -1.0, 5.0

actions = st.integers(0, 5)
amounts = st.floats(-100, 100)


@pytest.mark.parametrize(
    ("name", "action", "reward"),
    [
        ("transition", PROPOSED, REWARD),
        ("observant", EXECUTED, REWARD),
        ("disruption", EXECUTED, REWARD - PENALTY),
        ("transition-disruption", PROPOSED, REWARD - PENALTY),
    ],
)
def test_an_overridden_step_is_credited_and_felt_as_the_model_says(name, action, reward):
    experience = perceive(perception(name), PROPOSED, EXECUTED, REWARD, PENALTY)
    assert experience == (action, reward)


def test_interruption_learns_nothing_from_an_overridden_step():
    assert perceive(perception("interruption"), PROPOSED, EXECUTED, REWARD, PENALTY).action == -1


@pytest.mark.parametrize("name", PERCEPTIONS)
def test_a_step_without_override_is_read_as_it_is(name):
    assert perceive(perception(name), PROPOSED, PROPOSED, REWARD, PENALTY) == (PROPOSED, REWARD)


@pytest.mark.parametrize("name", PERCEPTIONS)
@given(proposed=actions, executed=actions, reward=amounts, penalty=amounts)
def test_compiled_and_interpreted_agree_with_the_plain_table(
    name, proposed, executed, reward, penalty
):
    expected = learned_from(name, proposed, executed, reward, penalty)
    for function in (perceive, perceive.py_func):
        found = function(perception(name), proposed, executed, reward, penalty)
        assert found.action == (-1 if expected is None else expected[0])
        assert expected is None or found.reward == expected[1]


def test_an_unknown_perception_is_refused_with_the_nearest_name():
    with pytest.raises(RequestError, match=r"perception 'observing'.*did you mean 'observant'"):
        perception("observing")
