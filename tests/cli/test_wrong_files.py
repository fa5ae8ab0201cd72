"""Files for folders, folders for files, and files of another kind, given to every command."""

import warnings

import pytest

from qbumpers.errors import RequestError
from tests.experiments.examples import write_toml
from tests.values.networks import network_of


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with things of every kind, where the commands run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    network_of(inputs=4, actions=2, task="CartPole-v1").save("network.npz")
    write_toml(tmp_path / "small.toml")
    write_toml(tmp_path / "other.toml", values="network.npz")
    return tmp_path


WRONG = {
    "run folder": "error: experiment file folder: Is a directory",
    "run empty": "error: experiment file empty: name: field required",
    "run binary": "error: experiment file binary: not valid TOML: byte 129 is not UTF-8",
    "run network.npz": "error: experiment file network.npz: not valid TOML",
    "run other.toml": "error: values = 'network.npz': they are of task CartPole-v1, not cliff-",
    "tune folder --floor 3": "error: experiment file folder: Is a directory",
    "tune binary --floor 3": "error: experiment file binary: not valid TOML",
    "report small.toml": "error: folder small.toml: it is a file",
    "report folder": "error: results folder folder: it holds no experiment.toml",
    "report absent": "error: results folder absent: it holds no experiment.toml",
    "expert cliff-walking --check folder": "error: values file folder: not a file of Q values",
    "expert cliff-walking --check empty": "error: values file empty: not a file of Q values (it is",
    "expert cliff-walking --check small.toml": "not a file of Q values (no archive of NumPy)",
    "expert cliff-walking --check network.npz": "task cliff-walking needs a table",
    "expert cliff-walking --out folder": "error: --out folder: it is a folder; a file is needed",
    "expert cliff-walking --out empty/values.npz": "error: --out: empty is a file",
    "expert lunar-lander --corrected folder": "error: --corrected folder: it is a folder",
    "expert cliff-walking --check network.npz --figures empty": "error: --figures: empty is a file",
    "reproduce cliff-walking --values folder": "error: values file folder: not a file of Q values",
    "reproduce cliff-walking --values network.npz": "they are of task CartPole-v1, not cliff-walk",
    "reproduce cliff-walking --trials 999999999999": "more than 1,000,000 is too many",
}


@pytest.mark.parametrize(("command", "message"), WRONG.items(), ids=list(WRONG))
def test_a_wrong_file_is_refused_in_one_line_before_any_work(call, place, command, message):
    before = sorted(path.name for path in place.iterdir())
    status, output, errors = call(*command.split())
    assert (status, output) == (2, "")
    assert errors.startswith("error: ")
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert sorted(path.name for path in place.iterdir()) == before


@pytest.mark.parametrize("message", ["one\ntwo\n  three", ""])
def test_an_unexpected_error_of_a_library_is_one_line(call, monkeypatch, message):
    def fail(*_, **__):
        raise ZeroDivisionError(message)

    monkeypatch.setattr("qbumpers.experiments.sources.load_experiment", fail)
    status, _, errors = call("run", "any.toml")
    assert (status, len(errors.splitlines())) == (1, 1)
    assert errors.startswith(f"failed: ZeroDivisionError: {' '.join(message.split())}")


def test_a_file_that_ends_too_early_is_no_interruption(call, monkeypatch):
    def fail(*_, **__):
        raise EOFError("no data left in file")

    monkeypatch.setattr("qbumpers.experiments.sources.load_experiment", fail)
    status, output, errors = call("run", "any.toml")
    assert (status, output) == (1, "")
    assert "a file ends too early: no data left in file" in errors


def test_warnings_are_lines_without_the_place_in_the_code(call, monkeypatch):
    def warn(*_, **__):
        warnings.warn("something\nis slow", UserWarning, stacklevel=1)
        raise RequestError("enough")

    monkeypatch.setattr("qbumpers.experiments.sources.load_experiment", warn)
    warnings.simplefilter("default")
    _, _, errors = call("run", "any.toml")
    assert errors.splitlines() == ["warning: something is slow", "error: enough"]
