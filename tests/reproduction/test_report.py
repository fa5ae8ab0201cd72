"""Which reports are given additions, and what becomes of those that are out of date."""

import importlib

import pytest

from qbumpers.analysis.additions import Additions
from qbumpers.experiments.design import REPRODUCTIONS
from qbumpers.experiments.store import load
from qbumpers.reproduction.experiments import package_of
from qbumpers.reproduction.report import find, write_report
from tests.experiments.examples import PLAIN, contents_of, run_into


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A run of an experiment that reproduces none."""
    folder = tmp_path_factory.mktemp("own")
    run_into(folder, **PLAIN)
    return folder


def test_an_experiment_that_reproduces_none_is_given_nothing(own):
    assert find(load(own)).additions == Additions()


def test_tables_of_a_reproduction_that_an_earlier_analysis_left_are_removed(own):
    for name in ("published.csv", "claims.csv", "notes.csv"):
        (own / name).write_text("x", encoding="utf-8")
    write_report(own)
    written = contents_of(own, "*.csv")
    assert "notes.csv" in written
    assert not {"published.csv", "claims.csv"} & set(written)


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_every_published_experiment_has_additions(name):
    assert callable(importlib.import_module(f"{package_of(name)}.additions").additions)
