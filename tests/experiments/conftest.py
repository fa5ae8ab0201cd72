"""Finished runs that the tests of experiments share."""

import shutil

import pytest

from tests.experiments.examples import run_into
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
