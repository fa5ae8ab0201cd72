"""Files appear whole or not at all."""

import errno
import os
import platform

import pytest

from qbumpers.files import StoreError, clear_left, write_atomically


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


def test_only_what_its_own_dead_process_left_is_cleared_away(tmp_path):
    below = tmp_path / "below"
    below.mkdir()
    names = {
        "of a dead process": f".a.csv.4194305@{platform.node()}.part",
        "of a dead process of an older version": ".a.csv.4194305.part",
        "of a living process": f".a.csv.{os.getpid()}@{platform.node()}.part",
        "of somebody else's process": f".a.csv.1@{platform.node()}.part",
        "of another machine": f".a.csv.4194305@not-{platform.node()}.part",
        "of another file": f".b.csv.4194305@{platform.node()}.part",
        "of a user": ".a.csv.part",
        "of a number that is none": f".a.csv.{2**70}@{platform.node()}.part",
    }
    for folder in (tmp_path, below):
        for name in names.values():
            (folder / name).write_bytes(b"half of it")
    clear_left(tmp_path, "a.csv".__eq__)
    gone = {about for about, name in names.items() if not (tmp_path / name).exists()}
    assert gone == {
        "of a dead process",
        "of a dead process of an older version",
        "of a number that is none",
    }
    assert len(list(below.iterdir())) == len(names)
    clear_left(tmp_path / "absent", "a.csv".__eq__)


def test_a_temporary_file_says_whose_it_is(tmp_path):
    seen = []
    path = tmp_path / "a.csv"

    def write(temporary):
        temporary.write_bytes(b"whole")
        seen.append(temporary.name)

    write_atomically(path, write)
    assert seen == [f".a.csv.{os.getpid()}@{platform.node()}.part"]


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
