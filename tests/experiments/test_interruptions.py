"""Real runs that are killed, stopped or run out of space go on and end in the same bytes."""

import os
import platform
import signal
import time
from collections import Counter
from pathlib import Path

import filelock
import numpy as np
import polars as pl
import pytest

from qbumpers.errors import RequestError
from tests.experiments.examples import PLAIN, cells_of, contents_of, run_into, write_toml
from tests.processes import call, finish, start

# Cells of a fraction of a second, of which few are finished before the first kill.
LONG = {**PLAIN, "episodes": 995, "retention": 5, "trials": 400}
CELLS = 3 * 8
FINAL = ("*.parquet", "*.csv", "*.npz", "experiment.toml", "cells/**/*")
STOPPED = "stopped: what is finished is kept; the same command goes on from there\n"


def wait_for(process, happened):
    while process.poll() is None and not happened():
        time.sleep(0.002)


def one_more_cell(folder):
    """Whether there are more cells than at the call."""
    before = len(cells_of(folder))
    return lambda: len(cells_of(folder)) > before


def table_begun(folder, name):
    """Whether a table is being written, or has been since the call."""
    folder = Path(folder)
    before = stamps([folder / name])
    return lambda: any(folder.glob(f".{name}.*.part")) or stamps([folder / name]) != before


def whole_cells(folder):
    """Files of cells that have all of theirs."""
    files = cells_of(folder)
    cells = Counter(str(path).rsplit("-", 2)[0] for path in files)
    return [path for path in files if cells[str(path).rsplit("-", 2)[0]] == 2]


def stamps(paths):
    """When each file was written, and which one it is; without those that there are not."""
    found = {}
    for path in paths:
        try:
            found[path] = (path.stat().st_mtime_ns, path.stat().st_ino)
        except FileNotFoundError:
            continue
    return found


MOMENTS = {
    "at the start": (lambda folder: lambda: True, 3.0),
    "in a cell": (one_more_cell, 0.15),
    "assembling states": (lambda folder: table_begun(folder, "states.parquet"), 0.02),
    "assembling episodes": (lambda folder: table_begun(folder, "episodes.parquet"), 0.02),
    "reporting": (lambda folder: table_begun(folder, "episodes.parquet"), 2.0),
}
"""What to wait for, and within how many seconds after it, at random, to kill."""


def killed(path, folder, moment, generator):
    """Start a run, kill it at a moment, and see that what was finished before is still there."""
    happened, seconds = MOMENTS[moment]
    before = stamps(whole_cells(folder))
    reached = happened(folder)
    process = start("run", path, "--workers", 1, "--out", folder)
    wait_for(process, reached)
    time.sleep(generator.uniform(0, seconds))
    process.kill()
    status = finish(process)[0]
    assert before.items() <= stamps(whole_cells(folder)).items()
    return status


def finished(path, folder):
    """Let a run end, and see that it keeps what was finished before."""
    before = stamps(whole_cells(folder))
    status, _, errors = call("run", path, "--out", folder)
    assert (status, errors) == (0, "")
    assert before.items() <= stamps(whole_cells(folder)).items()
    return contents_of(folder, *FINAL)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_toml(tmp_path_factory.mktemp("long") / "plain.toml", **LONG)


@pytest.fixture(scope="module")
def uninterrupted(path):
    contents = finished(path, path.with_name("uninterrupted"))
    names = {Path(name).name for name in contents}
    assert names >= {"episodes.parquet", "states.parquet", "summary.csv", "values.npz"}
    assert len(contents) > CELLS * 2 + len(FINAL)
    return contents


def test_a_run_killed_at_random_moments_ends_in_the_same_bytes(path, tmp_path, uninterrupted):
    generator, folder = np.random.default_rng(7), tmp_path / "killed"
    statuses, kept = [], []
    for moment in ("in a cell", "in a cell", "assembling episodes"):
        statuses.append(killed(path, folder, moment, generator))
        kept.append(len(cells_of(folder)))
    assert statuses == [-signal.SIGKILL] * 3
    assert 0 < kept[0] < kept[1] < kept[2] == CELLS * 2
    assert finished(path, folder) == uninterrupted


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_every_killed_run_ends_in_the_same_bytes(path, tmp_path, uninterrupted, seed):
    """Killed up to five times, at any moment; nothing that was finished is done again."""
    generator, folder = np.random.default_rng(seed), tmp_path / "killed"
    moments = generator.choice(list(MOMENTS), size=generator.integers(2, 6))
    statuses = [killed(path, folder, moment, generator) for moment in moments]
    assert -signal.SIGKILL in statuses
    assert finished(path, folder) == uninterrupted


def stopped(path, folder, happened):
    """A run that gets Ctrl-C: its status and errors, and how many seconds it took to end."""
    process = start("run", path, "--workers", 2, "--out", folder)
    wait_for(process, happened)
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    status, _, errors = finish(process)
    return status, errors, time.monotonic() - begun


@pytest.mark.parametrize("moment", ["calibrating", "in a cell", "reporting"])
def test_ctrl_c_stops_at_once_keeps_what_is_finished_and_says_how_to_go_on(
    path, tmp_path, uninterrupted, moment
):
    seconds, folder = [], tmp_path
    while len(seconds) < 3 and min(seconds, default=2) >= 2:  # others may keep the machine busy
        folder = tmp_path / str(len(seconds))
        happened = {
            "calibrating": (folder / "values.npz").exists,
            "in a cell": one_more_cell(folder),
            "reporting": table_begun(folder, "episodes.parquet"),
        }
        status, errors, taken = stopped(path, folder, happened[moment])
        assert (status, errors) == (1, STOPPED)
        seconds.append(taken)
    assert min(seconds) < 2
    kept = cells_of(folder)
    assert (len(kept) > 0) == (moment != "calibrating")
    for cell in kept:
        assert pl.read_parquet(cell).height > 0
    assert not list(folder.rglob(".*.part"))
    if moment == "in a cell":
        assert finished(path, folder) == uninterrupted


@pytest.mark.slow
def test_of_two_runs_at_once_one_ends_and_the_other_says_why_it_does_not(
    path, tmp_path, uninterrupted
):
    folder = tmp_path / "shared"
    first = start("run", path, "--workers", 1, "--out", folder)
    wait_for(first, (folder / "values.npz").exists)
    first.send_signal(signal.SIGSTOP)  # it cannot end before the second has looked
    status, _, errors = call("run", path, "--out", folder)
    first.send_signal(signal.SIGCONT)
    assert status == 2
    assert errors == (
        f"error: output folder {folder}: another run is writing to it; wait for it, or choose "
        "another folder\n"
    )
    assert finish(first)[0] == 0
    assert contents_of(folder, *FINAL) == uninterrupted


@pytest.mark.slow
def test_runs_that_start_together_do_not_spoil_each_other(path, tmp_path, uninterrupted):
    folder = tmp_path / "shared"
    processes = [start("run", path, "--workers", 1, "--out", folder) for _ in range(3)]
    ends = [finish(process) for process in processes]
    statuses = sorted(status for status, _, _ in ends)
    assert statuses[0] == 0
    assert set(statuses) <= {0, 2}
    for status, _, errors in ends:
        assert ("another run is writing to it" in errors) == (status == 2)
    assert contents_of(folder, *FINAL) == uninterrupted


def test_what_a_killed_write_left_behind_is_cleared_away(tmp_path):
    folder = run_into(tmp_path / "run")
    run_into(folder, trials=8)
    left = [
        cells_of(folder)[0].with_name(f".{cells_of(folder)[0].name}.4194305.part"),
        *(folder / f".{name}.4194305@{platform.node()}.part" for name in OWN_FILES),
    ]
    for path in left:  # by a process whose number no process can have
        path.write_bytes(b"half of it")
    run_into(folder)
    assert [path for path in left if path.exists()] == []


OWN_FILES = ("experiment.toml", "conditions.json", "episodes.parquet", "states.parquet")


def test_nothing_of_others_is_cleared_away(tmp_path):
    """Neither a user's own files, nor those of another run below, a live process or a machine."""
    folder = run_into(tmp_path / "run")
    nested = run_into(folder / "nested")
    cell, other = cells_of(folder)[0], cells_of(nested)[0]
    alive, here = os.getppid(), platform.node()
    kept = [
        folder / ".x.part",
        folder / ".notes.txt.4194305.part",
        folder / "mine" / ".episodes.parquet.4194305.part",
        folder / f".episodes.parquet.{alive}@{here}.part",
        folder / f".episodes.parquet.4194305@not-{here}.part",
        cell.with_name(".x.4194305.part"),
        cell.with_name(f".{cell.name}.{alive}.part"),
        nested / ".experiment.toml.4194305.part",
        other.with_name(f".{other.name}.4194305.part"),
    ]
    for path in kept:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"mine")
    run_into(folder)
    assert [path for path in kept if not path.exists()] == []


def test_a_full_disk_ends_a_run_with_one_message_and_the_next_goes_on(tmp_path):
    folder = run_into(tmp_path / "full", **PLAIN, episodes=100, trials=50)
    before = contents_of(folder, "*.parquet", "cells/**/*")
    largest = max(len(content) for content in before.values() if content)
    path = write_toml(tmp_path / "plain.toml", **PLAIN, episodes=100, trials=100)
    status, _, errors = call("run", path, "--out", folder, largest_file=largest // 4)
    assert status == 1
    assert errors.startswith(f"failed: cannot write {folder}/cells/")
    assert errors.rstrip().endswith("; what is finished is kept")
    assert len(errors.splitlines()) == 1
    after = contents_of(folder, "*.parquet", "cells/**/*", "cells/**/.*")
    assert before.items() <= after.items()
    assert not [name for name in after if name.endswith(".part")]

    # The message promised that the same command goes on; its numbers are those of one long run.
    run_into(folder, **PLAIN, episodes=100, trials=100)
    expected = run_into(tmp_path / "whole", **PLAIN, episodes=100, trials=100)
    assert contents_of(folder, "*.parquet") == contents_of(expected, "*.parquet")


def test_two_runs_do_not_write_to_one_folder(tmp_path):
    folder = run_into(tmp_path / "run")
    with (
        filelock.FileLock(folder / ".lock"),
        pytest.raises(RequestError, match=r"output folder .*run: another run is writing to it"),
    ):
        run_into(folder)
