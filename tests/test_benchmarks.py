"""The benchmarks: how they compare, and that each runs and prints its ratios."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.narrowing import present

FOLDER = Path(__file__).parent.parent / "benchmarks"
RATIO = re.compile(r"[\d.,]+ \([\d.,]+\.\.[\d.,]+\)")


@pytest.fixture(scope="module")
def measuring():
    path = FOLDER / "measuring.py"
    specification = present(importlib.util.spec_from_file_location("measuring", path))
    module = importlib.util.module_from_spec(specification)
    present(specification.loader).exec_module(module)
    return module


def test_everything_is_measured_once_before_anything_is_measured_again(measuring):
    calls = []

    def timed(name):
        def measure(number):
            calls.append((name, number))
            return float(len(calls))

        return measure

    measured = measuring.alternate({"ours": timed("ours"), "theirs": timed("theirs")}, 2)
    assert calls == [("ours", 0), ("theirs", 0), ("ours", 1), ("theirs", 1)]
    assert measured == {"ours": [1.0, 3.0], "theirs": [2.0, 4.0]}


def test_ratios_are_taken_within_a_round_and_not_between_medians(measuring):
    row = measuring.compared("it", [1.0, 20.0, 6.0], "s", "baseline", [2.0, 10.0, 3.0])
    assert row.ratios == [0.5, 2.0, 2.0]
    assert row.measured == 6.0
    assert row.baseline == "baseline: 3 s"


@pytest.mark.parametrize(
    ("measured", "limit", "at_least", "verdict"),
    [
        (14.0, 15, False, "< 15 us: met"),
        (16.0, 15, False, "< 15 us: missed"),
        (31.0, 30, True, ">= 30 us: met"),
        (29.0, 30, True, ">= 30 us: missed"),
    ],
)
def test_the_table_says_whether_a_target_is_met(
    measuring, capsys, measured, limit, at_least, verdict
):
    target = measuring.Target(limit, at_least)
    measuring.show("title", [measuring.Row("it", measured, "us", target=target)])
    assert verdict in capsys.readouterr().out


def test_the_table_shows_the_median_ratio_and_the_extremes(measuring, capsys):
    measuring.show("title", [measuring.compared("it", [4.0, 1.0, 9.0], "s", "one", [1.0] * 3)])
    assert "4 (1..9)" in capsys.readouterr().out


def run(script, *arguments):
    return subprocess.run(
        [sys.executable, str(FOLDER / script), *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


def test_all_benchmarks_are_run_by_one_script():
    answer = run("run.py", "--help")
    assert answer.returncode == 0, answer.stderr
    assert "--quick" in answer.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "names"),
    [
        ("simulation.py", ["one core", "none", "maximal", "model-based, none", "two workers"]),
        ("shared_control.py", ["none", "maximal", "local-q-thresholding", "stochastic-q-bumpers"]),
        ("lander.py", ["random actions", "landing", "reset"]),
        ("deep.py", ["training step", "faster than plain PyTorch", "SB3", "two processes"]),
        ("sweeps.py", ["of the engine", "efficiency", "threads"]),
        ("cluster.py", ["a small cell, Ray, alone", "in batches", "Ray on"]),
        ("whole_processes.py", ["import qbumpers", "Figure 2 grid, 26 conditions", "reproduce"]),
    ],
)
def test_a_benchmark_prints_the_ratio_of_everything_it_measures(script, names):
    answer = run(script, "--quick")
    assert answer.returncode == 0, answer.stderr
    assert all(name in answer.stdout for name in names), answer.stdout
    assert len(RATIO.findall(answer.stdout)) >= len(names)
