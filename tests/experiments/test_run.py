"""What a run writes, and that its numbers depend on nothing but the experiment."""

import platform
import tomllib
from importlib.metadata import version

import numpy as np
import polars as pl
import pytest

import qbumpers
from qbumpers.assistants import make_assistant
from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.experiments import cells
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.simulation import simulate
from qbumpers.tasks import cliff_walking
from qbumpers.values import load_values, solve
from tests.experiments.examples import (
    BUMPERS,
    LAKE,
    cells_of,
    contents_of,
    ids_of,
    rows_of,
    run_into,
    settings,
)

EPISODE_COLUMNS = [
    "condition", "assistant", "alpha", "learner", "trial", "episode", "retention",
    "assisted_return", "unassisted_return", "assisted_length", "unassisted_length", "overrides",
    "assisted_success", "unassisted_success", "assisted_crash", "unassisted_crash",
]  # fmt: skip
NAMES = ["none", "stochastic-q-bumpers/alpha=0.3", "stochastic-q-bumpers/alpha=0.7"]
THRESHOLDS = {"name": "local-q-thresholding", "alpha": 0.0195, "second": True}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return run_into(tmp_path_factory.mktemp("run") / "small")


@pytest.fixture
def small_blocks(monkeypatch):
    """Two trials per cell, so that five trials make three cells of a condition."""
    monkeypatch.setattr(cells, "EPISODES_A_CELL", 2 * 4)


def test_a_run_writes_its_design_cells_tables_and_values(folder):
    names = {path.name for path in folder.iterdir()}
    assert names - {".lock"} == {
        "experiment.toml",
        "conditions.json",
        "cells",
        "episodes.parquet",
        "states.parquet",
        "values.npz",
    }
    assert len(cells_of(folder)) == 3 * 2
    assert load_values(folder / "values.npz").digest() == solve(cliff_walking()).digest()


def test_the_design_as_run_can_be_run_again_and_says_where_it_ran(folder):
    assert load_experiment(folder / "experiment.toml") == make_experiment(settings())
    written = tomllib.loads((folder / "experiment.toml").read_text(encoding="utf-8"))
    assert written["learners"][0]["epsilon"] == {"start": 1.0, "end": 0.02, "fraction": 0.9}
    libraries = ("numpy", "numba", "scipy", "polars")
    assert written["run"] == {
        "format": 3,
        **{name: version(name) for name in libraries},
        "version": qbumpers.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }


def test_there_is_a_row_an_episode_in_the_order_of_the_experiment(folder):
    table = pl.read_parquet(folder / "episodes.parquet")
    assert table.columns == EPISODE_COLUMNS
    keys = table.select("condition", "trial", "episode").rows()
    assert keys == [(name, t, e) for name in NAMES for t in range(5) for e in range(4)]
    labels = table.select("assistant", "alpha", "learner", "retention")
    assert labels.unique(maintain_order=True).rows() == [
        ("none", None, "q-learning", False),
        ("stochastic-q-bumpers", 0.3, "q-learning", False),
        ("stochastic-q-bumpers", 0.7, "q-learning", False),
    ]


def test_the_rows_are_those_of_the_simulation(folder):
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.3, second=True)
    outcomes = simulate(cliff_walking(), assistant, episodes=4, trials=5, seed=3).outcomes
    rows = rows_of(folder)
    for trial, episode in np.ndindex(5, 4):
        expected = [
            getattr(outcomes, column)[trial, episode].item() for column in EPISODE_COLUMNS[7:12]
        ]
        assisted = int(outcomes.assisted_events[trial, episode])
        unassisted = int(outcomes.unassisted_events[trial, episode])
        # Bits of an episode's events: 2 a success, 4 a crash.
        expected += [bool(assisted & 2), bool(unassisted & 2), bool(assisted & 4)]
        expected += [bool(unassisted & 4)]
        assert rows[NAMES[1], trial, episode][7:] == tuple(expected)


def test_success_and_crash_are_what_returns_say_they_are(tmp_path):
    # Enough episodes for some walkers to arrive unassisted and for some not to.
    table = pl.read_parquet(run_into(tmp_path, episodes=50, trials=40) / "episodes.parquet")
    for who in ("assisted", "unassisted"):
        columns = (f"{who}_return", f"{who}_length", f"{who}_success", f"{who}_crash")
        for total, length, success, crash in table.select(columns).iter_rows():
            # -1 a step, -100 a fall in place of -1, 100 more at the goal.
            falls, rest = divmod(100 * success - length - total, 99)
            assert (falls > 0, rest) == (crash, 0)
        assert set(table[f"{who}_success"]) == {False, True}
        assert set(table[f"{who}_crash"]) == {False, True}


def test_success_and_crash_are_unknown_where_the_task_knows_none(tmp_path):
    # Gymnasium's own Cliff Walking pays nothing at the goal, so that its end tells nothing.
    task = {"name": "CliffWalking-v1", "discount": 0.9, "episode_limit": 20}
    run_into(tmp_path, task=task, assistants=[{"name": "none"}])
    table = pl.read_parquet(tmp_path / "episodes.parquet")
    assert [c for c in table.columns if table[c].null_count()] == ["alpha", *EPISODE_COLUMNS[12:]]
    assert all(table[column].dtype == pl.Boolean for column in EPISODE_COLUMNS[12:])


def test_steps_by_state_add_up_to_lengths_and_overrides(folder):
    states = pl.read_parquet(folder / "states.parquet")
    assert states.columns == [
        "condition", "state", "row", "column", "assisted", "overridden", "unassisted",
    ]  # fmt: skip
    assert states.select("condition", "state").rows() == [(n, s) for n in NAMES for s in range(48)]
    assert (states["row"] * 12 + states["column"] == states["state"]).all()
    episodes = pl.read_parquet(folder / "episodes.parquet")
    for name in NAMES:
        counted = states.filter(condition=name).select("assisted", "overridden", "unassisted").sum()
        lengths = episodes.filter(condition=name).select(
            "assisted_length", "overrides", "unassisted_length"
        )
        assert counted.rows() == lengths.sum().rows()


def test_states_of_a_task_without_a_grid_have_no_place(tmp_path):
    task = {"name": "Taxi-v4", "discount": 0.9, "episode_limit": 20}
    run_into(tmp_path, task=task, assistants=[{"name": "none"}], trials=1)
    states = pl.read_parquet(tmp_path / "states.parquet")
    assert states["row"].null_count() == states["column"].null_count() == states.height == 500


def test_states_are_summed_over_the_cells_of_a_condition(folder, tmp_path, small_blocks):
    run_into(tmp_path)
    assert len(cells_of(tmp_path)) == 3 * 3 * 2
    assert pl.read_parquet(tmp_path / "states.parquet").equals(
        pl.read_parquet(folder / "states.parquet")
    )


def test_the_size_of_cells_changes_no_row(folder, tmp_path, small_blocks):
    assert rows_of(run_into(tmp_path)) == rows_of(folder)


@pytest.mark.parametrize("workers", [2, 7])
def test_workers_change_no_byte(folder, tmp_path, workers):
    run_into(tmp_path, workers=workers)
    tables = contents_of(folder, "*.parquet", "cells/**/*.parquet")
    assert len(tables) == 2 + 6
    assert contents_of(tmp_path, "*.parquet", "cells/**/*.parquet") == tables


def test_workers_finish_cells_in_any_order_without_a_change(tmp_path, small_blocks):
    for workers in (1, 2):
        run_into(tmp_path / str(workers), workers=workers, trials=9)
    names = ("episodes.parquet", "states.parquet")
    assert contents_of(tmp_path / "1", *names) == contents_of(tmp_path / "2", *names)


ELSEWHERE = {
    "added": [{"name": "none"}, THRESHOLDS, {**BUMPERS, "alpha": [0.3, 0.5, 0.7]}],
    "removed": [{**BUMPERS, "alpha": [0.3, 0.7]}],
    "reordered": [{**BUMPERS, "alpha": [0.7, 0.3]}, {"name": "none"}],
}


@pytest.mark.parametrize("same_folder", [True, False], ids=["continued", "afresh"])
@pytest.mark.parametrize("assistants", ELSEWHERE.values(), ids=list(ELSEWHERE))
def test_conditions_can_come_and_go_without_changing_the_others(
    folder, tmp_path, assistants, same_folder
):
    before = rows_of(folder)
    if same_folder:
        run_into(tmp_path)
    run_into(tmp_path, assistants=assistants)
    after = rows_of(tmp_path)
    shared = before.keys() & after.keys()
    assert {key[0] for key in shared} >= set(NAMES[1:])
    assert {key: before[key] for key in shared} == {key: after[key] for key in shared}
    names = ids_of(assistants=assistants)
    assert [key[0] for key in after] == [name for name in names for _ in range(5 * 4)]


@pytest.mark.parametrize("same_folder", [True, False], ids=["continued", "afresh"])
def test_more_trials_keep_the_rows_of_the_earlier_ones(folder, tmp_path, same_folder):
    if same_folder:
        run_into(tmp_path)
    run_into(tmp_path, trials=8)
    after = rows_of(tmp_path)
    assert len(after) == 3 * 8 * 4
    assert {key: row for key, row in after.items() if key[1] < 5} == rows_of(folder)


def test_the_seed_changes_every_trial(folder, tmp_path):
    before, after = rows_of(folder), rows_of(run_into(tmp_path, seed=4))
    assert before.keys() == after.keys()
    for name in NAMES:
        for trial in range(5):
            keys = [(name, trial, episode) for episode in range(4)]
            assert [before[key] for key in keys] != [after[key] for key in keys]


def test_progress_counts_trials_from_nothing_to_all(tmp_path, small_blocks):
    reports = []
    run_into(tmp_path, report=reports.append)
    # Three conditions of 2, 2 and 1 trials.
    assert sorted(np.diff([r.trials for r in reports]).tolist()) == [1] * 3 + [2] * 6
    assert (reports[0].trials, reports[-1].trials) == (0, 15)
    assert {r.of for r in reports} == {15}
    table = pl.read_parquet(tmp_path / "episodes.parquet")
    steps = table.select(pl.sum("assisted_length", "unassisted_length")).sum_horizontal().item()
    assert reports[-1].steps == steps


def test_episodes_alone_follow_those_with_the_assistant(tmp_path):
    table = pl.read_parquet(run_into(tmp_path, retention=3) / "episodes.parquet")
    episodes = table.group_by("condition", "trial", maintain_order=True).agg("episode", "retention")
    assert episodes["episode"].to_list() == [list(range(7))] * 3 * 5
    assert episodes["retention"].to_list() == [[False] * 4 + [True] * 3] * 3 * 5
    assert table.filter("retention")["overrides"].to_list() == [0] * 3 * 5 * 3
    assisted = table.filter(~pl.col("retention"))
    states = pl.read_parquet(tmp_path / "states.parquet")
    for who in ("assisted", "unassisted"):
        steps = assisted.group_by("condition", maintain_order=True).agg(pl.sum(f"{who}_length"))
        counted = states.group_by("condition", maintain_order=True).agg(pl.sum(who))
        assert counted.rows() == steps.rows()
    without = pl.read_parquet(run_into(tmp_path / "without") / "episodes.parquet")
    assert assisted.equals(without)


def test_trials_that_share_numbers_are_those_of_the_simulation(tmp_path):
    run_into(tmp_path, common_random_numbers=True, trials=3)
    rows = pl.read_parquet(tmp_path / "episodes.parquet")
    for name, assistant in [
        ("none", make_assistant("none")),
        (NAMES[2], make_assistant("stochastic-q-bumpers", alpha=0.7, second=True)),
    ]:
        outcomes = simulate(
            cliff_walking(), assistant, episodes=4, trials=3, seed=3, common_random_numbers=True
        ).outcomes
        found = rows.filter(pl.col("condition") == name)
        assert found["assisted_return"].to_list() == outcomes.assisted_return.ravel().tolist()
        assert found["unassisted_return"].to_list() == outcomes.unassisted_return.ravel().tolist()


@pytest.mark.parametrize("workers", [0, -2])
def test_fewer_than_one_worker_is_refused(tmp_path, workers):
    with pytest.raises(RequestError, match=rf"workers = {workers}; at least 1"):
        run_into(tmp_path / "none", workers=workers)
    assert not (tmp_path / "none").exists()


def test_all_cores_are_used_unless_fewer_are_asked_for():
    assert ThisMachine().cores == usable_cores()
    assert ThisMachine(3).cores == 3


@pytest.mark.parametrize("values", ["exact", "q-learning", "file"])
def test_the_assistants_values_come_from_where_the_experiment_says(tmp_path, values):
    if values == "file":
        values = str(tmp_path / "own.npz")
        solve(cliff_walking(), discount=0.5).save(values)
    run_into(tmp_path / "out", values=values, assistants=[{"name": "none"}], trials=1)
    kept = load_values(tmp_path / "out" / "values.npz")
    assert kept.discount == (0.5 if values.endswith(".npz") else 1.0)
    assert ("Q-learning" in kept.method) == (values == "q-learning")


def test_other_tasks_and_learners_reach_the_simulation(tmp_path):
    lake = run_into(tmp_path / "lake", **LAKE, learners=[{"perception": "observant"}])
    table = pl.read_parquet(lake / "episodes.parquet")
    assert set(table["assisted_return"].unique()) <= {0.0, 1.0}
    other = run_into(tmp_path / "other", **LAKE, learners=[{"perception": "interruption"}])
    untouched = pl.col("condition") == "none"
    ours, theirs = table, pl.read_parquet(other / "episodes.parquet")
    assert not ours.filter(~untouched).equals(theirs.filter(~untouched))
