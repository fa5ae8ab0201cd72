"""Reports of experiments that no paper published, down to a single episode."""

import errno
import os
import shutil

import polars as pl
import pytest

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.report import write_report
from qbumpers.files import StoreError
from qbumpers.tasks import make_task
from qbumpers.values import solve
from tests.analysis.pages import Page, interval
from tests.experiments.examples import BUMPERS, LAKE, PLAIN, contents_of, run_into

TAXI = {"task": {"name": "Taxi-v4", "discount": 0.9, "episode_limit": 30}}
NONE = {"assistants": [{"name": "none"}]}
ANYWHERE = [
    "outcome", "frontier", "methods", "curves", "dependence", "distribution", "conditions",
    "measures", "again",
]  # fmt: skip


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
    assert set(page.sections) == {*ANYWHERE, "control", "overrides", "heatmaps"}
    assert page.nav == [f"#{section}" for section in page.sections]
    assert not (tmp_path / "published.csv").exists()
    assert not (tmp_path / "regret.csv").exists()
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == {
        "frontier", "tradeoffs", "differences-from-none", "learning-curves", "override-course",
        "distribution", "heatmaps",
    }  # fmt: skip


def test_a_single_episode_of_a_task_without_a_grid_is_reported(tmp_path):
    page = reported(tmp_path, **TAXI, **NONE, trials=1, episodes=1)
    assert page.sections == ANYWHERE
    [row] = pl.read_csv(tmp_path / "summary.csv").to_dicts()
    assert row["assisted_low"] is None
    assert "alpha" not in row
    [cells] = page.rows("conditions")
    assert 1 <= abs(row["assisted_mean"] - row["unassisted_mean"]) < 10  # shown to three digits
    assert cells[:3] == ["none", *(interval(row, m, 2) for m in ("assisted", "unassisted"))]
    assert cells[1].endswith(" no interval")


def test_a_single_trial_of_a_sweep_is_reported(tmp_path):
    methods = [*PLAIN["assistants"], {"name": "local-q-thresholding", "alpha": [0.01, 0.5]}]
    page = reported(tmp_path, **{**PLAIN, "assistants": methods}, trials=1)
    assert len(page.rows("conditions")) == 5
    assert "There is one trial per condition: nothing here has an interval." in page.text
    assert "so no number has an interval" in page.text
    assert "in brackets" not in page.text
    for path in [*tmp_path.glob("*.csv"), *(tmp_path / "figures").glob("*.csv")]:
        table = pl.read_csv(path)
        ends = [c for c in table.columns if c.endswith(("_low", "_high"))]
        ends += [c for c in ("probability", "largest", "low", "high") if c in table.columns]
        assert table.select(pl.col(ends).null_count()).row(0) == (table.height,) * len(ends), path
        assert "nan" not in path.read_text(encoding="utf-8").lower()
    assert not {"nan", "[–,", "nan%"} & set(page.text.lower().split())
    for section in ("frontier", "methods", "control", "dependence", "conditions"):
        cells = [
            cell for number in range(9) for row in tables(page, section, number) for cell in row
        ]
        assert any(cell.endswith("no interval") for cell in cells), section
    for caption, _ in page.pictures:
        assert caption.endswith(
            "There is one trial per condition, which has no interval: none is drawn."
        ) == ("grid cell" not in caption)


def tables(page, section, number):
    found = page.tables.get(section, [])
    return found[number][1:] if number < len(found) else []


def test_maximal_assistance_alone_is_reported(tmp_path):
    page = reported(tmp_path, **{**PLAIN, "assistants": [{"name": "maximal"}]})
    assert [cells[0] for cells in page.rows("conditions")] == ["maximal"]


def test_assistants_that_never_overrode_are_reported(tmp_path):
    quiet = [{"name": "local-q-thresholding", "alpha": 1.0}]
    page = reported(tmp_path, **{**LAKE, "assistants": quiet})
    assert [cells[0] for cells in page.rows("conditions")] == ["local-q-thresholding/alpha=1"]


def test_two_swept_methods_of_ones_own_have_regret_but_no_published_numbers(tmp_path):
    methods = [{"name": "local-q-thresholding", "alpha": [0.01, 0.5]}, BUMPERS]
    page = reported(tmp_path, assistants=methods, episodes=20)
    more = {"sensitivity", "overrides", "heatmaps"}
    assert set(page.sections) == {*ANYWHERE, *more}
    assert [cells[0] for cells in page.rows("methods", 2)] == ["performance", "learning"]


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
    assert len(expected) == 5 + 3 * 6
    assert contents_of(folder, "*.csv", "*.html", "figures/*") == expected
    assert parts[0] == "tables"
    assert parts[-1] == "report.html"
    assert findings.summary.height == 3
    assert (findings.regrets, findings.methods, findings.additions) == ({}, None, Additions())


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


SEVERAL = {
    "learners": [{"perception": ["transition", "observant"]}],
    "retention": 2,
    "criterion": -20.0,
    "common_random_numbers": True,
}


@pytest.fixture(scope="module")
def several(tmp_path_factory):
    folder = tmp_path_factory.mktemp("several")
    return folder, reported(folder, **PLAIN, **SEVERAL)


def test_learners_are_told_apart_and_compared(several):
    folder, page = several
    assert "learners" in page.sections
    summary = {row["condition"]: row for row in pl.read_csv(folder / "summary.csv").to_dicts()}
    assert len(page.tables["conditions"]) == 2
    for table, learner in enumerate(("transition", "observant")):
        found = [cells[0] for cells in page.rows("conditions", table)]
        own = [name.partition("@") for name in summary]
        assert found == [name for name, _, of in own if of == f"perception={learner}"]
    headings = [title for title in page.subtitles if title.startswith("Learners with")]
    assert headings == ["Learners with perception=transition", "Learners with perception=observant"]
    for table, measure in enumerate(("unassisted", "assisted")):
        [none, *_] = page.rows("learners", table)
        expected = [
            interval(summary[f"none@perception={learner}"], measure)
            for learner in ("transition", "observant")
        ]
        assert none == ["No assistance", *expected]
    names = {path.stem for path in (folder / "figures").iterdir()}
    assert {name.partition("@")[2] for name in names} == {
        "perception=transition", "perception=observant",
    }  # fmt: skip
    differences = pl.read_csv(folder / "differences.csv")
    assert differences.group_by("learner").len()["len"].to_list() == [4, 4]


def test_retention_and_the_criterion_are_told(several):
    folder, page = several
    assert "and 2 more without the assistant" in page.text
    assert "The criterion is an unassisted return of \N{MINUS SIGN}20.0" in page.text
    head, none, *_ = page.tables["dependence"][0]
    [row] = (
        pl.read_csv(folder / "summary.csv")
        .filter(condition="none@perception=transition")
        .to_dicts()
    )
    assert none[head.index("retention")] == interval(row, "retention")
    episodes = pl.read_parquet(folder / "episodes.parquet")
    late = episodes.filter("retention", condition="none@perception=transition")
    assert row["retention_mean"] == pytest.approx(late["unassisted_return"].to_numpy().mean())


def test_what_an_earlier_analysis_left_is_removed_and_nothing_else(plain, tmp_path):
    folder = tmp_path / "again"
    shutil.copytree(plain, folder)
    stale = ["regret.csv", "figures/old.png", "figures/old.svg", "figures/old.csv"]
    own = ["notes.csv", "figures/notes.txt", "figures/mine.png", "figures/mine.svg", ".x.part"]
    for name in (*stale, *own):
        (folder / name).write_text("x", encoding="utf-8")
    before = set(contents_of(folder, "**/*"))
    write_report(folder)
    assert set(contents_of(folder, "**/*")) == before - set(stale)
