"""Reports of experiments that no paper published, down to a single episode."""

import errno
import os
import shutil

import polars as pl
import pytest

from qbumpers.analysis.report import write_report
from qbumpers.files import StoreError
from qbumpers.tasks import make_task
from qbumpers.values import solve
from tests.analysis.pages import Page, interval
from tests.experiments.examples import BUMPERS, LAKE, PLAIN, contents_of, run_into

TAXI = {"task": {"name": "Taxi-v4", "discount": 0.9, "episode_limit": 30}}
NONE = {"assistants": [{"name": "none"}]}
ANYWHERE = ["frontier", "curves", "conditions", "again"]


def reported(folder, **changes):
    write_report(run_into(folder, **changes))
    return Page((folder / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    reported(folder, **PLAIN)
    return folder


def test_a_task_on_a_grid_has_maps_but_no_published_numbers_or_thresholds(tmp_path):
    assistants = [{"name": "none"}, {"name": "local-q-thresholding", "alpha": 0.5}]
    page = reported(tmp_path, **{**LAKE, "assistants": assistants})
    assert page.sections == ["frontier", "curves", "heatmaps", "conditions", "again"]
    assert page.nav == [f"#{section}" for section in page.sections]
    assert not (tmp_path / "published.csv").exists()
    assert not (tmp_path / "regret.csv").exists()
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {
        "frontier", "learning-curves", "heatmaps",
    }  # fmt: skip


def test_a_single_episode_of_a_task_without_a_grid_is_reported(tmp_path):
    page = reported(tmp_path, **TAXI, **NONE, trials=1, episodes=1)
    assert page.sections == ANYWHERE
    [row] = pl.read_csv(tmp_path / "summary.csv").to_dicts()
    assert row["assisted_low"] is None
    assert "alpha" not in row
    [_, cells] = page.tables["conditions"]
    assert cells[:3] == ["none", interval(row, "assisted"), interval(row, "unassisted")]
    assert cells[1].endswith("[–, –]")


def test_a_single_trial_of_a_sweep_is_reported(tmp_path):
    page = reported(tmp_path, **PLAIN, trials=1)
    assert len(page.tables["conditions"]) == 1 + 3
    assert "[–, –]" in page.tables["conditions"][1][1]


def test_maximal_assistance_alone_is_reported(tmp_path):
    page = reported(tmp_path, **{**PLAIN, "assistants": [{"name": "maximal"}]})
    assert [cells[0] for cells in page.tables["conditions"][1:]] == ["maximal"]


def test_assistants_that_never_overrode_are_reported(tmp_path):
    quiet = [{"name": "local-q-thresholding", "alpha": 1.0}]
    page = reported(tmp_path, **{**LAKE, "assistants": quiet})
    assert [cells[0] for cells in page.tables["conditions"][1:]] == ["local-q-thresholding/alpha=1"]


def test_two_swept_methods_of_ones_own_have_regret_but_no_published_numbers(tmp_path):
    methods = [{"name": "local-q-thresholding", "alpha": [0.01, 0.5]}, BUMPERS]
    page = reported(tmp_path, assistants=methods, episodes=20)
    assert page.sections == [
        "frontier", "regret", "curves", "heatmaps", "thresholds", "conditions", "again",
    ]  # fmt: skip
    assert len(page.tables["regret"]) == 1 + 2
    assert "The thresholding cluster is one assistant" not in page.text  # it takes second-best


def test_texts_of_the_experiment_cannot_become_markup(tmp_path):
    path = tmp_path / "<b>'&amp;'.npz"
    solve(make_task("Taxi-v4", discount=0.9)).save(path)
    page = reported(tmp_path / "run", **TAXI, **NONE, values=str(path))
    assert page.sections == ANYWHERE
    assert "<b>'&amp;'.npz" in page.text


def test_a_report_needs_its_own_files_alone_and_comes_out_the_same(plain, tmp_path):
    folder = tmp_path / "elsewhere"
    shutil.copytree(
        plain, folder, ignore=shutil.ignore_patterns("cells", "figures", "*.html", "*.csv")
    )
    parts = []
    findings = write_report(folder, advance=parts.append)
    expected = contents_of(plain, "*.csv", "*.html", "figures/*")
    assert len(expected) == 2 + 2 * 2
    assert contents_of(folder, "*.csv", "*.html", "figures/*") == expected
    assert parts[0] == "tables"
    assert parts[-1] == "report.html"
    assert findings.summary.height == 3
    assert (findings.regrets, findings.methods, findings.comparisons) == ({}, None, [])


def test_a_full_disk_leaves_the_old_report_whole(plain, tmp_path, monkeypatch):
    folder = tmp_path / "full"
    shutil.copytree(plain, folder)
    before = contents_of(folder, "*.*", "figures/*")

    def fill_up(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fill_up)
    with pytest.raises(StoreError, match=r"cannot write .*summary\.csv: No space left on device"):
        write_report(folder)
    assert contents_of(folder, "*.*", ".*", "figures/*", "figures/.*") == before
