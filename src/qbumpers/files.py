"""Files that appear whole or not at all, in folders of this machine and in object stores."""

import contextlib
import os
import platform
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

import filelock

from qbumpers.errors import RequestError

_LOCK = ".lock"
_PART = re.compile(r"\.(?P<name>.+)\.(?P<process>\d+)(?:@(?P<machine>.+))?\.part")


class StoreError(OSError):
    """Results could not be written or read; what was finished before stays."""


def write_atomically(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file so that it appears whole or not at all.

    Args:
        path: of the file; its folder is made if it is missing.
        write: writes it at the path that it is given.

    Raises:
        StoreError: if it cannot be written, for example on a full disk.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}@{platform.node()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise StoreError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):  # an unwritable folder: nothing was left there
            temporary.unlink(missing_ok=True)


def clear_left(folder: Path, own: Callable[[str], bool]) -> None:
    """Delete the temporary files that processes left which were killed while they wrote.

    Args:
        folder: in which they lie; those in folders below are left alone.
        own: whether a file of this name is one that the caller writes.
    """
    for path in folder.iterdir() if folder.is_dir() else ():
        part = _PART.fullmatch(path.name)
        if part is None or not own(part["name"]):
            continue
        elsewhere = part["machine"] not in (None, platform.node())
        if not elsewhere and not _is_running(int(part["process"])):
            path.unlink(missing_ok=True)


def _is_running(process: int) -> bool:
    """Whether there is a process of this number; on Windows nobody can ask without harm."""
    if os.name == "nt":
        return True
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # it is somebody else's
        return True
    return True


class Folder(Protocol):
    """A folder of files by name, for example "cells/1749e96024414f24/000000-100.parquet"."""

    def names(self, under: str) -> list[str]:
        """Names of the files in a folder below, sorted; none if there is no such folder."""
        ...

    def read(self, name: str) -> bytes | None:
        """What a file holds; None if there is none."""
        ...

    def write(self, name: str, content: bytes) -> None:
        """Write a file so that it appears whole or not at all; StoreError if it cannot be."""
        ...

    def remove(self, name: str) -> None:
        """Delete a file, if it is there."""
        ...

    def clear_left(self, under: str, own: Callable[[str], bool]) -> None:
        """Delete what killed processes left half-written in a folder below; see `clear_left`."""
        ...

    def locked(self) -> contextlib.AbstractContextManager[None]:
        """Keep other writers out.

        RequestError if the folder is a file or another run is writing to it; StoreError if
        it cannot be written.
        """
        ...


def open_folder(location: str | Path) -> Folder:
    """A folder of this machine, or one that fsspec reaches.

    Args:
        location: a path, or a URL such as "s3://bucket/run".

    Returns:
        The folder; nothing is made or looked at yet.

    Raises:
        RequestError: if the URL is of no known kind, or what it needs is not installed.
    """
    if "://" not in str(location):
        return LocalFolder(Path(location))
    return RemoteFolder(str(location))


class LocalFolder:
    """A folder of this machine, or a shared one that is mounted on it.

    Args:
        path: where the folder is; it need not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __str__(self) -> str:
        """The path."""
        return str(self._path)

    def names(self, under: str) -> list[str]:
        """See `Folder`."""
        place = self._path / under
        if not place.is_dir():
            return []
        return sorted(f"{under}/{path.name}" for path in place.iterdir() if path.is_file())

    def read(self, name: str) -> bytes | None:
        """See `Folder`."""
        try:
            return (self._path / name).read_bytes()
        except FileNotFoundError:
            return None
        except NotADirectoryError as error:
            raise RequestError(f"folder {self._path}: it is a file") from error
        except OSError as error:
            message = f"cannot read {self._path / name}: {error.strerror or error}"
            raise StoreError(message) from error

    def write(self, name: str, content: bytes) -> None:
        """See `Folder`."""
        write_atomically(self._path / name, lambda temporary: temporary.write_bytes(content))

    def remove(self, name: str) -> None:
        """See `Folder`."""
        (self._path / name).unlink(missing_ok=True)

    def clear_left(self, under: str, own: Callable[[str], bool]) -> None:
        """See `Folder`."""
        clear_left(self._path / under, own)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """See `Folder`; the lock of a killed run opens by itself."""
        if self._path.exists() and not self._path.is_dir():
            raise RequestError(f"output folder {self._path}: it is a file")
        try:
            self._path.mkdir(parents=True, exist_ok=True)
            lock = filelock.FileLock(self._path / _LOCK).acquire(timeout=0)
        except filelock.Timeout as error:
            raise RequestError(
                f"output folder {self._path}: another run is writing to it; wait for it, or choose "
                "another folder"
            ) from error
        except OSError as error:
            raise StoreError(
                f"cannot write {self._path / _LOCK}: {error.strerror or error}"
            ) from error
        with lock:
            yield


class RemoteFolder:
    """A folder that fsspec reaches, for example in an object store.

    Args:
        url: where the folder is, for instance "s3://bucket/results".

    Raises:
        RequestError: if the URL is of no known kind, or what it needs is not installed.
    """

    def __init__(self, url: str) -> None:
        try:
            import fsspec
        except ImportError as error:
            raise RequestError(f"{url}: pip install 'qbumpers[remote]'") from error
        try:
            self._system, path = fsspec.core.url_to_fs(url)
        except (ImportError, ValueError) as error:
            raise RequestError(f"{url}: {error}") from error
        self._url, self._root = url.rstrip("/"), path.rstrip("/")

    def __str__(self) -> str:
        """The URL."""
        return self._url

    def names(self, under: str) -> list[str]:
        """See `Folder`."""
        with self._failing(under):
            try:
                found = self._system.ls(self._place(under), detail=False, refresh=True)
            except FileNotFoundError:
                return []
        return sorted(f"{under}/{str(path).rpartition('/')[2]}" for path in found)

    def read(self, name: str) -> bytes | None:
        """See `Folder`."""
        with self._failing(name):
            try:
                return self._system.cat_file(self._place(name))
            except FileNotFoundError:
                return None

    def write(self, name: str, content: bytes) -> None:
        """See `Folder`."""
        with self._failing(name):
            self._put(name, content, "overwrite")

    def remove(self, name: str) -> None:
        """See `Folder`."""
        with self._failing(name), contextlib.suppress(FileNotFoundError):
            self._system.rm_file(self._place(name))

    def clear_left(self, under: str, own: Callable[[str], bool]) -> None:
        """See `Folder`; an object store shows no file before it is whole."""

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """See `Folder`; an object store cannot tell that a run was killed: a user must."""
        with self._failing(_LOCK):
            try:
                self._put(_LOCK, platform.node().encode(), "create")
            except FileExistsError as error:
                owner = (self.read(_LOCK) or b"").decode(errors="replace")
                raise RequestError(
                    f"output folder {self}: a run on {owner or 'another machine'} is writing to "
                    f"it; if that was killed, delete {self}/{_LOCK}"
                ) from error
        try:
            yield
        finally:
            self.remove(_LOCK)

    def _put(self, name: str, content: bytes, mode: str) -> None:
        place = self._place(name)
        self._system.makedirs(place.rpartition("/")[0], exist_ok=True)
        self._system.pipe_file(place, content, mode=mode)

    def _place(self, name: str) -> str:
        return f"{self._root}/{name}"

    @contextlib.contextmanager
    def _failing(self, name: str) -> Iterator[None]:
        try:
            yield
        except (RequestError, StoreError):
            raise
        except Exception as error:  # each file system has errors of its own
            raise StoreError(f"{self}/{name}: {type(error).__name__}: {error}") from error


@contextlib.contextmanager
def local_copy(location: str | Path, names: Iterable[str]) -> Iterator[Path]:
    """A folder of this machine to work in: the folder itself, or a copy that is written back.

    Args:
        location: a path, or a URL.
        names: files that the copy needs.

    Yields:
        The path; what is written below it is kept in the folder when the block ends well.

    Raises:
        RequestError: as `open_folder`.
        StoreError: if a file cannot be read or written.
    """
    if "://" not in str(location):
        yield Path(location)
        return
    folder = open_folder(location)
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place)
        for name in names:
            content = folder.read(name)
            if content is not None:
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                (copy / name).write_bytes(content)
        before = {path: path.stat().st_mtime_ns for path in copy.rglob("*")}
        yield copy
        for path in sorted(copy.rglob("*")):
            if path.is_file() and path.stat().st_mtime_ns != before.get(path):
                folder.write(path.relative_to(copy).as_posix(), path.read_bytes())
