"""`qbumpers compare`, from the command to its page, and again."""

import json
import re

import polars as pl
import pytest

OPTIONS = (
    "--tasks", "cliff-walking,windy-gridworld", "--learner", "q-learning/perception=observant",
    "--assistants", "stochastic-q-bumpers,random-override,shield", "--episodes", 5,
    "--workers", 1,
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("comparison")


def cells(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("cells/**/*.parquet")}


def test_a_comparison_is_run_and_continued(call, folder):
    status, printed, errors = call("compare", *OPTIONS, "--trials", 4, "--out", folder)
    assert (status, errors) == (0, "")
    # Cliff Walking's shield has one setting: its risks are 0 and 1.
    assert "2 cases, 33 settings of assistants, 4 trials of 5 episodes each" in printed
    assert f"Report: {folder}/comparison.html" in printed
    points = pl.read_csv(folder / "points.csv")
    counts = points.group_by("task", "method").len()
    assert dict(counts.filter(task="windy-gridworld").select("method", "len").iter_rows()) == {
        "none": 1, "maximal": 1, "stochastic-q-bumpers": 8, "random-override": 8,
    }  # fmt: skip
    left_out = pl.read_csv(folder / "left_out.csv")
    assert left_out.rows() == [("windy-gridworld", "shield", "the task announces no crash")]

    before = cells(folder)
    status, printed, errors = call("compare", *OPTIONS, "--trials", 6, "--out", folder)
    assert (status, errors) == (0, "")
    after = cells(folder)
    assert before.items() <= after.items()
    # Two more trials of each setting, none of the anchors.
    assert len(after) - len(before) == 33 * 2
    assert pl.read_csv(folder / "cases.csv")["trials"].to_list() == [6, 6]
    assert (
        "--trials 6 --episodes 5" in json.loads((folder / "comparison.json").read_text())["command"]
    )


def test_the_page_needs_nothing_else(folder):
    page = (folder / "comparison.html").read_text(encoding="utf-8")
    assert not re.findall(r"(?:src|href)=\"(?!data:|#|figures/)", page)
    names = re.findall(r"href=\"(figures/[^\"]+)\"", page)
    assert names
    for name in names:
        assert (folder / name).is_file()
    for table in ("points", "matched", "cases", "methods"):
        assert f'download="{table}.csv"' in page
    for anchor in re.findall(r"href=\"#([^\"]+)\"", page):
        assert f'id="{anchor}"' in page


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--tasks", "cliff-wlking"), "did you mean 'cliff-walking'?"),
        (("--tasks", "lunar-lander"), "its observations are vectors"),
        (("--tasks", "cliff-walking,cliff-walking"), "occurs 2 times"),
        (("--tasks", "FrozenLake-v1"), "discount is missing"),
        (("--assistants", "undoo"), "did you mean 'undo'?"),
        (("--assistants", "none"), "unknown assistant to compare 'none'"),
        (("--tasks", "taxi", "--assistants", "shield"), "can carry none of shield"),
        (("--learner", "q-lerning"), "did you mean 'q-learning'?"),
        (("--learner", "q-learning/perception"), "a name with fields"),
        (("--learner", "q-learning/percption=observant"), "did you mean 'perception'?"),
        (("--learner", "double-dqn"), "double-dqn"),
        (("--trials", "1"), "--trials"),
    ],
)
def test_a_wrong_request_is_one_line_before_any_work(call, tmp_path, options, said):
    status, _, errors = call("compare", *options, "--out", tmp_path / "out")
    assert status == 2
    assert said in errors
    assert not (tmp_path / "out").exists()


def test_another_comparison_in_the_folder_is_refused(call, folder):
    status, _, errors = call("compare", *OPTIONS, "--trials", 6, "--seed", 1, "--out", folder)
    assert status == 2
    assert "seed" in errors
