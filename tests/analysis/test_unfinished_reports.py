"""A run that is not finished is reported as far as it is, and the report says what is missing."""

import json

import polars as pl
import pytest

import qbumpers
from qbumpers.analysis.report import write_report
from qbumpers.errors import RequestError
from qbumpers.experiments import cells
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.tables import EPISODES
from qbumpers.files import open_folder
from qbumpers.reproduction import report as reproduction_report
from qbumpers.reproduction.experiments import reproduction
from qbumpers.reproduction.printed import PUBLISHED
from qbumpers.tuning import tune
from tests.analysis.pages import Page
from tests.experiments.examples import BUMPERS, cells_of, run_into, settings

ASSISTANTS = [{"name": "none"}, {"name": "local-q-thresholding", "alpha": [0.2, 0.5]}, BUMPERS]
TRIALS, SIZE = 6, 2


def stopped(folder, after, **changes):
    """A run of cells of two trials that is stopped when so many are finished."""
    seen = []

    def stop(progress):
        seen.append(progress.trials)
        if progress.trials >= after * SIZE:
            raise KeyboardInterrupt

    changes = {"assistants": ASSISTANTS, "trials": TRIALS, **changes}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells, "EPISODES_A_CELL", SIZE * 4)
        if after == 0:
            stop_at_once = pytest.raises(KeyboardInterrupt)
            with stop_at_once:
                run_into(folder, report=stop, **changes)
            return folder
        with pytest.raises(KeyboardInterrupt):
            run_into(folder, report=stop, **changes)
    return folder


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return run_into(tmp_path_factory.mktemp("whole"), assistants=ASSISTANTS, trials=TRIALS)


@pytest.fixture(scope="module")
def part(tmp_path_factory):
    """Seven of fifteen cells."""
    return stopped(tmp_path_factory.mktemp("part") / "out", 7)


def test_what_there_is_is_loaded_if_that_is_asked_for(part, whole):
    with pytest.raises(RequestError, match="the run is not finished; run it again to continue"):
        qbumpers.load(part)
    results, expected = qbumpers.load(part, unfinished=True), qbumpers.load(whole)
    assert results.episodes.height == 7 * SIZE * 4
    keys = ["condition", "trial", "episode"]
    same = expected.episodes.join(results.episodes.select(keys), on=keys, how="semi")
    assert results.episodes.sort(keys).equals(same.sort(keys))
    counts = dict(
        results.episodes.group_by("condition").agg(pl.col("trial").n_unique()).iter_rows()
    )
    assert [each.condition for each in results.conditions] == [
        each.condition for each in expected.conditions
    ]
    assert results.missing == {
        each.condition: TRIALS - counts.get(each.condition, 0)
        for each in results.conditions
        if counts.get(each.condition, 0) < TRIALS
    }
    assert sum(results.missing.values()) == 8 * SIZE
    assert results.states is not None
    for counted in ("assisted", "unassisted"):
        steps = results.episodes.group_by("condition").agg(pl.col(f"{counted}_length").sum())
        states = results.states.group_by("condition").agg(pl.col(counted).sum())
        assert dict(steps.iter_rows()) == dict(states.iter_rows())
    assert expected.missing == {}
    assert qbumpers.load(whole, unfinished=True).episodes.equals(expected.episodes)


def test_its_report_says_which_conditions_lack_how_many_trials(part):
    findings = write_report(part)
    missing = qbumpers.load(part, unfinished=True).missing
    page = Page((part / "report.html").read_text(encoding="utf-8"))
    [first, *_] = findings.cautions
    assert first.startswith("The run is not finished: 14 of 30 trials are there, and ")
    for condition, number in missing.items():
        assert f"{condition} ({TRIALS - number} of {TRIALS})" in first
    assert "Not finished." in page.text
    [table] = page.tables["outcome"]
    assert [row[:3] for row in table[1:]] == [
        [condition, str(TRIALS - number), str(TRIALS)] for condition, number in missing.items()
    ]
    summary = pl.read_csv(part / "summary.csv")
    for row in summary.iter_rows(named=True):
        assert row["trials"] == TRIALS - missing.get(row["condition"], 0)


def test_the_command_reports_it_and_a_finished_one_says_nothing_of_it(part, whole, call):
    status, output, _ = call("report", part)
    assert status == 0
    assert "The run is not finished: 14 of 30 trials are there" in output
    status, output, _ = call("report", whole)
    assert (status, "not finished" in output) == (0, False)
    assert "Not finished" not in (whole / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("after", "common"),
    [
        (1, False),
        (4, True),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in [
            (1, True), (2, False), (2, True), (4, False), (13, False), (13, True),
        ]),
    ],
)  # fmt: skip
def test_a_run_is_reported_wherever_it_was_stopped(tmp_path, after, common):
    learners = [{"perception": ["transition", "observant"]}]
    several = [{"name": "none"}, BUMPERS]
    folder = stopped(
        tmp_path / "out", after, assistants=several, learners=learners, retention=1,
        common_random_numbers=common,
    )  # fmt: skip
    findings = write_report(folder)
    assert sum(findings.missing.values()) == 6 * TRIALS - after * SIZE
    run_into(
        folder, assistants=several, learners=learners, retention=1, trials=TRIALS,
        common_random_numbers=common,
    )  # fmt: skip
    assert write_report(folder).missing == {}


def test_nothing_finished_is_nothing_to_report(tmp_path):
    folder = stopped(tmp_path / "out", 0)
    assert cells_of(folder) == []
    with pytest.raises(RequestError, match="the run is not finished; run it again to continue"):
        write_report(folder)


def test_damaged_and_half_written_cells_are_not_among_what_there_is(tmp_path):
    folder = stopped(tmp_path / "out", 4)
    first, second, *_ = [path for path in cells_of(folder) if "-episodes-" in path.name]
    first.write_bytes(first.read_bytes()[:-1])
    second.unlink()
    results = qbumpers.load(folder, unfinished=True)
    assert results.episodes.height == 2 * SIZE * 4
    assert first.exists()  # whoever reads deletes nothing


def test_cells_that_other_code_made_are_not_among_what_there_is(tmp_path):
    folder = stopped(tmp_path / "out", 4)
    path = folder / "conditions.json"
    noted = json.loads(path.read_text(encoding="utf-8"))
    other = {**next(iter(noted["identities"].values())), "processor": "other"}
    for each in noted["conditions"]:
        each["identity"] = "0" * 16
    noted["identities"]["0" * 16] = other
    path.write_text(json.dumps(noted), encoding="utf-8")
    with pytest.raises(RequestError, match="not finished"):
        qbumpers.load(folder, unfinished=True)


def test_more_trials_of_a_finished_run_are_reported_while_they_are_simulated(tmp_path, whole):
    folder = run_into(tmp_path / "out", assistants=ASSISTANTS, trials=4)
    stopped(folder, 10, trials=TRIALS)
    assert sum(write_report(folder).missing.values()) in range(1, 11)


def test_what_tuning_simulated_is_reported(tmp_path):
    plan = make_plan(make_experiment(settings(trials=10, assistants=ASSISTANTS)))
    tune(plan, tmp_path, floor=-1e6, backend=ThisMachine(1))
    findings = write_report(tmp_path)
    assert findings.summary["trials"].to_list() == [
        10 - findings.missing.get(condition, 0) for condition in findings.summary["condition"]
    ]


def test_a_folder_elsewhere_is_reported_too(part, tmp_path, call):
    url = f"memory://{tmp_path.name}/run"
    folder = open_folder(url)
    for path in [*part.glob("*.*"), *cells_of(part)]:
        if path.is_file():
            folder.write(path.relative_to(part).as_posix(), path.read_bytes())
    folder.remove("report.html")
    status, output, _ = call("report", url)
    assert status == 0
    assert "14 of 30 trials are there" in output
    assert b"Not finished." in (folder.read("report.html") or b"")


def test_a_paper_s_numbers_get_no_verdict_before_the_run_is_finished(tmp_path):
    plan = make_plan(reproduction("cliff-walking", trials=2))

    def stop(progress):
        if progress.trials >= 46:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_experiment(plan, tmp_path, backend=ThisMachine(1), report=stop)
    assert not (tmp_path / EPISODES).exists()
    findings = reproduction_report.write_report(tmp_path)
    assert findings.additions.tables[PUBLISHED]["agrees"].drop_nulls().is_empty()
    assert findings.additions.cautions == [
        "No verdict is given on the numbers that the paper prints: the run is not finished."
    ]
