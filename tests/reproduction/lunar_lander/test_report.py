"""Lunar Lander: its report, its archive, and the page that is made of that; all made up."""

import importlib
import subprocess
import sys
import tomllib
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from qbumpers.analysis.archive import (
    archive_run,
    archive_trials,
    load_archive,
    read_trials,
    trials_of_runs,
)
from qbumpers.analysis.figures.curves import learning_curves, override_courses
from qbumpers.analysis.findings import find_tables
from qbumpers.analysis.measures import trial_measures
from qbumpers.errors import RequestError
from qbumpers.experiments.store import FORMAT, load
from qbumpers.reproduction.lunar_lander.claims import decisive_conditions, experiment_claims
from qbumpers.reproduction.report import find, write_report
from qbumpers.values import shipped
from tests.analysis.pages import Page
from tests.reproduction.lunar_lander.landings import made_up

DOCS = Path(__file__).parents[3] / "docs"
FEW = [
    {"name": "none"},
    {"name": "maximal"},
    {"name": "local-q-thresholding", "alpha": [0.5, 0.9, 0.99, 1.0], "second": False},
    {"name": "stochastic-q-bumpers", "alpha": [0.5, 1.0], "second": False},
]
CHOSEN = [
    "none", "maximal", "stochastic-q-bumpers/alpha=1", "local-q-thresholding/alpha=0.99",
]  # fmt: skip


@pytest.fixture(scope="module")
def landed(tmp_path_factory):
    """A small experiment, and its report."""
    folder = made_up(tmp_path_factory.mktemp("landed"), trials=3, episodes=120, assistants=FEW)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(landed):
    return Page((landed / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def kept(landed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept")
    archive_run(landed, folder, decisive_conditions)
    archive_trials({"relu": landed, "of=two": landed}, folder)
    return folder


def test_a_run_without_states_is_reported_with_claims_and_without_maps(landed, page):
    assert page.sections == [
        "outcome", "frontier", "methods", "claims", "control", "curves", "sensitivity",
        "overrides", "dependence", "distribution", "conditions", "measures", "again",
    ]  # fmt: skip
    drawn = {path.stem for path in (landed / "figures").iterdir()}
    assert drawn == {
        "frontier", "tradeoffs", "differences-from-none", "learning-curves", "success-curves",
        "override-course", "sensitivity", "distribution",
    }  # fmt: skip
    assert len(page.pictures) == len(drawn)
    assert "The paper prints no numbers for it" in page.text


def test_curves_of_the_decisive_conditions_are_drawn_by_blocks(landed):
    for name in ("learning-curves", "success-curves"):
        numbers = pl.read_csv(landed / "figures" / f"{name}.csv")
        assert numbers["condition"].unique(maintain_order=True).to_list() == CHOSEN
        assert numbers.height == len(CHOSEN) * 60


def test_claims_stand_in_the_page_as_in_their_table(landed, page):
    table = pl.read_csv(landed / "claims.csv")
    verdicts = dict(table.select("claim", "verdict").unique(maintain_order=True).iter_rows())
    assert len(verdicts) == 3
    for title, verdict in verdicts.items():
        assert f"The paper's claim that {title}: {verdict}" in page.text
        assert f"{title} {verdict.capitalize()}." in page.text
    destroys, keeps, covers = page.tables["claims"]
    assert [row[0] for row in destroys[1:]] == [
        f"Local Q-Thresholding, α = {alpha}" for alpha in ("0.9", "0.99")
    ]
    assert len(keeps[1:]) == 2
    rows = table.filter(pl.col("condition").fill_null("") == "").to_dicts()
    assert [row[0] for row in covers[1:]] == [row["what"] for row in rows]
    words = {True: "yes", False: "no", None: "not sure"}
    assert [row[3] for row in covers[1:]] == [words[row["speaks_for"]] for row in rows]


def test_success_and_crash_rates_are_in_the_table_of_conditions(landed, page):
    [head, none, *_] = page.tables["conditions"][0]
    row = pl.read_csv(landed / "summary.csv").row(0, named=True)
    for event in ("success", "crash"):
        share = f"{100 * row[f'unassisted_{event}_mean']:.0f}%"
        assert none[head.index(f"unassisted {event}")] == share


@pytest.mark.parametrize(("trials", "claims"), [(1, 2), (2, 3)])
def test_few_trials_are_judged_as_far_as_they_go(tmp_path, trials, claims):
    results = load(made_up(tmp_path, trials=trials, episodes=5, assistants=FEW))
    [section] = find(results).additions.sections
    assert sum("<h3>" in str(part) for part in section.content) == claims


@pytest.mark.slow
def test_a_single_trial_is_reported_too(tmp_path):
    write_report(made_up(tmp_path, trials=1, episodes=5, assistants=FEW))
    assert "There is one trial per condition" in (tmp_path / "report.html").read_text("utf-8")


def test_what_is_kept_tells_the_same_as_the_run(landed, kept):
    found, results = load_archive(kept), load(landed)
    assert found.experiment == results.experiment
    assert found.run["format"] == FORMAT
    trials = trial_measures(results.episodes, results.experiment.criterion)
    assert_frame_equal(found.trials, trials, rel_tol=1e-6, check_dtypes=False)
    curves = learning_curves(results.episodes, CHOSEN)
    assert_frame_equal(found.curves.select(curves.columns), curves, rel_tol=1e-6)
    success = learning_curves(results.episodes, CHOSEN, "success")
    assert_frame_equal(found.curves.select(success.columns), success, rel_tol=1e-6)
    courses = override_courses(results.episodes, CHOSEN)
    assert_frame_equal(found.overrides, courses, rel_tol=1e-6)
    again, before = find_tables(found.trials, found.experiment, found.conditions), find(results)
    assert_frame_equal(again.summary, before.summary, rel_tol=1e-4)
    archived, fresh = (
        [claim.verdict for claim in experiment_claims(each, found.experiment)]
        for each in (found.trials, trials)
    )
    assert archived == fresh
    assert before.additions.tables["claims.csv"]["verdict"].unique().sort().to_list() == sorted(
        set(fresh)
    )


def test_trials_of_several_runs_are_kept_with_their_names(landed, kept):
    found = read_trials(kept / "runs.csv")
    assert found["run"].unique(maintain_order=True).to_list() == ["relu", "of=two"]
    fresh = trials_of_runs({"relu": landed, "of=two": landed})
    assert_frame_equal(found, fresh, rel_tol=1e-6, check_dtypes=False)


def test_what_was_not_kept_or_did_not_finish_is_named(kept, tmp_path):
    with pytest.raises(RequestError, match=r"trials\.csv: there is no such file"):
        read_trials(tmp_path / "trials.csv")
    (tmp_path / "experiment.toml").write_bytes((kept / "experiment.toml").read_bytes())
    with pytest.raises(RequestError, match=r"trials\.csv: there is no such file"):
        load_archive(tmp_path)
    with pytest.raises(RequestError, match="holds no experiment"):
        archive_run(tmp_path / "nowhere", tmp_path, decisive_conditions)


@pytest.fixture
def write_page(monkeypatch):
    """Write the page without drawing its figures; its text, and their names."""
    monkeypatch.syspath_prepend(DOCS)
    script = importlib.import_module("make_lunar_lander")
    drawn = []
    monkeypatch.setattr(
        script, "keep_picture", lambda figure, images, name, colours: drawn.append(name)
    )

    def write(folder, *arguments):
        drawn.clear()
        folder.mkdir(exist_ok=True)
        monkeypatch.setattr(sys, "argv", ["make_lunar_lander.py", str(folder), *arguments])
        script.main()
        return (folder / "lunar-lander.md").read_text(encoding="utf-8"), list(drawn)

    return write


def test_the_page_is_made_from_a_run_and_again_from_what_was_kept(landed, write_page, tmp_path):
    data = tmp_path / "data"
    arguments = ["--keep", str(landed), "--hours", "2.5", "--machine", "two cores"]
    runs = ["--runs", f"relu={landed}", f"second expert={landed}"]
    first, drawn = write_page(tmp_path / "page", "--data", str(data), *arguments, *runs)
    about = tomllib.loads((data / "about.toml").read_text(encoding="utf-8"))
    assert about == {"hours": 2.5, "machine": "two cores"}
    assert "the run took 2.5 hours on two cores" in first
    results = load(landed)
    trials = trial_measures(results.episodes, results.experiment.criterion)
    for claim in experiment_claims(trials, results.experiment):
        assert f"- {claim.title}: {claim.verdict}" in first
        assert f"### {claim.title}\n\n**{claim.verdict.capitalize()}.**" in first
    assert "| second expert | 3 |" in first
    assert {f"images/{name}.png" for name in drawn} == {
        part.partition(")")[0] for part in first.split("](")[1:] if part.startswith("images/")
    }
    assert write_page(tmp_path / "again", "--data", str(data))[0] == first
    for name in ("runs.csv", "about.toml"):
        (data / name).unlink()
    alone, _ = write_page(tmp_path / "again", "--data", str(data))
    assert "## Other settings" not in alone
    assert "the run took" not in alone


def test_words_on_the_results_are_told_until_others_are_kept(landed, write_page, tmp_path):
    data = tmp_path / "data"
    write_page(tmp_path / "page", "--data", str(data), "--keep", str(landed))
    (data / "reading.txt").write_text("**Bumpers teach.**\n", encoding="utf-8")
    text, _ = write_page(tmp_path / "page", "--data", str(data))
    assert "## What to make of it\n\n**Bumpers teach.**\n\n## The paper's claims" in text
    text, _ = write_page(tmp_path / "page", "--data", str(data), "--hours", "3")
    assert "**Bumpers teach.**" in text
    text, _ = write_page(tmp_path / "page", "--data", str(data), "--keep", str(landed))
    assert "What to make of it" not in text


def checks_that(exceed, episodes=6):
    """Made-up checks: greedy episodes of ten steps, and others with a crash after three."""
    rows = [
        ("greedy" if greedy else "10% random", episode, time, None if greedy else 3 - time, 0.5)
        for greedy in (True, False)
        for episode in range(episodes)
        for time in range(10 if greedy else 3)
    ]
    names = ["policy", "episode", "time", "before_crash", "distance"]
    found = pl.DataFrame(rows, schema=names, orient="row", infer_schema_length=None)
    return found.with_columns(
        pl.lit(True).alias("at_random"),
        value=50.0 + exceed,
        achieved=pl.when(pl.col("time") == 0).then(None).otherwise(50.0 + pl.col("episode")),
    )


def test_q_values_are_checked_kept_and_told(kept, write_page, monkeypatch, tmp_path):
    file = Path(shipped.__file__).parent / "built_in" / "lunar-lander.npz"
    excesses = iter([20.0, -5.0])
    monkeypatch.setattr(
        importlib.import_module("make_lunar_lander"),
        "check_values",
        lambda task, values, *, discount: checks_that(next(excesses)),
    )
    asked = ["--quality", f"expert={file}", f"a=second={file}"]
    text, drawn = write_page(tmp_path / "page", "--data", str(kept), *asked)
    table = pl.read_csv(kept / "quality.csv")
    assert table.height == 2 * (6 + 6 * 3)  # of greedy episodes, only their start
    assert "lunar-lander-quality" in drawn
    dash = "\N{EN DASH}"
    for name, claimed, bias, share in (
        ("expert", 70.0, 17.5, "100%"),
        ("a=second", 45.0, -7.5, "0%"),
    ):
        [row] = [line for line in text.splitlines() if line.startswith(f"| {name} |")]
        cells = [cell.strip().replace("\N{MINUS SIGN}", "-") for cell in row.split("|")[2:-1]]
        assert float(cells[0]) == claimed
        assert cells[1] == dash  # the return of the start is not known here
        assert float(cells[2].split()[0].split("\N{NO-BREAK SPACE}")[0]) == bias
        assert cells[4] == share
        assert float(cells[5].split("\N{NO-BREAK SPACE}")[0]) == claimed
        assert float(cells[6]) == 52.5
    (kept / "quality.csv").unlink()


def test_every_row_of_the_pages_tables_has_as_many_cells_as_its_head(kept, write_page, tmp_path):
    text, _ = write_page(tmp_path / "page", "--data", str(kept))
    tables = [block.splitlines() for block in text.split("\n\n") if block.startswith("|")]
    assert len(tables) == 6
    for lines in tables:
        assert lines[1].startswith("|---")
        assert len(lines) > 2
        assert {line.count("|") for line in lines} == {lines[0].count("|")}


@pytest.mark.skipif(not (DOCS / "lunar-lander.md").is_file(), reason="the page is not there yet")
def test_the_page_says_what_its_script_finds(write_page, tmp_path):
    """The committed page is exactly what the script writes, and its pictures are there."""
    fresh, drawn = write_page(tmp_path / "page")
    assert (DOCS / "lunar-lander.md").read_text(encoding="utf-8") == fresh
    assert all((DOCS / "images" / f"{name}.png").is_file() for name in drawn)


@pytest.mark.slow
def test_the_figures_of_the_page_are_small_pictures(kept, tmp_path):
    script = DOCS / "make_lunar_lander.py"
    subprocess.run([sys.executable, script, tmp_path, "--data", kept], check=True)
    pictures = list((tmp_path / "images").iterdir())
    assert len(pictures) == 6
    assert all(path.stat().st_size < 120_000 for path in pictures)
