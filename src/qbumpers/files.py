"""Files that appear whole or not at all."""

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

LEFT_BEHIND = ".*.part"
"""Pattern of the temporary files that a killed process leaves."""


class StoreError(OSError):
    """Results could not be written or read; what was finished before stays."""


def write_atomically(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file so that it appears whole or not at all.

    Args:
        path: of the file; its folder is made where it is missing.
        write: writes it at the path that it is given.

    Raises:
        StoreError: where it cannot be written, for instance on a full disk.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
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
