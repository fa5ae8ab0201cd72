import numpy as np
import pytest

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import make_task
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import model_of, situation_of, step_of

NOISE = Noise(0.5, 0.5)
OPTIONS = {"visits": 0, "risk": 0.5, "release": 0.25}


def chance_of(success, proposed=0, state=0, episode=0):
    """A situation in which the proposal 0 has a chance of success, and action 1 is the best."""
    situation = situation_of([1.0, 2.0], proposed)
    others = np.array([[success, 0.9]])
    return situation._replace(others=others, state=state, episode=episode)


def taken_over(situations, **options):
    assistant = make_assistant("risk-and-novelty", **{**OPTIONS, **options})
    memory, found = assistant.start(model_of()), []
    for situation in situations:
        decision = assistant.decide(situation, NOISE, memory)
        assert decision in (Decision(situation.proposed, 0.0), Decision(1, 1.0))
        found.append(decision.action != situation.proposed)
        memory = assistant.observe(
            memory, step_of(situation, decision.action, episode=situation.episode)
        )
    return found


def test_control_is_taken_above_one_risk_and_given_back_at_a_lower_one():
    chances = [0.6, 0.5, 0.4, 0.6, 0.7, 0.75, 0.7, 0.4]
    expected = [False, False, True, True, True, False, False, True]
    assert taken_over(map(chance_of, chances)) == expected


def test_control_is_given_back_at_a_best_proposal_and_with_the_end_of_an_episode():
    situations = [chance_of(0.4), chance_of(0.6, proposed=1), chance_of(0.6)]
    assert taken_over(situations) == [True, False, False]
    situations = [chance_of(0.4), chance_of(0.6), chance_of(0.6, episode=1)]
    assert taken_over(situations) == [True, True, False]


def test_worse_proposals_in_new_states_are_overridden_and_take_control():
    safe = [chance_of(1.0, state=state) for state in (0, 0, 0, 1, 0, 1, 1)]
    assert taken_over(safe, visits=2) == [True, True, False, True, False, True, False]
    situations = [chance_of(1.0, proposed=1), chance_of(1.0), chance_of(0.6, state=0)]
    assert taken_over(situations, visits=2) == [False, True, True]


def test_a_new_trifle_is_mended_and_a_known_waste_is_not_unlike_with_bumpers():
    trifle = situation_of([85.0, 87.0], 0, start_value=87.0)._replace(others=np.ones((1, 2)))
    waste = trifle._replace(earned=-80.0)
    assert taken_over([trifle, waste], visits=1) == [True, False]
    assert bumpers(trifle, NOISE).action == 0
    assert bumpers(waste, NOISE) == Decision(1, 1.0)


def test_on_slippery_ice_it_works_without_further_ado():
    lake = make_task("FrozenLake-v1", discount=0.95, episode_limit=40, is_slippery=True)
    assistant = make_assistant("risk-and-novelty", visits=1, risk=0.5, release=0.4)
    found = simulate(lake, assistant, trials=4, episodes=30).outcomes
    assert 0 < found.overrides.sum() < found.assisted_length.sum()


@pytest.mark.parametrize(("option", "value"), [("visits", -1), ("risk", 1.5), ("release", -0.5)])
def test_options_have_bounds(option, value):
    with pytest.raises(RequestError, match=f"risk-and-novelty: {option} = {value}"):
        make_assistant("risk-and-novelty", **{**OPTIONS, option: value})


def test_control_cannot_be_given_back_before_it_is_taken():
    assistant = make_assistant("risk-and-novelty", visits=0, risk=0.3, release=0.4)
    with pytest.raises(RequestError, match=r"release = 0\.4 must not be above risk = 0\.3"):
        simulate(make_task("FrozenLake-v1", discount=0.9), assistant)
