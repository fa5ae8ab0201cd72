"""Experiments with deep learners, end to end: cells, order, tables, and being stopped."""

import dataclasses
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import polars as pl
import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import estimated_seconds, make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from qbumpers.simulation import run
from qbumpers.tasks import VectorTask
from tests.experiments.examples import cart, cells_of, contents_of, write_toml
from tests.narrowing import of_kind
from tests.processes import ENVIRONMENT, PROGRAM, finish

# The experts of these experiments are random networks.
pytestmark = pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning")

STOPPED = "stopped: what is finished is kept; the same command goes on from there\n"


def planned(folder, **changes):
    return make_plan(make_experiment(cart(folder, **changes)))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished run on two processes, and what was reported while it went on."""
    folder = tmp_path_factory.mktemp("whole")
    plan, reports = planned(folder), []
    run_experiment(plan, folder / "out", backend=ThisMachine(2), report=reports.append)
    return plan, folder / "out", reports


def test_the_tables_hold_what_simulations_find(whole):
    plan, folder, _ = whole
    results = load(folder)
    assert results.states is None
    assert not (folder / "states.parquet").exists()
    assert results.values.digest() == plan.values.digest()
    for named, content in plan.named:
        outcomes = run(plan.conditions[content], trials=2, seed=3).outcomes
        rows = results.episodes.filter(pl.col("condition") == named.condition)
        assert rows["trial"].to_list() == np.repeat([0, 1], 5).tolist()
        for column in ("assisted_return", "unassisted_return", "assisted_length", "overrides"):
            assert rows[column].to_list() == getattr(outcomes, column).ravel().tolist()
        assert rows["learner"].unique().to_list() == ["double-dqn"]
    for column in ("assisted_success", "unassisted_success", "assisted_crash"):
        assert results.episodes[column].null_count() == results.episodes.height  # it tells none


def test_every_trial_is_a_cell_of_one_table(whole):
    _, folder, reports = whole
    names = [path.name for path in cells_of(folder)]
    assert len(names) == 4
    assert {name.rsplit("-", 2)[0] for name in names} == {
        "000000-1-episodes",
        "000001-1-episodes",
    }
    assert [report.trials for report in reports] == [0, 1, 2, 3, 4]


def test_more_trials_add_to_what_is_there(whole, tmp_path):
    _, folder, _ = whole
    plan, reports = planned(folder.parent, trials=3), []
    before = contents_of(folder, "cells/**/*")
    run_experiment(plan, tmp_path / "three", backend=ThisMachine(1))
    for name, content in before.items():
        (tmp_path / "grown" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "grown" / name).write_bytes(content)
    run_experiment(plan, tmp_path / "grown", backend=ThisMachine(1), report=reports.append)
    assert reports[0].trials == 4
    final = ("*.parquet", "cells/**/*")
    assert contents_of(tmp_path / "grown", *final) == contents_of(tmp_path / "three", *final)


def test_trials_are_worked_on_one_by_one_across_conditions(whole):
    plan, _, _ = whole
    contents = list(plan.conditions)
    cells = [Cell(content, trial, 1) for content in contents for trial in range(3)]
    seconds = estimated_seconds(plan, cells)
    assert list(seconds) == [Cell(content, t, 1) for t in range(3) for content in contents]
    assert all(0 < each < 60 for each in seconds.values())


def test_the_time_of_a_trial_is_told_from_a_few_short_episodes(whole):
    plan, _, _ = whole
    [content, *_] = plan.conditions
    condition = plan.conditions[content]._replace(episodes=2_000)
    begun = time.perf_counter()
    [seconds] = estimated_seconds(
        plan._replace(conditions={content: condition}), [Cell(content, 0, 1)]
    ).values()
    assert time.perf_counter() - begun < 10
    assert 2 < seconds < 2_000  # a million steps


def test_successes_and_crashes_are_kept_where_the_task_tells_them(tmp_path):
    settings = cart(tmp_path, task="lunar-lander", values="expert", episodes=2, trials=1)
    settings["assistants"] = [{"name": "maximal"}]
    run_experiment(make_plan(make_experiment(settings)), tmp_path / "out", backend=ThisMachine(1))
    episodes = load(tmp_path / "out").episodes
    assert episodes["assisted_success"].to_list() == [True, True]  # the expert's own landing
    assert episodes["assisted_crash"].to_list() == [False, False]


def begin(*arguments):
    """A run in a process group of its own, as a terminal starts it."""
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "0", *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT,
        start_new_session=True,
    )  # fmt: skip


def is_empty(group):
    """Whether a process group has ended, within a few seconds."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_stopped_run_keeps_what_is_finished_and_leaves_no_process(tmp_path, number):
    path = write_toml(tmp_path / "cart.toml", **cart(tmp_path, trials=6, episodes=100))
    process = begin("run", path, "--workers", 2, "--out", tmp_path / "out")
    while process.poll() is None and len(cells_of(tmp_path / "out")) < 2:
        time.sleep(0.02)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # a terminal tells every process of the group
    else:
        process.send_signal(number)
    status, _, errors = finish(process)
    assert is_empty(process.pid)
    if number == signal.SIGKILL:
        assert status == -number
    else:
        warning, stopped = errors.splitlines(keepends=True)
        assert "values of task CartPole-v1" in warning  # the expert is a random network
        assert (status, stopped) == (1, STOPPED)
    kept = contents_of(tmp_path / "out", "cells/**/*")
    assert 2 <= len(kept) < 12
    reports = []
    plan = planned(tmp_path, trials=6, episodes=100)
    run_experiment(plan, tmp_path / "out", backend=ThisMachine(2), report=reports.append)
    assert reports[0].trials == len(kept)
    assert kept.items() <= contents_of(tmp_path / "out", "cells/**/*").items()


class Sleeper:
    """An environment that takes a minute to begin."""

    def reset(self, chance):
        time.sleep(60)

    def step(self, action):
        raise AssertionError("no episode begins")


def as_an_experiment(plan, content):
    return list(ThisMachine(1)(plan, {Cell(content, 0, 1): 60.0}))


def as_a_simulation(plan, content):
    return run(plan.conditions[content], trials=2, workers=2)


@pytest.mark.parametrize("work", [as_an_experiment, as_a_simulation])
def test_a_signal_that_another_thread_receives_ends_work_at_once(tmp_path, work):
    plan = planned(tmp_path)
    task = dataclasses.replace(of_kind(VectorTask, plan.task), make_stepper=Sleeper)
    [(content, condition), *_] = plan.conditions.items()
    plan = plan._replace(task=task, conditions={content: condition._replace(task=task)})
    heard, in_time = threading.Event(), []

    def interrupt():
        while not multiprocessing.active_children():
            time.sleep(0.02)
        time.sleep(0.5)
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)
        in_time.append(heard.wait(30))

    other = threading.Thread(target=interrupt)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background
    other.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work(plan, content)
    finally:
        signal.signal(signal.SIGINT, before)
    heard.set()
    other.join()
    assert in_time == [True]
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_lost_worker_is_told_in_one_line(tmp_path, monkeypatch):
    plan = planned(tmp_path, trials=6, episodes=100)

    def kill(progress):
        if progress.trials == 1:
            for child in multiprocessing.active_children():
                child.kill()

    with pytest.raises(ChildProcessError, match=r"a worker process was lost"):
        run_experiment(plan, tmp_path / "out", backend=ThisMachine(2), report=kill)
    assert cells_of(tmp_path / "out")


def test_what_goes_wrong_in_a_process_is_told_as_here(tmp_path):
    bumpers = {"name": "stochastic-q-bumpers", "alpha": 0.5, "v_min": 1000.0}
    plan = planned(tmp_path, assistants=[{"name": "none"}, bumpers])
    with pytest.raises(RequestError, match=r"v_min = 1000 must be below the value of the start"):
        run_experiment(plan, tmp_path / "out", backend=ThisMachine(1))
