import dataclasses

import pytest
from hypothesis import given

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.assistants.undo import UndoOptions, undo
from qbumpers.conformance import vector_corridor
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import cliff_walking
from tests import reference_rules as plain
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import fractions, noises, situation_of, situations

NOISE = Noise(0.5, 0.5)


@given(situations(), noises, fractions(0, 50, 4))
def test_agrees_with_the_plain_rule(situation, noise, tolerance):
    expected = plain.undo(situation, noise, tolerance)
    for function in (undo, undo.py_func):  # type: ignore[attr-defined]
        assert function(situation, noise, UndoOptions(tolerance)) == Decision(*expected)


@pytest.mark.parametrize(("own", "undone"), [(7.0, False), (6.75, True)])
def test_a_loss_above_the_tolerance_is_undone(own, undone):
    situation = situation_of([own, 9.0], 0)
    assert undo(situation, NOISE, UndoOptions(2.0)) == Decision(0, float(undone), undone)


def test_a_fall_happens_and_is_taken_back_where_bumpers_do_something_else():
    situation = situation_of([92.0, 94.0, -13.0], 2, start_value=87.0)
    assert undo(situation, NOISE, UndoOptions()) == Decision(2, 1.0, True)
    assert bumpers(situation, NOISE) == Decision(1, 1.0)


def test_an_undone_trial_of_a_wanderer_costs_its_mistakes_and_arrives():
    # Only the 13 right steps lead on; each of the mistakes before costs its reward.
    found = simulate(cliff_walking(), make_assistant("undo"), trials=4, episodes=10).outcomes
    arrived = found.assisted_length < 100
    assert arrived.any()
    assert (found.assisted_length - found.overrides)[arrived].tolist() == [13] * arrived.sum()


def test_undoing_is_refused_if_the_task_cannot_be_taken_back():
    task = dataclasses.replace(vector_corridor(), undoable=False)
    with pytest.raises(RequestError, match="no state that can be taken back"):
        simulate(task, make_assistant("undo"))


@pytest.mark.parametrize("name", ["undo", "correct"])
@pytest.mark.parametrize("tolerance", [-1.0, float("inf")])
def test_the_tolerance_is_a_finite_number_from_0_up(name, tolerance):
    with pytest.raises(RequestError, match=f"assistant {name}: tolerance = {tolerance}"):
        make_assistant(name, tolerance=tolerance)
