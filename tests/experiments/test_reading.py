"""What a folder holds is read by programs that know none of the code that made it."""

import contextlib
import subprocess
import sys

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.archive import archive_run, load_archive
from qbumpers.analysis.report import write_report
from qbumpers.assistants import assistants, registry
from qbumpers.errors import RequestError
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from qbumpers.learners import learners
from qbumpers.learners import registry as learner_registry
from qbumpers.tasks import cliff_walking, task_names
from qbumpers.tasks import registry as task_registry
from tests.experiments.examples import run_into, settings
from tests.experiments.own_files import OwnFiles
from tests.experiments.test_inputs import Chances, by_file
from tests.experiments.test_reuse import marks_removed
from tests.processes import ENVIRONMENT

MINE = {"name": "mine", "alpha": [0.1, 0.2]}
OWN = {
    "task": "mine",
    "learners": [{"name": "own", "first": [1, 2]}, {"name": "q-learning"}],
    "assistants": [MINE, {"name": "budget", "per_episode": 2, "of": "mine"}, {"name": "none"}],
    "trials": 3,
    "criterion": -20.0,
}


@contextlib.contextmanager
def another_process(place):
    """Files of a user's own, which nobody knows after the block."""
    with pytest.MonkeyPatch.context() as patch:
        registries = {
            registry: ("_rules", "_rules_by_options"),
            learner_registry: ("_learners", "_learners_by_settings"),
            task_registry: ("_tasks",),
        }
        for module, names in registries.items():
            for name in names:
                patch.setattr(module, name, dict(getattr(module, name)))
        place.mkdir()
        yield OwnFiles(place, patch)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run with a rule, a learner and a task that are not registered any more."""
    place = tmp_path_factory.mktemp("made")
    with another_process(place / "own") as files:
        files.register_rule()
        files.register_learner()
        task_registry.register_task("mine", cliff_walking)
        ids = [each.condition for each in make_experiment(settings(**OWN)).conditions()]
        run_into(place / "out", **OWN)
    assert "mine" not in assistants()
    assert "own" not in learners()
    assert "mine" not in task_names()
    return place / "out", ids


def test_its_results_are_loaded(made):
    folder, ids = made
    results = load(folder)
    assert len(ids) == 3 * 4
    assert [each.condition for each in results.conditions] == ids
    assert results.episodes["condition"].unique(maintain_order=True).to_list() == ids
    assert [each.name for each in results.experiment.learners] == ["own", "own", "q-learning"]
    assert results.experiment.learners[1].model_dump()["first"] == 2
    assert results.experiment.task.name == "mine"
    first = results.conditions[0]
    assert (first.assistant, first.alpha, first.options) == ("mine", 0.1, {"alpha": 0.1})
    over = next(each for each in results.conditions if each.assistant == "budget")
    assert over.options == {"of": '{name="mine"}', "per_episode": 2}


def test_its_report_is_written(made):
    folder, ids = made
    findings = write_report(folder)
    assert findings.summary["condition"].to_list() == ids
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "mine/alpha=0.1" in page.replace("<wbr>", "")
    summary = pl.read_csv(folder / "summary.csv")
    mine = summary.filter(assistant="mine")
    assert sorted(set(mine["alpha"])) == [0.1, 0.2]
    rows = load(folder).episodes.filter(condition=ids[0], retention=False)
    mean = rows.group_by("trial").agg(pl.mean("assisted_return"))["assisted_return"].mean()
    assert mine.filter(condition=ids[0])["assisted_mean"].item() == pytest.approx(mean)


@pytest.mark.slow
def test_the_command_reports_it(made):
    done = subprocess.run(
        [sys.executable, "-m", "qbumpers", "report", made[0]],
        capture_output=True, text=True, env=ENVIRONMENT, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert 'budget/of={name="mine"}' in done.stdout


def test_it_is_archived_and_the_archive_read(made, tmp_path):
    folder, ids = made
    archive_run(folder, tmp_path, lambda trials: ids[:2])
    archive = load_archive(tmp_path)
    assert [each.condition for each in archive.conditions] == ids
    assert archive.experiment == load(folder).experiment
    assert set(archive.trials["condition"]) == set(ids)


@pytest.mark.parametrize(
    ("missing", "message"),
    [
        ("all", r"task 'mine'"),
        ("rule and learner", r"learners\.name = 'own': no learner of that name .* is registered"),
        ("rule", r"unknown assistant 'mine'"),
    ],
)
def test_only_who_wants_to_simulate_is_told_what_is_missing(made, tmp_path, missing, message):
    with another_process(tmp_path / "own") as files:
        if missing != "all":
            task_registry.register_task("mine", cliff_walking)
        if missing == "rule":
            files.register_learner()
        with pytest.raises(RequestError, match=message):
            make_plan(load(made[0]).experiment)


@pytest.mark.slow
def test_what_is_registered_otherwise_by_now_does_not_matter(made, tmp_path):
    """Names and options of today are not those of the run."""
    folder, ids = made
    with another_process(tmp_path / "own") as files:
        files.edit("own_rule", "alpha: float = 0.5", "beta: int = 3")
        files.edit("own_learner", "first: int = 0", "other: float = 0.0")
        files.register_rule()
        files.register_learner()
        assert [each.condition for each in load(folder).conditions] == ids
        write_report(folder)


def test_an_old_folder_is_read_without_the_code_too(made, tmp_path):
    with another_process(tmp_path / "own") as files:
        files.register_rule()
        run_into(tmp_path / "out", assistants=[MINE, {"name": "none"}], trials=2)
    marks_removed(tmp_path / "out")
    results = load(tmp_path / "out")
    assert [tuple(each[:5]) for each in results.conditions] == [
        ("mine/alpha=0.1", "mine", 0.1, "q-learning", {"alpha": 0.1}),
        ("mine/alpha=0.2", "mine", 0.2, "q-learning", {"alpha": 0.2}),
        ("none", "none", None, "q-learning", {}),
    ]
    assert write_report(tmp_path / "out").summary["alpha"].to_list() == [0.1, 0.2, None]


def test_a_file_of_an_option_need_not_be_there_any_more(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savetxt("chances.csv", [[0.9, 0.8, 0.7, 0.6]], delimiter=",")
    with another_process(tmp_path / "own"):
        registry.register_assistant("by-file", Chances)(by_file)
        run_into("out", assistants=[{"name": "by-file", "chances": "chances.csv"}], trials=2)
        (tmp_path / "chances.csv").unlink()
        assert load("out").conditions[0].options == {"chances": "chances.csv"}
        assert write_report("out").summary.height == 1


def test_a_design_that_was_edited_by_hand_is_still_checked(made, tmp_path):
    design = (made[0] / "experiment.toml").read_text(encoding="utf-8")
    for old, new, message in (
        ("trials = 3", "trials = 0", r"trials = 0: "),
        (
            'perception = "transition"',
            "perception = 3",
            r"learners\.perception = 3; a name or a table",
        ),
        ('name = "mine"', "nome = 3", r"nome"),
    ):
        (tmp_path / "experiment.toml").write_text(design.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(RequestError, match=message):
            load(tmp_path)
