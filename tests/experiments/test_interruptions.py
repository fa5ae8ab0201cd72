"""Real runs that are killed or run out of space go on and end in the same bytes."""

import signal
import time

import filelock
import numpy as np
import pytest

from qbumpers.errors import RequestError
from tests.experiments.examples import PLAIN, cells_of, contents_of, run_into, write_toml
from tests.processes import call, finish, start

TABLES = ("episodes.parquet", "summary.csv")


def wait_for(process, happened):
    while process.poll() is None and not happened():
        time.sleep(0.01)


def test_a_run_killed_at_random_moments_ends_in_the_same_bytes(tmp_path):
    # 90 cells, some seconds of work.
    path = write_toml(tmp_path / "plain.toml", **PLAIN, episodes=100, trials=1500)
    folder = tmp_path / "killed"
    moments = np.random.default_rng(7).uniform(0, 0.5, size=3)
    statuses, finished = [], []
    for number, moment in enumerate(moments):
        process = start("run", path, "--workers", 1, "--out", folder)
        before = len(cells_of(folder))
        if number < 2:
            wait_for(process, lambda before=before: len(cells_of(folder)) > before)
        else:  # while it writes tables and figures
            wait_for(process, (folder / "episodes.parquet").exists)
        time.sleep(moment)
        process.kill()
        statuses.append(finish(process)[0])
        finished.append(len(cells_of(folder)))
    assert statuses == [-signal.SIGKILL] * 3
    assert 0 < finished[0] < finished[2] == 90 * 2
    assert call("run", path, "--out", folder)[0] == 0
    assert call("run", path, "--out", tmp_path / "whole")[0] == 0
    expected = contents_of(tmp_path / "whole", *TABLES)
    assert len(expected) == 2
    assert contents_of(folder, *TABLES) == expected


def test_what_a_killed_write_left_behind_is_cleared_away(tmp_path):
    folder = run_into(tmp_path / "run")
    left = cells_of(folder)[0].with_name(".000000-5-episodes.parquet.4194305.part")
    left.write_bytes(b"half of it")  # by a process whose number no process can have
    run_into(folder)
    assert not left.exists()


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
