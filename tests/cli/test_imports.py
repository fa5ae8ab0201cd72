"""`--import`, and what `run` takes in place of a file's numbers."""

import sys

import gymnasium
import pytest

import qbumpers
from qbumpers.tasks import registry
from tests.experiments.examples import write_toml

POND = """
import gymnasium
import qbumpers
from qbumpers.tasks import cliff_walking

gymnasium.register(
    "Pond-v0", "gymnasium.envs.toy_text.frozen_lake:FrozenLakeEnv", max_episode_steps=8,
    kwargs={"desc": ["SF", "FG"], "is_slippery": False},
)
qbumpers.register_task("own-walk", lambda: cliff_walking())
"""


@pytest.fixture
def pond(tmp_path, monkeypatch):
    """A module in the current directory; it and its registrations are forgotten afterwards."""
    (tmp_path / "own_pond.py").write_text(POND, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_tasks", dict(registry._tasks))
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr("qbumpers.imports._imported", {})
    yield tmp_path
    sys.modules.pop("own_pond", None)
    gymnasium.registry.pop("Pond-v0", None)


def test_what_a_module_registers_is_listed(pond, call):
    status, output, _ = call("list", "tasks", "--import", "own_pond")
    assert status == 0
    assert "own-walk a task of your own" in output
    assert "Pond-v0 an environment of an imported module; give a discount" in output
    assert "cliff-walking Walk along a cliff" in output


@pytest.mark.parametrize("arguments", [["Pond-v0", "--import", "own_pond"], ["own_pond:Pond-v0"]])
def test_an_expert_for_an_environment_of_a_module(pond, call, arguments):
    status, output, _ = call("expert", *arguments, "--discount", "0.9")
    assert status == 0
    assert "V of the start 0.9;" in output
    assert (pond / "Pond-v0.npz").is_file()


def test_run_imports_and_takes_numbers_in_place_of_the_file_s(pond, call):
    task = {"name": "Pond-v0", "discount": 0.9}
    path = write_toml(pond / "pond.toml", task=task, assistants=[{"name": "none"}])
    numbers = ["--trials", 1, "--episodes", 2, "--seed", 9]
    status, output, _ = call("run", path, *numbers, "--import", "own_pond", "--out", pond / "out")
    assert status == 0
    assert "1 condition, 1 trial of 2 episodes" in output
    assert "1 trial: 1 to run" in output
    noted = qbumpers.load(pond / "out").experiment
    assert (noted.trials, noted.episodes, noted.seed) == (1, 2, 9)
    assert noted.imports == ["own_pond"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["list", "tasks", "--import", "no_such"], "--import: there is no module 'no_such'"),
        (["expert", "no_such:X-v0"], "task 'no_such:X-v0': there is no module 'no_such'"),
    ],
)
def test_a_module_that_is_not_there_is_named(pond, call, arguments, message):
    status, _, errors = call(*arguments)
    assert status == 2
    assert message in errors
    assert len(errors.splitlines()) == 1
