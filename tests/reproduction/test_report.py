"""Which reports are given additions, and what becomes of those that are out of date."""

import importlib

import polars as pl
import pytest

from qbumpers.analysis.additions import Additions
from qbumpers.experiments.design import REPRODUCTIONS
from qbumpers.experiments.store import load
from qbumpers.reproduction.experiments import package_of
from qbumpers.reproduction.printed import PUBLISHED
from qbumpers.reproduction.report import find, write_report
from tests.analysis.pages import Page
from tests.experiments.examples import PLAIN, contents_of, run_into
from tests.reproduction.lunar_lander.landings import made_up


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


def test_a_verdict_on_printed_numbers_needs_the_paper_s_experiment(tmp_path, call):
    given = ["--episodes", 20, "--trials", 2, "--alphas", "0.2,0.7,0.0195"]
    status, output, _ = call("reproduce", "cliff-walking", *given, "--out", tmp_path)
    assert status == 0
    why = (
        "No verdict is given on the numbers that the paper prints: the experiment is not the "
        "paper's (other assistants; episodes = 20, not 100)."
    )
    assert why in output
    assert "disagree" not in output
    published = pl.read_csv(tmp_path / PUBLISHED)
    assert published["agrees"].null_count() == published.height > 0
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert page.text.count(why) == 2  # what to keep in mind, and beside the numbers
    assert {row[3] for row in page.rows("published")} == {"–"}


def test_the_paper_s_experiment_gets_one_whatever_its_size(reproduced):
    published = pl.read_csv(reproduced / PUBLISHED)
    assert published["agrees"].null_count() == 0
    assert "No verdict" not in (reproduced / "report.html").read_text(encoding="utf-8")


def test_claims_of_another_experiment_are_judged_from_it_alone(tmp_path):
    findings = find(load(made_up(tmp_path, trials=2, episodes=5)))
    assert findings.additions.cautions == [
        "Claims are judged from these results alone: the experiment is not the paper's (episodes "
        "= 5, not 2000)."
    ]
