"""Runs through an own Ray in a process of their own: silent, stopped at once, leaving nothing."""

import contextlib
import os
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

import pytest

from tests.experiments.examples import contents_of
from tests.experiments.with_ray import MARKS
from tests.narrowing import present

pytestmark = [*MARKS, pytest.mark.slow]

SCRIPT = """
import sys
from qbumpers.experiments.cluster import RayCluster
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.reproduction.experiments import reproduction

def report(progress):
    if progress.trials > 0 and trials > 1000:
        print("begun", flush=True)

trials = int(sys.argv[2])
plan = make_plan(reproduction("cliff-walking", trials=trials))
with RayCluster("local") as cluster:
    import ray
    assert [node["NodeManagerAddress"] for node in ray.nodes()] == ["127.0.0.1"]
    run_experiment(plan, sys.argv[1], backend=cluster, report=report)
"""


def start_script(folder, trials):
    """A run through an own Ray in a process of its own, with a mark that its children inherit."""
    mark = str(uuid.uuid4())
    environment = {**os.environ, "HOME": str(folder.parent), "MARK": mark}
    for name in ("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "RAY_USAGE_STATS_ENABLED"):
        del environment[name]  # what RayCluster must see to by itself
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(folder), str(trials)],
        env=environment, text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    return process, f"MARK={mark}".encode()


def processes_with(mark):
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark in path.read_bytes():
                found.append(path.parent.name)
    return found


def wait_until_gone(mark, seconds):
    end = time.monotonic() + seconds
    while processes_with(mark) and time.monotonic() < end:
        time.sleep(0.1)
    return not processes_with(mark)


def test_an_own_ray_prints_nothing_and_leaves_no_process_behind(tmp_path):
    process, mark = start_script(tmp_path / "ray", 20)
    time.sleep(2)
    assert processes_with(mark)
    assert process.communicate(timeout=200) == ("", "")
    assert process.returncode == 0
    assert wait_until_gone(mark, 5)


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_run_ends_at_once_with_all_its_processes_and_can_go_on(tmp_path, ending):
    folder = tmp_path / "ray"
    process, mark = start_script(folder, 5000)
    output, messages = present(process.stdout), present(process.stderr)
    assert output.readline() == "begun\n"
    begun = time.monotonic()
    os.killpg(process.pid, ending) if ending == signal.SIGINT else process.kill()
    process.wait(timeout=60)
    assert time.monotonic() - begun < 10
    # Helpers of a Ray whose driver was killed first try to tell it for a minute.
    assert wait_until_gone(mark, 15 if ending == signal.SIGINT else 150)
    errors = messages.read()
    if ending == signal.SIGINT:
        assert errors.rstrip().endswith("KeyboardInterrupt")
        assert "ray" not in errors.splitlines()[0].lower()
    finished = contents_of(folder, "cells/**/*.parquet")
    assert finished
    output.close()
    messages.close()
