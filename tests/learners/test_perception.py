from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.compilation import uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import PERCEPTIONS, Perception, perceive, perception
from qbumpers.learners.perception import believed
from qbumpers.registration import as_numbers
from tests.reference_simulation import learned_from, perceived

PROPOSED, EXECUTED, REWARD, PENALTY = 1, 2, -1.0, 5.0

actions = st.integers(0, 5)
amounts = st.floats(-100, 100)
chances = st.floats(0, 1, exclude_max=True)


def named(name, penalty=PENALTY):
    """A perception by name, as numbers; its penalty is another if it has one."""
    found = perception(name)
    return as_numbers(found._replace(penalty=penalty * found.penalty))


def read(perception, executed, *, undone=False, coin=0.0):
    return perceive(perception, PROPOSED, executed, undone, REWARD, coin)


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
    assert read(named(name), EXECUTED)[:2] == (action, reward)


def test_interruption_learns_nothing_from_an_overridden_step():
    assert read(named("interruption"), EXECUTED).action == -1


@pytest.mark.parametrize(
    ("name", "led_back"),
    [
        ("transition", True),
        ("transition-disruption", True),
        ("observant", False),
        ("disruption", False),
    ],
)
def test_who_credits_the_own_action_with_an_undone_step_believes_that_it_led_back(name, led_back):
    experience = read(named(name), PROPOSED, undone=True)
    assert experience.led_back == led_back
    transition = believed(experience, 7, 9, True)
    # If it led back, nothing ended; if it is seen to have led on, that would have ended.
    expected = (7, 7, False) if led_back else (7, 9, True)
    assert (transition.state, transition.next_state, transition.terminated) == expected


@pytest.mark.parametrize("coin", [0.0, 0.29, 0.3, 0.99])
@pytest.mark.parametrize(("credit", "noticed"), [("executed", EXECUTED), ("nothing", -1)])
def test_an_override_is_noticed_if_the_coin_falls_below_the_probability(coin, credit, noticed):
    found = read(as_numbers(Perception(0.3, credit, PENALTY)), EXECUTED, coin=coin)
    assert found.action == (noticed if coin < 0.3 else PROPOSED)
    assert found.reward == (REWARD - PENALTY if coin < 0.3 else REWARD)


@pytest.mark.parametrize("name", PERCEPTIONS)
def test_a_step_without_override_is_read_as_it_is(name):
    assert read(named(name), PROPOSED) == (PROPOSED, REWARD, False)


@pytest.mark.parametrize("name", PERCEPTIONS)
def test_the_named_perceptions_are_the_plain_ones(name):
    assert perceived(name, 1.0) == tuple(PERCEPTIONS[name])


@given(
    proposed=actions,
    executed=actions,
    undone=st.booleans(),
    reward=amounts,
    penalty=amounts,
    coin=chances,
    notices=st.sampled_from([0.0, 0.3, 1.0]),
    credit=st.sampled_from(["executed", "proposed", "nothing"]),
)
def test_compiled_and_interpreted_agree_with_the_plain_table(
    proposed, executed, undone, reward, penalty, coin, notices, credit
):
    step = SimpleNamespace(proposed=proposed, executed=executed, undone=undone, reward=reward)
    expected = learned_from((notices, credit, penalty), **vars(step), coin=coin)
    numbers = as_numbers(Perception(notices, credit, penalty))
    for function in (perceive, uncompiled(perceive)):
        found = function(numbers, **vars(step), coin=coin)
        if expected is None:
            assert found.action == -1
        else:
            assert found == expected


def test_an_unknown_perception_is_refused_with_the_nearest_name():
    with pytest.raises(RequestError, match=r"perception 'observing'.*did you mean 'observant'"):
        perception("observing")
