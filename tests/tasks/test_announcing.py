"""Successes and crashes by whatever keys of `info`, whenever they come."""

import warnings
from typing import Any

import gymnasium
import pytest

from qbumpers import RequestError, SharedControl, make_task
from qbumpers.experts.episodes import play
from qbumpers.tasks import VectorTask
from qbumpers.tasks.announcing import events_told
from qbumpers.tasks.dynamics import CRASH, SUCCESS
from tests.narrowing import of_kind
from tests.tasks.worlds import World


@pytest.fixture(autouse=True)
def world():
    """A registered environment of the tests."""
    entry_point: Any = World
    gymnasium.register("World-v0", entry_point=entry_point, max_episode_steps=9)
    yield
    del gymnasium.registry["World-v0"]


def task_of(success_key=None, crash_key=None, **told):
    task = make_task("World-v0", discount=0.9, success_key=success_key, crash_key=crash_key, **told)
    return of_kind(VectorTask, task)


def ending(task):
    """Events of an episode's last step."""
    stepper = task.make_stepper()
    return play(task, stepper, lambda observation, step: 0, 0.5).events & (SUCCESS | CRASH)


@pytest.mark.parametrize("when", ["always", "end"])
@pytest.mark.parametrize(
    ("key", "event", "bit"),
    [
        ("success", "success", SUCCESS),
        ("is_success", "success", SUCCESS),
        ("crash", "crash", CRASH),
        ("crashed", "crash", CRASH),
    ],
)
def test_known_keys_are_found_whenever_they_are_shown(key, event, bit, when):
    task = task_of(**{key: when})
    assert task.events == {event}
    assert ending(task) == bit


def test_keys_are_what_the_task_names():
    task = task_of(success_key="won", crash_key="lost", won="end", lost="always", success="always")
    assert task.events == {"success", "crash"}
    assert ending(task) == SUCCESS | CRASH
    assert ending(task_of(success_key="lost", lost="end", success="end")) == SUCCESS
    # The usual key counts for nothing if another one is named.
    with pytest.warns(UserWarning, match="info had no key 'gone'"):
        assert ending(task_of(success_key="gone", success="end")) == 0


def test_nothing_is_announced_if_nothing_is_shown():
    task = task_of(other="always")
    assert task.events == set()
    assert ending(task) == 0


def test_a_key_that_was_shown_is_not_warned_of():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert task_of(success_key="won", won="end").events == {"success"}


def test_keys_are_part_of_the_digest_unless_they_are_the_usual_ones():
    told = {"success": "end", "is_success": "end"}
    usual = task_of(**told)
    assert "success_key" not in usual.settings
    assert task_of(success_key="success", **told).digest() == usual.digest()
    assert task_of(success_key="is_success", **told).digest() != usual.digest()


def test_the_environment_of_a_task_tells_by_the_usual_keys():
    environment = task_of(success_key="won", won="end").make_environment()
    assert environment.reset(seed=1)[1]["success"] is False
    info, over = {}, False
    while not over:
        *_, over, _, info = environment.step(1)
        assert info["success"] is over


def test_the_first_known_key_counts():
    assert events_told({"is_success": 1.0, "crashed": True}) == SUCCESS | CRASH
    assert events_told({"success": False, "is_success": True}) == 0
    assert events_told({}) == 0


def test_shared_control_counts_known_keys():
    shared = SharedControl(
        gymnasium.make("World-v0", crashed="end"), "none", lambda state: [0.0, 0.0], discount=0.9
    )
    shared.reset(seed=0)
    info, over = {}, False
    while not over:
        *_, over, _, info = shared.step(1)
    assert bool(info["assistance"]["events"] & CRASH)


def test_a_table_needs_no_keys():
    with pytest.raises(RequestError, match="success_key = 'won'; leave it out: its table tells"):
        make_task("FrozenLake-v1", discount=0.9, success_key="won")
