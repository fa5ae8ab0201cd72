"""Warnings of numbers that mean little, from experiments made so that they do, and do not."""

import dataclasses

import numpy as np
import pytest

from qbumpers.analysis.page.doubts import doubts
from qbumpers.analysis.report import find
from qbumpers.experiments.store import load
from qbumpers.tasks import make_task
from qbumpers.values import solve
from tests.experiments.examples import run_into

LAKE = {"name": "FrozenLake-v1", "discount": 0.9, "arguments": {"is_slippery": False}}
ALL = [
    {"name": "none"},
    {"name": "maximal"},
    {"name": "stochastic-q-bumpers", "alpha": [0.3, 0.9], "v_min": -1.0},
]


def doubts_of(folder, table=None, discount=0.9, assistants=ALL, **changes):
    values = solve(make_task("FrozenLake-v1", discount=0.9, is_slippery=False), discount=discount)
    if table is not None:
        values = dataclasses.replace(values, table=table(values.table))
    path = folder / "values.npz"
    values.save(path)
    changes = {"task": LAKE, "trials": 12, "episodes": 10, **changes}
    run_into(folder / "out", values=str(path), assistants=assistants, **changes)
    results = load(folder / "out")
    return doubts(find(results), results)


def test_good_values_leave_no_doubt(tmp_path):
    assert doubts_of(tmp_path) == []


def test_values_upside_down_make_full_help_worse_than_none(tmp_path):
    cliff = {"name": "CliffWalking-v1", "discount": 0.9, "episode_limit": 30}
    task = make_task(**cliff)
    path = tmp_path / "values.npz"
    dataclasses.replace(solve(task), table=-solve(task).table).save(path)
    run_into(
        tmp_path / "out", task=cliff, values=str(path), trials=12, episodes=10, assistants=ALL[:2]
    )
    results = load(tmp_path / "out")
    worse, chance = doubts(find(results), results)
    assert worse.startswith("Maximal assistance performs worse than no assistance: ")
    assert chance.startswith("The values are perhaps no better than chance: Maximal assistance")


def test_values_that_prefer_nothing_are_named(tmp_path):
    found = doubts_of(tmp_path, table=lambda table: np.full_like(table, 0.5), assistants=ALL[:2])
    assert "the same for all actions in every state" in found[0]


def test_an_estimated_table_is_named(tmp_path):
    lake = {**LAKE, "arguments": {"is_slippery": False, "estimated": 9_000}}
    run_into(tmp_path / "out", task=lake, trials=20, episodes=10, assistants=ALL)
    results = load(tmp_path / "out")
    [sentence] = doubts(find(results), results)
    assert sentence.startswith("The task is an estimate of the environment from 9,000 of its steps")


def test_values_of_another_discount_are_named(tmp_path):
    [sentence] = doubts_of(tmp_path, discount=0.8)
    assert "made with discount 0.8, and the task has discount 0.9" in sentence


def test_a_floor_that_leaves_no_room_is_named(tmp_path):
    # V*(s_0) = 0.9^5 = 0.590; a usual worse action loses 0.06 or so, far more than 0.9 x 0.0005.
    near = [*ALL[:2], {"name": "stochastic-q-bumpers", "alpha": [0.3, 0.9], "v_min": 0.59}]
    [sentence] = doubts_of(tmp_path, assistants=near)
    assert sentence.startswith("Stochastic Q Bumpers has v_min = 0.59, hardly below")
    assert "from 100% of the start states, even alpha = 0.9 leaves less" in sentence


@pytest.mark.parametrize(("v_min", "named"), [(-1e9, True), (-1.0, False)])
def test_assistants_that_hardly_override_are_named(tmp_path, v_min, named):
    idle = [{"name": "none"}, {"name": "stochastic-q-bumpers", "alpha": 0.9, "v_min": v_min}]
    found = doubts_of(tmp_path, assistants=idle)
    assert (
        any("overrode fewer than one step in 200, at any setting" in sentence for sentence in found)
        == named
    )


def test_an_assistant_whose_threshold_is_1_never_overrides(tmp_path):
    never = [{"name": "none"}, {"name": "local-q-thresholding", "alpha": 1.0}]
    [sentence] = doubts_of(tmp_path, assistants=never)
    assert sentence == (
        "Local Q-Thresholding never overrode, at any setting: its learners had hardly any "
        "assistance."
    )
