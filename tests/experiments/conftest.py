"""Finished runs that the tests of experiments share."""

import shutil

import gymnasium
import pytest

from tests.experiments.examples import run_into
from tests.experiments.own_files import OwnFiles


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_into(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def folder(whole, tmp_path):
    """A finished run, to be spoiled."""
    shutil.copytree(whole, tmp_path / "run")
    return tmp_path / "run"


@pytest.fixture
def own_files(tmp_path, monkeypatch, own_registry):
    """Files of a user's own, to be edited and registered."""
    (tmp_path / "own").mkdir()
    yield OwnFiles(tmp_path / "own", monkeypatch)
    gymnasium.registry.pop("own/Walk-v0", None)
