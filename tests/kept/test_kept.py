"""Numbers that stay: what simulations gave before a change, to the bit, and folders from before."""

import copy
import json
import shutil

import pytest

from qbumpers.analysis.archive import read_trials, write_rounded
from qbumpers.analysis.measures import trial_measures
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load, run_description
from qbumpers.reproduction.experiments import reproduction
from tests.experiments.examples import contents_of
from tests.kept.measuring import (
    HERE,
    NUMBERS,
    experiments,
    recorded_numbers,
    revisions_of,
    run_numbers,
    tuned_numbers,
    unmarked_changes,
)

KEPT = json.loads(NUMBERS.read_text(encoding="utf-8"))
PUBLISHED = HERE.parents[1] / "docs" / "data" / "lunar-lander" / "trials.csv"
CELLS = "cells/**/*.parquet"


def each_experiment():
    """Names; compiling deep learners of several shapes for several rules takes minutes."""
    return [
        pytest.param(name, marks=[] if experiment.tabular else pytest.mark.slow)
        for name, experiment in experiments().items()
    ]


@pytest.mark.parametrize("name", each_experiment())
def test_the_numbers_of_an_experiment_stay(name):
    experiment = experiments()[name]
    assert run_numbers(experiment) == KEPT[name]["episodes"]
    if "steps" in KEPT[name]:
        assert recorded_numbers(experiment) == KEPT[name]["steps"]


def test_revisions_are_those_with_which_numbers_were_kept():
    """A raised revision needs `python -m tests.kept.measuring`, which takes minutes."""
    for name, experiment in experiments().items():
        kept = {c: numbers["revisions"] for c, numbers in KEPT[name]["episodes"].items()}
        assert revisions_of(make_plan(experiment)) == kept, name


@pytest.mark.parametrize("part", ["episodes", "steps"])
def test_numbers_are_not_kept_anew_without_a_raised_revision(part):
    now = copy.deepcopy(KEPT)
    assert unmarked_changes(KEPT, now) == []
    found = now["taxi"][part]
    changed = found["none"]
    found["none"] = {**changed, "digest": "0"} if part == "episodes" else "0"
    assert unmarked_changes(KEPT, now) == ["taxi: none"]
    now["taxi"]["episodes"]["none"]["revisions"]["engine"] += 1
    assert unmarked_changes(KEPT, now) == []


def test_what_tune_chooses_stays():
    assert tuned_numbers() == KEPT["tune"]


@pytest.fixture
def old(tmp_path):
    """A copy of an output folder that the version before wrote, and its experiment."""
    shutil.copytree(HERE / "folder", tmp_path / "old")
    return tmp_path / "old", load(tmp_path / "old").experiment


def continued(folder, experiment):
    """How many trials were there, and how many there are in all, of an experiment that goes on."""
    reports = []
    plan = make_plan(experiment)
    run_experiment(plan, folder, backend=ThisMachine(1), report=reports.append)
    assert reports[0].damaged == []
    return reports[0].trials, reports[-1].trials


def test_a_folder_from_before_is_read(old):
    folder, experiment = old
    assert run_description(folder)["version"] == "0.1.0"
    results = load(folder)
    ids = [
        f"{assistant}@perception={perception}"
        for perception in ("transition", "disruption")
        for assistant in (
            "none", "stochastic-q-bumpers/alpha=0.3", "stochastic-q-bumpers/alpha=0.7",
        )
    ]  # fmt: skip
    assert [named.condition for named in experiment.conditions()] == ids
    assert results.episodes["condition"].unique(maintain_order=True).to_list() == ids
    assert results.episodes.height == 6 * 3 * 14
    measures = trial_measures(results.episodes, experiment.criterion)
    assert set(measures["condition"]) == set(ids)


def test_a_folder_from_before_goes_on_without_running_a_cell_again(old):
    folder, experiment = old
    before = contents_of(folder, CELLS, "episodes.parquet", "states.parquet")
    assert continued(folder, experiment) == (18, 18)
    assert contents_of(folder, CELLS, "episodes.parquet", "states.parquet") == before


def test_a_folder_from_before_goes_on_with_what_is_new(old, tmp_path):
    folder, experiment = old
    before = contents_of(folder, CELLS)
    more = make_experiment({**experiment.model_dump(exclude_none=True), "trials": 5})
    assert continued(folder, more) == (18, 30)
    after = contents_of(folder, CELLS)
    assert before.items() < after.items()
    assert len(after) - len(before) == 6 * 2  # a cell of two tables per condition
    continued(tmp_path / "anew", more)
    assert load(folder).episodes.equals(load(tmp_path / "anew").episodes)


@pytest.mark.slow
def test_learners_of_lunar_lander_at_full_length_stay_as_published(tmp_path):
    whole = reproduction("lunar-lander", trials=1).model_dump(exclude_none=True)
    chosen = [{"name": "none"}, {"name": "maximal"}, {"name": "stochastic-q-bumpers", "alpha": 1.0}]
    options = {each["name"]: each for each in whole["assistants"]}
    whole["assistants"] = [{**options[each["name"]], **each} for each in chosen]
    run_experiment(make_plan(make_experiment(whole)), tmp_path / "out", backend=ThisMachine(2))
    results = load(tmp_path / "out")
    trials = trial_measures(results.episodes, results.experiment.criterion)
    write_rounded(tmp_path / "trials.csv", trials)
    found = {row["condition"]: row for row in read_trials(tmp_path / "trials.csv").to_dicts()}
    published = {
        row["condition"]: row for row in read_trials(PUBLISHED).to_dicts() if row["trial"] == 0
    }
    assert found == {condition: published[condition] for condition in found}
    assert len(found) == 3
