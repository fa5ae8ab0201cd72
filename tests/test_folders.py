"""Folders of this machine and those that fsspec reaches behave alike."""

import threading

import filelock
import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from qbumpers.errors import RequestError
from qbumpers.files import StoreError, local_copy, open_folder


@pytest.fixture(params=["path", "memory", "local"])
def location(request, tmp_path):
    if request.param == "memory":
        url = f"memory://{tmp_path.name}/run"
        yield url
        system = fsspec.filesystem("memory")
        if system.exists(f"/{tmp_path.name}"):
            system.rm(f"/{tmp_path.name}", recursive=True)
    else:
        # fsspec's own local files stand for any other kind of remote folder.
        yield str(tmp_path / "run") if request.param == "path" else f"local://{tmp_path}/run"


def test_what_is_written_is_read_listed_and_removed(location):
    folder = open_folder(location)
    assert folder.read("a.txt") is None
    assert folder.names("cells/1") == []
    with folder.locked():
        folder.write("a.txt", b"old")
        folder.write("a.txt", b"new")
        for name in ("cells/1/b", "cells/1/a", "cells/2/c"):
            folder.write(name, name.encode())
        assert folder.names("cells/1") == ["cells/1/a", "cells/1/b"]
        folder.remove("cells/1/a")
    again = open_folder(location)
    assert again.read("a.txt") == b"new"
    assert again.names("cells/1") == ["cells/1/b"]
    assert again.read("cells/1/a") is None


def test_only_one_writer_holds_a_folder(location):
    folder = open_folder(location)
    with folder.locked():
        with (
            pytest.raises(RequestError, match=r"output folder .*run: .* is writing to it"),
            open_folder(location).locked(),
        ):
            pass
        folder.write("still.txt", b"held")
    with open_folder(location).locked():
        pass


def test_an_error_inside_opens_the_lock(location):
    with pytest.raises(KeyboardInterrupt), open_folder(location).locked():
        raise KeyboardInterrupt
    with open_folder(location).locked():
        pass


def test_of_many_writers_at_once_one_gets_in(tmp_path):
    url = f"memory://{tmp_path.name}/race"
    inside, refused = [], []
    both = threading.Barrier(8)

    def enter():
        both.wait()
        try:
            with open_folder(url).locked():
                inside.append(1)
                done.wait(5)
        except RequestError:
            refused.append(1)
            if len(refused) == 7:
                done.set()

    done = threading.Event()
    threads = [threading.Thread(target=enter) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(inside), len(refused)) == (1, 7)


def test_work_in_a_copy_is_kept_in_the_folder(location):
    folder = open_folder(location)
    with folder.locked():
        folder.write("a.txt", b"given")
        folder.write("b.txt", b"old")
    with local_copy(location, ["a.txt", "b.txt", "absent.txt"]) as place:
        assert (place / "a.txt").read_bytes() == b"given"
        (place / "b.txt").write_bytes(b"changed")
        (place / "figures").mkdir()
        (place / "figures" / "c.png").write_bytes(b"new")
    assert folder.read("b.txt") == b"changed"
    assert folder.read("figures/c.png") == b"new"
    assert folder.read("a.txt") == b"given"


def test_a_local_folder_that_is_locked_by_another_process_is_refused(tmp_path):
    with (
        filelock.FileLock(tmp_path / ".lock"),
        pytest.raises(RequestError, match="another run is writing to it"),
        open_folder(tmp_path).locked(),
    ):
        pass


@pytest.mark.parametrize(
    ("url", "message"),
    [("gopher://a/b", "Protocol not known: gopher"), ("s3://a/b", "Install s3fs")],
)
def test_a_url_that_cannot_be_reached_says_why(url, message):
    with pytest.raises(RequestError, match=rf"^{url}: {message}"):
        open_folder(url)


def test_a_failing_object_store_is_named(tmp_path, monkeypatch):
    folder = open_folder(f"memory://{tmp_path.name}/failing")

    def fail(*_, **__):
        raise RuntimeError("no route")

    monkeypatch.setattr(MemoryFileSystem, "pipe_file", fail)
    with pytest.raises(StoreError, match=r"failing/a\.txt: RuntimeError: no route"):
        folder.write("a.txt", b"")
