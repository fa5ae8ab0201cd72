"""A simulation takes whatever `make_task` does in the place of a task."""

from typing import Any

import gymnasium
import pytest

from qbumpers import RequestError, make_task, simulate

SHORT: dict[str, Any] = {"trials": 2, "episodes": 2}


def same(found, expected):
    pairs = zip(found.outcomes, expected.outcomes, strict=True)
    return all((one == other).all() for one, other in pairs)


def test_a_name_stands_for_its_task():
    task = make_task("cliff-walking")
    assert same(simulate("cliff-walking", "none", **SHORT), simulate(task, "none", **SHORT))


@pytest.mark.parametrize(
    "given",
    ["FrozenLake-v1", gymnasium.make("FrozenLake-v1"), lambda: gymnasium.make("FrozenLake-v1")],
)
def test_an_environment_stands_for_its_task(given):
    task = make_task("FrozenLake-v1", discount=0.9)
    found = simulate(given, "maximal", discount=0.9, **SHORT)
    assert same(found, simulate(task, "maximal", **SHORT))
    assert same(found, simulate(task, "maximal", discount=0.9, **SHORT))


@pytest.mark.parametrize(
    ("task", "setup", "message"),
    [
        ("FrozenLake-v1", {}, "'FrozenLake-v1': discount is missing"),
        ("FrozenLake-v1", {"gamma": 0.9}, r"setting 'gamma' \(did you mean 'discount'\?\)"),
        (make_task("FrozenLake-v1", discount=0.9), {"discount": 0.8}, "states its own, 0.9"),
        (7, {}, "task = 7; a task is needed"),
    ],
)
def test_what_stands_for_no_task_is_named(task, setup, message):
    with pytest.raises(RequestError, match=message):
        simulate(task, "none", **SHORT, **setup)
