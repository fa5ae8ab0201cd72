"""The command line as a process: exit status, what is left behind, Ctrl-C."""

import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import polars as pl
import pytest

import qbumpers
from tests.experiments.examples import PLAIN, cells_of, contents_of, write_toml
from tests.processes import ENVIRONMENT, call, finish, start


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["figures", "text"])
def test_the_paper_is_reproduced_with_a_report(tmp_path, profile):
    arguments = ["reproduce", "cliff-walking", "--profile", profile, "--trials", 2]
    status, output, errors = call(*arguments, "--workers", 2, "--out", tmp_path / "out")
    assert (status, errors) == (0, "")
    assert "26 conditions, 2 trials of 100 episodes" in output
    summary = pl.read_csv(tmp_path / "out" / "summary.csv")
    assert (summary.height, summary["trials"].unique().to_list()) == (26, [2])
    for row in summary.iter_rows(named=True):
        [line] = re.findall(rf"^{re.escape(row['condition'])} .*", output, re.MULTILINE)
        assert f" {row['assisted_mean']:.1f} " in line
        assert f" {row['unassisted_mean']:.1f} " in line
    for row in pl.read_csv(tmp_path / "out" / "published.csv").iter_rows(named=True):
        printed = str(row["printed"]).replace("\N{MINUS SIGN}", "-")
        assert re.search(rf"^{re.escape(row['what'])} +{re.escape(printed)} ", output, re.MULTILINE)
    assert f"Report: {tmp_path}/out/report.html" in output
    settings = (tmp_path / "out" / "experiment.toml").read_text()
    assert ("escalate = true" in settings, "escalate = false" in settings) == (
        profile == "figures",
        profile == "text",
    )


def test_a_run_and_its_report_can_be_repeated(tmp_path):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    folder = tmp_path / "out"
    status, output, errors = call("run", path, "--out", folder)
    assert (status, errors) == (0, "")
    assert {"experiment.toml", "cells", "episodes.parquet", "summary.csv", "figures",
            "report.html"} <= {p.name for p in folder.iterdir()}  # fmt: skip
    before = contents_of(folder, "*.*", "figures/*")
    shutil.rmtree(folder / "figures")
    for name in ("summary.csv", "report.html"):
        (folder / name).unlink()
    status, again, errors = call("report", folder)
    assert (status, errors) == (0, "")
    assert again.strip()
    assert output.endswith(again)
    assert contents_of(folder, "*.*", "figures/*") == before


def test_a_wrong_request_exits_with_2_and_one_line(tmp_path):
    path = write_toml(tmp_path / "wrong.toml", assistants=[{"name": "bumpers"}])
    status, output, errors = call("run", path)
    assert (status, output) == (2, "")
    assert errors.startswith("error: ")
    assert "unknown assistant 'bumpers' (did you mean 'hard-bumpers'?)" in errors
    assert len(errors.splitlines()) == 1


def test_a_failure_exits_with_1_and_one_line(tmp_path):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    status, _, errors = call("run", path, "--out", path / "out")
    assert status == 1
    assert errors == (
        f"failed: cannot write {path}/out/.lock: Not a directory; what is finished is kept\n"
    )


def test_the_installed_command_is_the_module():
    script = [Path(sys.executable).with_name("qbumpers")]
    for command in (script, [sys.executable, "-m", "qbumpers"]):
        output = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, check=True
        ).stdout
        assert output == f"qbumpers {qbumpers.__version__}\n"


def test_assistants_are_listed_with_their_options_and_defaults():
    status, output, _ = call("list", "assistants")
    assert status == 0
    options = {
        line.split()[0]: line.split("  ", 1)[1].strip().split("  ")[0]
        for line in output.splitlines()
        if "  " in line
    }
    assert options["stochastic-q-bumpers"] == (
        "alpha, v_min = 0.0, p_max = 0.999, second = false, escalate = true, clip = true"
    )
    assert options["local-q-thresholding"] == "alpha, second = false"


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A long run that gets Ctrl-C as soon as its first cell is finished."""
    folder = tmp_path_factory.mktemp("interrupted")
    path = write_toml(folder / "plain.toml", **PLAIN, trials=10_000, episodes=100)
    process = start("run", path, "--workers", 1, "--out", folder / "out")
    while process.poll() is None and not cells_of(folder / "out"):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    status, _, errors = finish(process)
    return SimpleNamespace(status=status, errors=errors, folder=folder / "out")


def test_ctrl_c_exits_with_1_and_says_that_the_same_command_goes_on(interrupted):
    assert interrupted.errors == (
        "stopped: what is finished is kept; the same command goes on from there\n"
    )
    assert interrupted.status == 1


def test_ctrl_c_keeps_finished_cells_whole(interrupted):
    assert interrupted.status != 0
    assert "Traceback" not in interrupted.errors
    kept = cells_of(interrupted.folder)
    assert 0 < len(kept) < 3 * 200 * 2
    for cell in kept:
        assert pl.read_parquet(cell).height > 0
    assert not (interrupted.folder / "episodes.parquet").exists()


def test_an_unexpected_error_has_a_traceback_only_on_request():
    odd = (
        "import sys, qbumpers.cli as cli, qbumpers.experiments.sources as sources\n"
        "sources.load_experiment = lambda *_, **__: 1 / 0\n"
        "cli.main()"
    )
    found = [
        subprocess.run(
            [sys.executable, "-c", odd, *arguments, "run", "any.toml"],
            capture_output=True,
            text=True,
            env=ENVIRONMENT,
            check=False,
        )
        for arguments in ([], ["--traceback"])
    ]
    assert [process.returncode for process in found] == [1, 1]
    assert [len(process.stderr.splitlines()) == 1 for process in found] == [True, False]
    assert found[0].stderr.startswith("failed: ZeroDivisionError: division by zero (unexpected;")
    assert "Traceback" in found[1].stderr
    assert found[1].stderr.endswith("ZeroDivisionError: division by zero\n")
