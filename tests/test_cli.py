"""The command line, called in this process: its texts, its errors, its exit status."""

import sys

import pytest

import qbumpers
from qbumpers import cli
from qbumpers.assistants import assistants
from tests.experiments.examples import PLAIN, contents_of, run_into, write_toml
from tests.texts import words


def test_the_version_is_printed(call):
    assert call("--version") == (0, f"qbumpers {qbumpers.__version__}", "")


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_names_every_command_and_what_it_does(call, flag):
    status, output, _ = call(flag)
    assert status == 0
    for text in (
        "Assistance that lets people learn",
        "reproduce Repeat an experiment of the paper",
        "run Run an experiment of your own",
        "play Play a task in the browser, with an assistant",
        "study Studies with participants",
        "tune Find the assistant that teaches best",
        "report Write tables, figures and report.html",
        "list List what experiments can name",
        "--traceback",
    ):
        assert text in words(output)


@pytest.mark.parametrize(
    ("command", "texts"),
    [
        (
            "reproduce",
            ["--profile figures|text", "--trials N", "--seed N", "--workers N", "--out DIR",
             "default: figures", "default: (results/NAME)", "default: (all cores)",
             "Example: qbumpers reproduce cliff-walking"],
        ),
        (
            "run",
            ["EXPERIMENT.toml", "--workers N", "--on gpu|ADDRESS", "--out DIR", "--yes",
             "Example: qbumpers run"],
        ),
        (
            "tune",
            ["EXPERIMENT.toml", "--floor RETURN", "--confidence SHARE", "--on gpu|ADDRESS",
             "default: 0.95", "Example: qbumpers tune"],
        ),
        (
            "play",
            ["TASK", "--assistant NAME", "--alpha SHARE", "--port N", "default: 8765",
             "--no-browser", "--out DIR", "default: results/play",
             "Example: qbumpers play lunar-lander"],
        ),
        ("report", ["DIR", "Results of a finished run"]),
        ("list", ["assistants|tasks|learners", "What to list"]),
    ],
)  # fmt: skip
def test_help_of_a_command_tells_its_options_with_defaults(call, command, texts):
    status, output, _ = call(command, "--help")
    assert status == 0
    for text in texts:
        assert text in words(output)


def test_without_a_command_there_is_help_and_the_status_of_a_wrong_request(call):
    status, output, errors = call()
    assert status == 2
    assert "Usage: qbumpers" in output + errors


def test_assistants_are_listed_unless_something_else_is_asked_for(call):
    status, output, _ = call("list", "assistants")
    assert status == 0
    assert {line.split()[0] for line in output.splitlines()} >= assistants().keys()
    assert "alpha, second = false" in output
    assert call("list") == (0, output, "")


def test_tasks_are_listed_by_the_names_that_experiments_use(call):
    status, output, _ = call("list", "tasks")
    assert status == 0
    for name in ("cliff-walking", "random-mdp", "FrozenLake-v1", "Taxi-v4"):
        assert any(line.startswith(f"{name} ") for line in output.splitlines())
    assert "Drive a weak car up a hill" in output


WRONG_COMMANDS = {
    "list of nothing known": (
        ["list", "learnres"],
        "unknown list 'learnres' (did you mean 'learners'?)",
    ),
    "reproduction": (
        ["reproduce", "clif-walking"],
        "unknown reproduction 'clif-walking' (did you mean 'cliff-walking'?). Known: cliff-walking",
    ),
    "profile": (
        ["reproduce", "cliff-walking", "--profile", "figure"],
        "unknown profile 'figure' (did you mean 'figures'?). Known: figures, text",
    ),
    "trials below 1": (["reproduce", "cliff-walking", "--trials", "0"], "trials = 0: "),
    "negative seed": (["reproduce", "cliff-walking", "--seed", "-1"], "seed = -1: "),
    "missing file": (["run", "absent.toml"], "experiment file absent.toml: No such file"),
    "folder as a file": (["run", "."], "experiment file .: Is a directory"),
    "report of nothing": (["report", "absent"], "results folder absent: it holds no experiment"),
}


@pytest.mark.parametrize(
    ("arguments", "message"), WRONG_COMMANDS.values(), ids=list(WRONG_COMMANDS)
)
def test_a_wrong_command_is_refused_in_one_line(call, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    status, output, errors = call(*arguments)
    assert (status, output) == (2, "")
    assert errors.startswith(f"error: {message}") or f": {message}" in errors
    assert len(errors.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


WRONG_FILES = {
    "assistant": (
        {"assistants": [{"name": "stochastic-q-bumper"}]},
        "unknown assistant 'stochastic-q-bumper' (did you mean 'stochastic-q-bumpers'?)",
    ),
    "alpha": (
        {"assistants": [{"name": "stochastic-q-bumpers", "alpha": [0.2, 1.2]}]},
        "assistant stochastic-q-bumpers: alpha = 1.2: input should be less than or equal to 1",
    ),
    "task": (
        {"task": "cliff-waking"},
        "unknown task 'cliff-waking' (did you mean 'cliff-walking'?)",
    ),
    "trials": ({"trials": 0}, "trials = 0: input should be greater than or equal to 1"),
    "episodes": ({"episodes": 0}, "episodes = 0: input should be greater than or equal to 1"),
    "seed": ({"seed": -3}, "seed = -3: input should be greater than or equal to 0"),
    "field": ({"trails": 3}, "trails = 3: unknown field (did you mean 'trials'?)"),
    "values": ({"values": "absent.npz"}, "values file absent.npz: there is none"),
}


@pytest.mark.parametrize(("changes", "message"), WRONG_FILES.values(), ids=list(WRONG_FILES))
def test_a_wrong_file_is_refused_in_one_line(call, tmp_path, changes, message):
    path = write_toml(tmp_path / "wrong.toml", **changes)
    status, output, errors = call("run", path, "--out", tmp_path / "out")
    assert (status, output) == (2, "")
    assert errors.startswith("error: ")
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        (["reproduce"], ["Missing argument 'EXPERIMENT'"]),
        (["run"], ["Missing argument 'EXPERIMENT.toml'"]),
        (["report"], ["Missing argument 'DIR'"]),
        (["rerun"], ["No such command 'rerun'"]),
        (["report", "x", "--profile", "text"], ["No such option", "--profile"]),
        (["reproduce", "cliff-walking", "--trials", "1.5"], ["--trials", "valid integer"]),
        (["reproduce", "cliff-walking", "--seed", "one"], ["--seed", "valid integer"]),
        (["reproduce", "cliff-walking", "--workers", "0"], ["--workers", "1"]),
        (["run", "absent.toml", "--workers", "-2"], ["--workers", "1"]),
    ],
)
def test_wrong_usage_is_refused_with_the_status_of_a_wrong_request(
    call, tmp_path, monkeypatch, arguments, texts
):
    monkeypatch.chdir(tmp_path)
    status, output, errors = call(*arguments)
    assert (status, output) == (2, "")
    for text in texts:
        assert text in words(errors)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_another_experiment_is_refused(call, tmp_path):
    folder = run_into(tmp_path / "out", **PLAIN)
    before = contents_of(folder, "*.*")
    path = write_toml(tmp_path / "other.toml", **PLAIN, seed=9)
    status, _, errors = call("run", path, "--out", folder)
    assert status == 2
    assert f"output folder {folder} holds another experiment (seed was 3, now 9)" in errors
    assert contents_of(folder, "*.*") == before


def test_a_folder_that_cannot_be_written_ends_with_the_status_of_a_failure(call, tmp_path):
    (tmp_path / "file").write_text("")
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    status, _, errors = call("run", path, "--out", tmp_path / "file" / "out")
    assert status == 1
    assert errors == (
        f"failed: cannot write {tmp_path}/file/out/.lock: Not a directory; what is finished is kept"
    )


def test_results_go_into_a_folder_of_the_experiments_name_unless_told_otherwise(
    call, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    path = write_toml(tmp_path / "any.toml", **PLAIN)
    status, output, _ = call("run", path, "--workers", 1)
    assert status == 0
    assert "3 conditions, 5 trials of 4 episodes, into results/plain" in words(output)
    assert (tmp_path / "results" / "plain" / "report.html").is_file()


def test_the_name_of_a_folder_is_printed_as_it_is(call, tmp_path):
    path = write_toml(tmp_path / "plain.toml", **PLAIN)
    status, output, _ = call("run", path, "--out", tmp_path / "try[final]")
    assert status == 0
    assert output.replace("\n", "").count("try[final]") == 2


def break_unexpectedly(monkeypatch):
    def odd(*_, **__):
        raise ZeroDivisionError("nobody thought of this")

    monkeypatch.setattr("qbumpers.experiments.sources.load_experiment", odd)


def test_an_unexpected_error_is_one_line_that_says_how_to_see_more(call, monkeypatch):
    break_unexpectedly(monkeypatch)
    status, _, errors = call("run", "any.toml")
    assert status == 1
    assert errors == (
        "failed: ZeroDivisionError: nobody thought of this "
        "(unexpected; 'qbumpers --traceback ...' shows where)"
    )


def test_a_traceback_is_shown_to_who_asks_for_it(monkeypatch):
    break_unexpectedly(monkeypatch)
    monkeypatch.setattr(sys, "argv", ["qbumpers", "--traceback", "run", "any.toml"])
    with pytest.raises(ZeroDivisionError, match="nobody thought of this"):
        cli.main()
