"""`qbumpers reproduce` and `run` if learners learn networks."""

import subprocess
import sys

import polars as pl
import pytest

from qbumpers.errors import RequestError
from qbumpers.reproduction.experiments import profiles
from tests.experiments.examples import cart, write_toml
from tests.processes import ENVIRONMENT
from tests.texts import words
from tests.values.networks import constant, network_of

WITHOUT_BOX2D = """
import sys
sys.modules["Box2D"] = None
from qbumpers.cli import main
main()
"""


def test_help_tells_every_profile_and_the_smaller_versions(call):
    status, output, _ = call("reproduce", "--help")
    assert status == 0
    text = words(output)
    for name in ("cliff-walking", "lunar-lander"):
        for profile in profiles(name):
            assert f"'{profile}'" in text
    for part in (
        "--quick", "--episodes N", "--alphas A,A,...", "--values PATH",
        "qbumpers reproduce lunar-lander --quick", "begin with --quick",
    ):  # fmt: skip
        assert part in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--profile", "text"], "unknown profile 'text'"),
        (["--alphas", "0.5;1"], "alphas = '0.5;1'; numbers from 0 to 1 with commas between them"),
        (["--alphas", "0.5,2"], "alpha = 2.0: input should be less than or equal to 1"),
        (["--episodes", "0"], "episodes = 0: "),
        (["--values", "absent.npz"], "values file absent.npz: there is none"),
    ],
)
def test_a_wrong_version_is_refused_in_one_line(call, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    status, output, errors = call("reproduce", "lunar-lander", *arguments)
    assert (status, output) == (2, "")
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_the_paper_s_other_experiment_has_no_quick_version(call):
    status, _, errors = call("reproduce", "cliff-walking", "--quick")
    assert status == 2
    assert "quick: cliff-walking has no quick version; --trials makes it shorter" in errors


def test_weights_of_another_shape_are_refused(call, tmp_path):
    path = tmp_path / "narrow.npz"
    network_of(inputs=7, actions=4, task="lunar-lander", discount=0.99).save(path)
    status, _, errors = call("reproduce", "lunar-lander", "--values", path)
    assert status == 2
    assert "a network of 7 inputs and 4 actions; task lunar-lander needs a network of 8" in errors


def test_without_box2d_the_extra_to_install_is_named(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_BOX2D, "reproduce", "lunar-lander"],
        capture_output=True, text=True, env=ENVIRONMENT, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert "pip install 'qbumpers[lunar]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [("run",), ("tune", "--floor", "5")])
def test_values_worse_than_random_are_warned_of_before_any_work(
    call, tmp_path, monkeypatch, command
):
    def refuse(*_, **__):
        raise RequestError("enough")

    monkeypatch.setattr("qbumpers.experiments.run.run_experiment", refuse)
    monkeypatch.setattr("qbumpers.tuning.tune", refuse)
    constant(0, 4, 2, task="CartPole-v1").save(tmp_path / "fall.npz")
    path = write_toml(
        tmp_path / "cart.toml", **cart(tmp_path) | {"values": str(tmp_path / "fall.npz")}
    )
    name, *options = command
    status, _, errors = call(name, path, *options)
    assert status == 2
    warning, refused = errors.splitlines()
    assert warning.startswith("warning: values of task CartPole-v1: their greedy policy returns")
    assert warning.endswith("results say nothing about the method")
    assert refused == "error: enough"


@pytest.mark.slow
def test_a_run_with_deep_learners_ends_with_a_report(call, tmp_path):
    path = write_toml(tmp_path / "cart.toml", **cart(tmp_path))
    status, output, errors = call("run", path, "--workers", 1, "--out", tmp_path / "out")
    assert status == 0
    [warning] = errors.splitlines()  # the expert is a random network
    assert "warning: values of task CartPole-v1" in warning
    assert "2 conditions, 2 trials of 5 episodes" in words(output)
    assert pl.read_csv(tmp_path / "out" / "summary.csv").height == 2
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.slow
def test_a_small_version_of_figure_4_ends_with_a_report(call, tmp_path):
    given = ["--quick", "--trials", 1, "--episodes", 2]
    status, output, errors = call("reproduce", "lunar-lander", *given, "--out", tmp_path / "out")
    assert (status, errors) == (0, "")
    assert "lunar-lander-quick-episodes-2: 4 conditions, 1 trial of 2 episodes" in words(output)
    assert (tmp_path / "out" / "report.html").is_file()
