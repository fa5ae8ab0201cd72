"""Values for a task with other keys."""

from dataclasses import replace

import numpy as np
import pytest

from qbumpers import RequestError, shipped_expert
from qbumpers.networks import Network
from qbumpers.tasks import make_task
from qbumpers.tasks.corridors import vector_corridor
from qbumpers.tasks.remapping import remapped
from qbumpers.values import remapped_values, solve
from tests.values.networks import network_of

KEYS = (2, 3, 1, 0)


def test_a_table_is_the_one_that_is_solved_anew_further_rows_too():
    inner = make_task("cliff-walking")
    task = remapped(inner, KEYS)
    moved = remapped_values(solve(inner, others=("safety",)), task)
    solved = solve(task, others=("safety",))
    assert np.array_equal(moved.table, solved.table)
    assert np.array_equal(moved.others["safety"](36), solved.others["safety"](36))
    assert (moved.made_for, moved.task) == (solved.made_for, "remapped-cliff-walking")
    assert moved.method.endswith("for keys 2, 3, 1, 0")


@pytest.mark.parametrize("dueling", [0, 6])
def test_a_network_says_of_an_action_what_it_said_of_the_other(dueling):
    inner = vector_corridor()
    network = Network((5,), dueling=dueling)
    values = network_of(task=inner.name, inputs=2, actions=2, network=network)
    moved = remapped_values(values, remapped(inner, (1, 0)))
    observations = np.random.default_rng(0).normal(size=(5, 2))
    assert moved(observations) == pytest.approx(values(observations)[:, ::-1], rel=1e-5)


def test_the_expert_that_ships_is_permuted():
    expert, task = shipped_expert("mountain-car"), make_task("mountain-car")
    moved = remapped_values(expert, remapped(task, (2, 0, 1)))
    observation = np.array([-0.4, 0.02], np.float32)
    assert moved(observation) == pytest.approx(expert(observation)[[2, 0, 1]], rel=1e-6)


def test_values_of_something_else_are_refused():
    inner = make_task("cliff-walking")
    task = remapped(inner, KEYS)
    values = solve(inner)
    with pytest.raises(RequestError, match="its actions are those of no other task"):
        remapped_values(values, inner)
    with pytest.raises(RequestError, match=r"a table \[48, 4\]; task larger-cliff needs"):
        remapped_values(values, remapped(make_task("larger-cliff"), KEYS))
    with pytest.raises(RequestError, match="made for a task that differs"):
        remapped_values(replace(values, made_for="another"), task)
