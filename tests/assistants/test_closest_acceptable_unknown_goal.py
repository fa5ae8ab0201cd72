import numpy as np
import pytest

from qbumpers import make_assistant, make_task
from qbumpers.assistants.closest_acceptable_unknown_goal import (
    ClosestAcceptableUnknownGoalOptions,
    closest_acceptable_unknown_goal,
)
from qbumpers.compilation import uncompiled
from qbumpers.decisions import Decision, Noise
from qbumpers.errors import RequestError
from qbumpers.values import solve
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import situation_of

NOISE, OPTIONS = Noise(0.5, 0.5), ClosestAcceptableUnknownGoalOptions(0.5)
LINE = np.abs(np.subtract.outer(np.arange(3.0), np.arange(3.0)))


def decided(rows, proposed, **changes):
    situation = situation_of(list(np.mean(rows, axis=0)), proposed, **changes)
    situation = situation._replace(others=np.array(rows))
    found = closest_acceptable_unknown_goal(situation, NOISE, OPTIONS, LINE)
    plain = uncompiled(closest_acceptable_unknown_goal)(situation, NOISE, OPTIONS, LINE)
    assert found == plain
    return found, situation


def test_the_row_of_the_proposal_decides_and_the_nearest_action_replaces_it():
    rows = [[0.0, 4.0, 6.0], [0.0, 9.0, 2.0], [9.0, 0.0, 1.0]]
    assert decided(rows, 0)[0] == Decision(1, 1.0)  # 4 and 6 will do; 1 is nearer to 0
    assert decided(rows, 1)[0] == Decision(1, 0.0)
    assert decided(rows, 2)[0] == Decision(0, 1.0)  # nothing else will do


def test_a_proposal_that_tells_its_goal_passes_which_bumpers_end():
    rows = [[90.0, 0.0, 0.0], [90.0, 0.0, 0.0], [0.0, 0.0, 80.0]]
    found, situation = decided(rows, 2, earned=-80.0, start_value=60.0)
    assert found == Decision(2, 0.0)
    assert bumpers(situation, NOISE) == Decision(0, 1.0)


def test_next_to_a_goal_a_step_onto_it_is_believed():
    task = make_task("hidden-goal")
    rows = solve(task, others=("proposals",)).others
    below = 1 * 7 + 3  # the goal in the middle of the first row is above
    onto = [rows[f"proposals_{proposal}"].table[below, 0] for proposal in range(4)]
    assert onto[0] > max(onto[1:]) + 5


@pytest.mark.parametrize("alpha", [-0.1, 1.5])
def test_an_alpha_out_of_range_is_named(alpha):
    with pytest.raises(RequestError, match=f"alpha = {alpha}"):
        make_assistant("closest-acceptable-unknown-goal", alpha=alpha)
