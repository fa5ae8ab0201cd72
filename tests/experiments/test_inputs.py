"""What an experiment names is read once: later, what the folder kept is used, or it is refused."""

from typing import NamedTuple

import numpy as np
import polars as pl
import pytest

from qbumpers.assistants import register_assistant
from qbumpers.decisions import Decision
from qbumpers.errors import RequestError
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.recordings import export_recording
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from qbumpers.learners import make_learner, register_learner
from qbumpers.registration import File
from qbumpers.simulation import make_condition, record, run
from qbumpers.tasks import cliff_walking, registry
from qbumpers.tuning import tune
from qbumpers.values import TabularValues, solve
from tests.experiments.examples import cells_of, contents_of, rows_of, run_into, settings
from tests.learners import own_learners

TABLES = ("*.parquet", "values.npz", "cells/**/*", "files/*")
OWN = {"name": "by-file", "chances": "chances.csv"}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def save_values(path, sign):
    values = solve(cliff_walking())
    TabularValues(sign * values.table, 1.0, "cliff-walking", "made up").save(path)


class Chances(NamedTuple):
    chances: File


def by_file(situation, noise, options):
    """Override by the chance that a file gives each action."""
    chance = options.chances[0, situation.proposed]
    action = 1 if noise.coin < chance else situation.proposed
    return Decision(action, chance)


@pytest.fixture
def own_rule(own_registry, here):
    register_assistant("by-file", Chances)(by_file)
    np.savetxt("chances.csv", [[0.9, 0.8, 0.7, 0.6]], delimiter=",")


def exported(folder, condition, monkeypatch, trials=1):
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder / "datasets"))
    export_recording(folder / "out", condition, "mine-v0", trials=trials)
    dataset = minari.load_dataset("mine-v0")
    return [float(dataset[number].rewards.sum()) for number in range(dataset.total_episodes)]


def returns_of(folder, condition):
    rows = load(folder).episodes.filter(pl.col("condition") == condition, pl.col("trial") == 0)
    return rows["assisted_return"].to_list()


def test_values_are_those_that_the_folder_kept(here, monkeypatch):
    save_values("v.npz", 1)
    run_into("out", values="v.npz", assistants=[{"name": "maximal"}])
    expected = returns_of("out", "maximal")
    save_values("v.npz", -1)
    assert exported(here, "maximal", monkeypatch) == expected
    assert (
        load("out").values.digest()
        == TabularValues(solve(cliff_walking()).table, 1.0, "cliff-walking", "").digest()
    )


@pytest.mark.parametrize(
    "use",
    [lambda plan: run_experiment(plan, "out"), lambda plan: tune(plan, "out", floor=0.0)],
    ids=["run", "tune"],
)
def test_values_that_changed_are_refused_and_what_is_there_stays(here, use):
    save_values("v.npz", 1)
    changes = {"values": "v.npz", "assistants": [{"name": "maximal"}]}
    run_into("out", **changes)
    before = contents_of("out", *TABLES, "*.toml", "*.json")
    save_values("v.npz", -1)
    message = r"holds another experiment \(values = 'v\.npz' are not those in its values\.npz\)"
    plan = make_plan(make_experiment(settings(**changes)))
    with pytest.raises(RequestError, match=message):
        use(plan)
    assert contents_of("out", *TABLES, "*.toml", "*.json") == before
    save_values("v.npz", 1)
    run_into("out", **changes, trials=6)


def test_a_task_that_behaves_otherwise_under_its_name_is_refused(here, monkeypatch):
    """Its table may come from a file, or from code."""
    tasks = dict(registry._tasks)
    monkeypatch.setattr(registry, "_tasks", tasks)
    save_values("v.npz", 1)
    changes = {"task": "mine", "values": "v.npz", "assistants": [{"name": "none"}]}

    def limited(steps):
        return lambda: type(cliff_walking())(**{**vars(cliff_walking()), "episode_limit": steps})

    tasks["mine"] = limited(20)
    run_into("out", **changes)
    tasks["mine"] = limited(30)
    with pytest.raises(RequestError, match=r"\(task 'mine' does not behave as it did\)"):
        run_into("out", **changes)
    tasks["mine"] = limited(20)
    run_into("out", **changes)


@pytest.mark.parametrize("over", [pytest.param(False, marks=pytest.mark.slow), True])
def test_files_of_options_are_those_that_the_folder_kept(own_rule, here, monkeypatch, over):
    rule = {"name": "budget", "per_episode": 4, "of": OWN} if over else OWN
    run_into("out", assistants=[rule])
    [condition] = load("out").episodes["condition"].unique()
    expected = returns_of("out", condition)
    np.savetxt("chances.csv", [[0.0, 0.0, 0.0, 0.0]], delimiter=",")
    assert exported(here, condition, monkeypatch) == expected
    [noted] = load("out").conditions
    assert np.load(here / "out" / noted.files["chances.csv"]).tolist() == [[0.9, 0.8, 0.7, 0.6]]


def test_a_file_of_an_option_that_changed_makes_another_condition_and_is_named(own_rule, here):
    reports = []
    run_into("out", assistants=[OWN, {"name": "none"}], trials=2)
    first, before = rows_of("out"), cells_of("out")
    np.savetxt("chances.csv", [[0.1, 0.2, 0.3, 0.4]], delimiter=",")
    run_into("out", assistants=[OWN, {"name": "none"}], trials=2, report=reports.append)
    assert reports[0].trials == 2
    assert reports[0].changed == [
        "by-file/chances=chances.csv: the file chances.csv changed since they were simulated; 2 "
        "trials are simulated again"
    ]
    assert rows_of("out") != first
    assert set(before) < set(cells_of("out"))
    np.savetxt("chances.csv", [[0.9, 0.8, 0.7, 0.6]], delimiter=",")
    run_into("out", assistants=[OWN, {"name": "none"}], trials=2, report=reports.append)
    assert rows_of("out") == first
    assert reports[-1].steps == 0


class Hopeful(NamedTuple):
    discount: float = 1.0
    hopes: File = "hopes.csv"


def hoped_values(settings, shape, stream):
    return own_learners.Values(np.zeros((shape.states, 4)) + settings.hopes[0, :4])


@pytest.fixture
def own_learner(own_registry, here):
    np.savetxt("hopes.csv", [[1.0, 2.0, 3.0, 4.0]], delimiter=",")
    return register_learner(
        "hopeful", Hopeful, start=hoped_values, choose=own_learners.best,
        prefer=own_learners.prefer_best, policy=own_learners.always_best,
        learn=lambda settings, memory, transition, rates, stream: None,
    )  # fmt: skip


def test_a_learner_s_file_is_read_once_and_is_part_of_its_condition(own_learner):
    def condition():
        learner = make_learner("hopeful")
        return make_condition(cliff_walking(), "none", learner=learner, episodes=2)

    first = condition()
    expected = run(first, trials=2).outcomes.assisted_return.tolist()
    np.savetxt("hopes.csv", [[4.0, 3.0, 2.0, 1.0]], delimiter=",")
    assert run(first, trials=2).outcomes.assisted_return.tolist() == expected
    assert condition().content() != first.content()
    np.savetxt("hopes.csv", [[1.0, 2.0, 3.0, 4.0]], delimiter=",")
    assert condition().content() == first.content()


def test_a_learner_s_file_is_kept_and_named_when_it_changes(own_learner, here, monkeypatch):
    changes = {"learners": [{"name": "hopeful"}], "assistants": [{"name": "none"}], "trials": 2}
    run_into("out", **changes)
    expected, reports = returns_of("out", "none"), []
    np.savetxt("hopes.csv", [[4.0, 3.0, 2.0, 1.0]], delimiter=",")
    assert exported(here, "none", monkeypatch) == expected
    run_into("out", **changes, report=reports.append)
    assert reports[0].changed == [
        "none: the file hopes.csv changed since they were simulated; 2 trials are simulated again"
    ]


def test_what_is_played_again_is_what_was_run_or_refused(here, monkeypatch):
    run_into("out", assistants=[{"name": "maximal"}])
    monkeypatch.setattr(
        "qbumpers.experiments.recordings.record",
        lambda condition, trial, seed: record(condition, trial=trial, seed=seed + 1),
    )
    with pytest.raises(
        RequestError, match=r"trial 0 is not what was run: in episode \d+ the return"
    ):
        exported(here, "maximal", monkeypatch)
    assert not (here / "datasets" / "mine-v0").exists()
