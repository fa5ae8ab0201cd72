import pytest
from hypothesis import given

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.assistants.accept_or_reject import AcceptOrRejectOptions, accept_or_reject
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks import cliff_walking
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import fractions, noises, situation_of, situations

NOISE = Noise(0.5, 0.5)


@given(situations(), noises, fractions(0, 50, 4))
def test_a_proposal_stays_unless_it_is_worse_than_nothing_by_more_than_the_tolerance(
    situation, noise, tolerance
):
    options, values = AcceptOrRejectOptions(tolerance), situation.values.tolist()
    for nothing in range(len(values)):
        loss = values[nothing] - values[situation.proposed]
        expected = Decision(nothing, 1.0) if loss > tolerance else Decision(situation.proposed, 0.0)
        for function in (accept_or_reject, accept_or_reject.py_func):  # type: ignore[attr-defined]
            assert function(situation, noise, options, nothing) == expected


@pytest.mark.parametrize(
    ("tolerance", "own", "action"), [(0.0, 5.0, 0), (0.0, 4.75, 2), (2.0, 3.0, 0), (2.0, 2.75, 2)]
)
def test_what_is_just_as_good_as_nothing_is_accepted(tolerance, own, action):
    situation = situation_of([own, 9.0, 5.0], 0)
    found = accept_or_reject(situation, NOISE, AcceptOrRejectOptions(tolerance), 2)
    assert found.action == action


def test_a_rejected_fall_becomes_nothing_and_bumpers_do_the_best():
    situation = situation_of([-13.0, 94.0, 90.0], 0, start_value=87.0)
    assert accept_or_reject(situation, NOISE, AcceptOrRejectOptions(), 2) == Decision(2, 1.0)
    assert bumpers(situation, NOISE) == Decision(1, 1.0)


def test_a_task_in_which_nothing_cannot_be_done_is_refused():
    with pytest.raises(RequestError, match="cliff-walking has no action that does nothing"):
        simulate(cliff_walking(), make_assistant("accept-or-reject"))


@pytest.mark.parametrize("tolerance", [-1.0, float("nan"), float("inf")])
def test_the_tolerance_is_a_finite_number_from_0_up(tolerance):
    with pytest.raises(RequestError, match=f"accept-or-reject: tolerance = {tolerance}"):
        make_assistant("accept-or-reject", tolerance=tolerance)
