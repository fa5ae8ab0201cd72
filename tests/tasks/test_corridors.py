"""The small tasks of the checks, against what their descriptions say."""

from typing import Any

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.tasks.corridors import slippery_corridor, vector_corridor
from qbumpers.tasks.dynamics import SUCCESS, TERMINATED

BACK, ON, STAY, RESTART = range(4)


def reached(cell: int, action: int) -> dict[int, float]:
    """Probabilities of the next cells."""
    task, found = slippery_corridor(), {}
    for to, chance in zip(
        task.next_state[cell, action], task.probability[cell, action], strict=True
    ):
        if chance:
            found[int(to)] = found.get(int(to), 0.0) + float(chance)
    return found


def test_one_step_on_in_four_slips_back_and_the_other_actions_are_sure():
    assert reached(2, ON) == {3: 0.75, 1: 0.25}
    assert reached(2, BACK) == {1: 1.0}
    assert reached(2, STAY) == {2: 1.0}
    assert reached(2, RESTART) == {0: 1.0}
    assert reached(0, BACK) == {0: 1.0}


def test_only_the_last_cell_ends_the_episode_and_pays():
    task = slippery_corridor()
    possible, last = task.probability[:4] > 0, task.next_state[:4] == 4
    assert np.array_equal(task.terminated[:4][possible], last[possible])
    assert set(task.reward[:4][possible & last]) == {10.0}
    assert set(task.reward[:4][possible & ~last]) == {-1.0}


def test_the_place_in_the_vector_corridor_moves_to_its_end_and_can_be_put_back():
    stepper: Any = vector_corridor().make_stepper()
    assert stepper.reset(0.5) == pytest.approx([0.15, 0.85])
    assert stepper.step(0)[0] == pytest.approx([0.05, 0.95])
    before = stepper.snapshot()
    for place in (0.25, 0.45, 0.65, 0.85):
        observation, reward, events = stepper.step(1)
        assert observation == pytest.approx([place, 1 - place])
        assert (reward, events) == (-1.0, 0)
    assert stepper.step(1)[1:] == (10.0, TERMINATED | SUCCESS)
    stepper.restore(before)
    assert stepper.step(1)[0] == pytest.approx([0.25, 0.75])


def test_the_vector_corridor_has_no_pictures():
    with pytest.raises(RequestError, match="no pictures"):
        vector_corridor().make_environment()
