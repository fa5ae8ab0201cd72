"""Experiment files as editors of every machine write them."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments.sources import load_experiment, make_experiment
from tests.experiments.examples import settings, write_toml


@pytest.fixture
def path(tmp_path):
    return write_toml(tmp_path / "small.toml")


def test_a_file_that_begins_with_a_mark_of_its_encoding_is_read(path):
    expected = load_experiment(path)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert load_experiment(path) == expected


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_a_file_in_another_encoding_says_so(path, encoding):
    mark = {"utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}.get(encoding, b"")
    path.write_bytes(mark + path.read_text().encode(encoding))
    with pytest.raises(RequestError, match=r"small\.toml: not valid TOML: it is UTF-16; save it"):
        load_experiment(path)


def test_bytes_that_are_no_text_are_named(path):
    path.write_bytes(path.read_bytes() + "# café".encode("latin-1"))
    with pytest.raises(RequestError, match=rf"byte {path.stat().st_size} is not UTF-8; save it"):
        load_experiment(path)


def test_a_folder_is_no_experiment_file(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(RequestError, match=r"experiment file .*folder\.toml: Is a directory"):
        load_experiment(tmp_path / "folder.toml")


@pytest.mark.parametrize("large", [False, True])
def test_more_cells_than_a_folder_can_hold_are_refused(large):
    message = "more than 1,000,000 is too many" if large else "more than 10,000 must be asked for"
    with pytest.raises(RequestError, match=message):
        make_experiment(settings(trials=10**13), large=large)


@pytest.mark.parametrize("name", [[["q-learning"]], {"name": "sarsa"}, 3])
def test_a_name_of_a_learner_that_is_none_is_refused(name):
    with pytest.raises(RequestError, match=r"unknown learners\.name"):
        make_experiment(settings(learners=[{"name": name}]))
