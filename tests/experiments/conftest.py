"""Finished runs that the tests of experiments share."""

import shutil

import pytest

from tests.experiments.examples import run_into


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_into(tmp_path_factory.mktemp("whole"))


@pytest.fixture
def folder(whole, tmp_path):
    """A finished run, to be spoiled."""
    shutil.copytree(whole, tmp_path / "run")
    return tmp_path / "run"
