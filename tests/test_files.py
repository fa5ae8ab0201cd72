"""Files appear whole or not at all."""

import errno
import os

import pytest

from qbumpers.files import StoreError, write_atomically


def write_half(path):
    path.write_bytes(b"half of it")
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def interrupted(path):
    path.write_bytes(b"half of it")
    raise KeyboardInterrupt


@pytest.mark.parametrize("old", [None, b"old and whole"])
@pytest.mark.parametrize(
    ("write", "error", "message"),
    [
        (write_half, StoreError, r"cannot write .*table\.csv: No space left on device$"),
        (interrupted, KeyboardInterrupt, "$"),
        (lambda path: None, StoreError, r"cannot write .*table\.csv: No such file"),
    ],
    ids=["full", "interrupted", "writes nothing"],
)
def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, write, error, message, old):
    path = tmp_path / "folder" / "table.csv"
    if old:
        write_atomically(path, lambda temporary: temporary.write_bytes(old))
    with pytest.raises(error, match=message):
        write_atomically(path, write)
    assert [p.read_bytes() for p in path.parent.iterdir()] == ([old] if old else [])


def test_a_write_replaces_the_old_file_in_one_step(tmp_path):
    path = tmp_path / "folder" / "table.csv"
    write_atomically(path, lambda temporary: temporary.write_bytes(b"old"))
    seen = []

    def write(temporary):
        temporary.write_bytes(b"new")
        seen.append(path.read_bytes())

    with path.open("rb") as reader:
        write_atomically(path, write)
        assert reader.read() == b"old"  # whoever has it open reads one file, not parts of two
    assert seen == [b"old"]
    assert path.read_bytes() == b"new"
    assert [p.name for p in path.parent.iterdir()] == ["table.csv"]
