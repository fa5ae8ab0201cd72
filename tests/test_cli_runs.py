"""What the command line says of runs and of tuning, called in this process."""

import re

import pytest

from tests.experiments.examples import PLAIN, cells_of, contents_of, write_toml
from tests.texts import words

HUGE = {**PLAIN, "trials": 10**9, "episodes": 1}


def test_more_cells_than_anybody_means_must_be_asked_for(call, tmp_path):
    path = write_toml(tmp_path / "huge.toml", **HUGE)
    status, output, errors = call("run", path, "--out", tmp_path / "out")
    assert (status, output) == (2, "")
    assert errors.endswith(
        "3 conditions, together 60,000 cells of work; more than 10,000 must be asked for with --yes"
    )
    assert not (tmp_path / "out").exists()
    # Asked for, it is refused for another reason only.
    status, _, errors = call("run", path, "--yes", "--on", "nowhere", "--out", tmp_path / "out")
    assert (status, "--yes" in errors) == (2, False)
    assert "on = 'nowhere'" in errors


@pytest.mark.parametrize("command", ["run", "tune"])
def test_threads_and_a_cluster_are_not_both_used(call, tmp_path, command):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    floor = ["--floor", 0] if command == "tune" else []
    arguments = [command, path, *floor, "--workers", 2, "--on", "local"]
    status, _, errors = call(*arguments, "--out", tmp_path / "out")
    assert status == 2
    assert errors.startswith("error: --workers 2 --on local: threads of this machine, or a cluster")
    assert not (tmp_path / "out").exists()


def test_a_finished_run_says_that_all_is_there(call, tmp_path):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    _, first, _ = call("run", path, "--out", tmp_path / "out")
    assert "15 trials: 15 to run, less than a second by a short calibration" in first
    _, second, _ = call("run", path, "--out", tmp_path / "out")
    assert "All trials are there already." in second
    more = write_toml(tmp_path / "more.toml", **PLAIN, trials=9)
    _, third, _ = call("run", more, "--out", tmp_path / "out")
    assert "27 trials: 15 are there already, 12 to run" in third


def test_a_damaged_cell_is_named_and_made_again(call, tmp_path):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    call("run", path, "--out", tmp_path / "out")
    before = contents_of(tmp_path / "out", "*.parquet")
    damaged = cells_of(tmp_path / "out")[0]
    damaged.write_bytes(damaged.read_bytes()[:-7])
    status, _, errors = call("run", path, "--out", tmp_path / "out")
    assert status == 0
    name = damaged.relative_to(tmp_path / "out")
    assert errors == f"damaged, to be made again: {name}"
    assert contents_of(tmp_path / "out", "*.parquet") == before


def test_learners_have_a_table_each(call, tmp_path):
    learners = [{"perception": ["transition", "observant"]}]
    path = write_toml(tmp_path / "plain.toml", **PLAIN, learners=learners)
    status, output, _ = call("run", path, "--out", tmp_path / "out")
    assert status == 0
    assert "6 conditions, 5 trials of 4 episodes" in output
    for perception in learners[0]["perception"]:
        assert f"Learners with perception={perception}" in output
    assert len(re.findall(r"^none ", output, re.MULTILINE)) == 2


def test_tuning_prints_its_choice_and_what_it_saved(call, tmp_path):
    path = write_toml(tmp_path / "plain.toml", trials=20, episodes=20)
    status, output, _ = call("tune", path, "--floor", 40, "--out", tmp_path / "out")
    assert status == 0
    assert "small: 3 conditions race, up to 20 trials of 20 episodes each" in output
    assert re.search(r"^none \d+ .* below the floor$", output, re.MULTILINE)
    assert re.search(r"^\d+ trials, \d+% of the full grid's 60\.$", output, re.MULTILINE)
    assert re.search(
        r"Choice: stochastic-q-bumpers/alpha=0\.[37] returns .* assisted, above 40 with 95% "
        r"confidence, and .* unassisted\.",
        words(output),
    )


def test_tuning_without_a_choice_names_the_nearest_and_fails(call, tmp_path):
    path = write_toml(tmp_path / "plain.toml", trials=20, episodes=20)
    status, output, _ = call("tune", path, "--floor", 1000, "--out", tmp_path / "out")
    assert status == 1
    assert (
        "No choice: no condition is significantly above 1000. The nearest is stochastic-q" in output
    )
