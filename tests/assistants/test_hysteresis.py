import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant
from qbumpers.conformance import check_conformance, slippery_corridor
from qbumpers.decisions import Decision, Noise
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import model_of, situation_of, step_of

NOISE = Noise(0.5, 0.5)
FALL, TRIFLE = situation_of([-13.0, 94.0], 0, start_value=87.0), situation_of([85.0, 87.0], 0)
GOOD = TRIFLE._replace(proposed=1)
OF = {"name": "correct", "tolerance": 10.0}  # overrides falls alone


def decided(situations, calm, of=OF):
    assistant = make_assistant("hysteresis", of=of, calm=calm)
    memory, found = assistant.start(model_of(2)), []
    for situation in situations:
        decision = assistant.decide(situation, NOISE, memory)
        found.append(decision)
        step = step_of(situation, decision.action, undone=decision.undo, episode=situation.episode)
        memory = assistant.observe(memory, step)
    return found


def test_after_a_fall_trifles_are_mended_until_some_steps_in_a_row_are_calm():
    steps = [TRIFLE, FALL, TRIFLE, GOOD, TRIFLE, GOOD, GOOD, TRIFLE]
    found = [int(decision.probability) for decision in decided(steps, 2)]
    assert found == [0, 1, 1, 0, 1, 0, 0, 0]


@given(st.integers(1, 4), st.lists(st.sampled_from([FALL, TRIFLE, GOOD]), max_size=20))
def test_control_is_held_while_one_of_the_last_steps_was_overridden(calm, steps):
    overridden: list[bool] = []
    for situation, decision in zip(steps, decided(steps, calm), strict=True):
        held = any(overridden[-calm:])
        expected = situation is FALL or (situation is TRIFLE and held)
        assert decision == (Decision(1, 1.0) if expected else Decision(situation.proposed, 0.0))
        overridden.append(expected)


def test_control_ends_with_the_episode():
    later = TRIFLE._replace(episode=1)
    assert [int(d.probability) for d in decided([FALL, TRIFLE, later], 5)] == [1, 1, 0]


def test_what_the_other_rule_would_undo_is_undone_and_the_rest_replaced():
    of = {"name": "undo", "tolerance": 10.0}
    found = decided([FALL, FALL, TRIFLE], 3, of)
    assert found == [Decision(0, 1.0, True)] * 2 + [Decision(1, 1.0, False)]


def test_while_control_is_held_an_override_is_sure():
    of = {"name": "random-override", "probability": 0.75}
    assert [d.probability for d in decided([TRIFLE] * 3, 3, of)] == [0.75, 1.0, 1.0]


def test_a_trifle_after_a_fall_is_mended_which_the_bumpers_below_let_pass():
    trifle = TRIFLE._replace(start_value=87.0)
    found = decided([FALL, trifle], 3, {"name": "stochastic-q-bumpers", "alpha": 0.7})
    assert found == [Decision(1, 1.0)] * 2
    assert bumpers(trifle, NOISE).action == 0


def test_a_count_of_calm_steps_is_at_least_1():
    with pytest.raises(RequestError, match="assistant hysteresis: calm = 0"):
        make_assistant("hysteresis", of="maximal", calm=0)


def test_over_a_rule_that_undoes_it_does_the_same_in_every_host():
    assistant = make_assistant("hysteresis", of="undo", calm=2)
    assert assistant.needs == {"undo"}
    assert check_conformance(assistant, tasks=[slippery_corridor()])
