"""Compiled code in files, each found by what it was compiled for and checked before it is used.

Numba's own cache finds code through an index per function. Two processes that write at once can
leave an index that names the code of the other, and damaged code is found out by running it. Here
every piece of code is a file of its own, which names what it is and carries a digest.
"""

import glob
import hashlib
import os
import pickle
import uuid
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.serialize import dumps

_DIGEST = hashlib.sha256
_DIGEST_SIZE = _DIGEST().digest_size
_VERSIONS = f"{numba.__version__} {llvmlite.__version__} {np.__version__}"


class KeptCodeWarning(UserWarning):
    """Compiled code cannot be kept, or was damaged: it is compiled again, which takes time."""


class DamagedCodeError(Exception):
    """A file does not hold what was once written."""


class CodeFiles:
    """The compiled code of one function, for any types of arguments.

    Args:
        folder: of the files; it need not exist yet.
        name: how the names of this function's files begin.
        stamp: of the sources that the code comes from; code of another stamp is never found.
    """

    def __init__(self, folder: str | Path, name: str, stamp: str) -> None:
        self.folder, self._name = Path(folder), name
        self._stamp = _DIGEST(f"{_VERSIONS} {stamp}".encode()).hexdigest()

    def load(self, key: Any) -> Any:
        """The code for some types of arguments.

        Args:
            key: the types, and whatever else the code depends on.

        Returns:
            What was saved; None if there is none.

        Raises:
            DamagedCodeError: if the file was changed since.
            OSError: if it cannot be read.
        """
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        digest, body = content[:_DIGEST_SIZE], content[_DIGEST_SIZE:]
        if _DIGEST(body).digest() != digest:
            raise DamagedCodeError(f"{path.name} was damaged")
        try:
            stamp, found, code = pickle.loads(body)
        except Exception:  # types of another program's own, which this one cannot import
            return None
        return pickle.loads(code) if (stamp, found) == (self._stamp, key) else None

    def save(self, key: Any, code: Any) -> None:
        """Keep code; the file appears whole or not at all, and code of other sources goes.

        Args:
            key: as for `load`.
            code: anything that Numba can pickle.

        Raises:
            OSError: if it cannot be written.
        """
        body = dumps((self._stamp, key, dumps(code)))
        path = self._path(key)
        temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}.part")
        try:
            temporary.write_bytes(_DIGEST(body).digest() + body)
            temporary.replace(path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise
        self._remove(but=f".{self._stamp[:16]}.")

    def flush(self) -> None:
        """Remove the code of this function."""
        self._remove()

    def _path(self, key: Any) -> Path:
        types = _DIGEST(repr(key).encode()).hexdigest()
        return self.folder / f"{self._name}.{self._stamp[:16]}.{types[:16]}.nbc"

    def _remove(self, but: str | None = None) -> None:
        for path in self.folder.glob(f"{glob.escape(self._name)}.*.nbc"):
            if but is None or but not in path.name:
                path.unlink(missing_ok=True)


def reason(error: BaseException) -> str:
    """Why code could not be read or written, in a few words."""
    if isinstance(error, OSError) and error.errno is not None:
        return os.strerror(error.errno)
    return str(error) or type(error).__name__
