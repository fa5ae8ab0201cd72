"""Finished runs that the tests of experiments share."""

import shutil

import gymnasium
import pytest

from tests.experiments.examples import run_into
from tests.experiments.own_files import OwnFiles
from tests.experiments.with_ray import ALONE


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_into(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def folder(whole, tmp_path):
    """A finished run, to be spoiled."""
    shutil.copytree(whole, tmp_path / "run")
    return tmp_path / "run"


@pytest.fixture(scope="module")
def ray_alone():
    """Ray talks to this machine alone."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ALONE.items():
            patch.setenv(name, value)
        yield


@pytest.fixture
def own_files(tmp_path, monkeypatch, own_registry):
    """Files of a user's own, to be edited and registered."""
    (tmp_path / "own").mkdir()
    yield OwnFiles(tmp_path / "own", monkeypatch)
    gymnasium.registry.pop("own/Walk-v0", None)
