"""Action values of a tabular task, with their provenance, in memory and in a file."""

import hashlib
import io
import json
import math
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from zipfile import BadZipFile

import numpy as np

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.files import write_atomically
from qbumpers.values.network import NetworkValues, network_values

# What NumPy and the archive's reader raise at a file of another kind, or with a byte changed.
_DAMAGE = (
    OSError, EOFError, KeyError, TypeError, ValueError, AttributeError, RuntimeError, BadZipFile,
    zlib.error,
)  # fmt: skip


class QValues(Protocol):
    """The assistant's action values: any callable from an observation to values.

    A `discount` attribute, where there is one, says which discount the values were made with.
    """

    def __call__(self, observation: Any, /) -> Any:
        """Q*(s, .) as float [A], in reward units."""
        ...


@dataclass(frozen=True, eq=False)
class TabularValues:
    """Q*(s, a) of every state and action, and where it comes from.

    Attributes:
        table: float64 [S, A], in reward units, read-only.
        discount: of the values.
        task: name of the task.
        method: how they were made, in words.
        version: of the package that made them.

    Raises:
        RequestError: where the table is not two-dimensional or holds a number that is not finite.
    """

    table: np.ndarray
    discount: float
    task: str
    method: str
    version: str = qbumpers.__version__

    def __post_init__(self) -> None:
        """Check the table and freeze it."""
        table = np.array(self.table, np.float64)
        if table.ndim != 2:
            raise RequestError(
                f"values of {self.task}: table has shape {table.shape}; [S, A] is needed"
            )
        broken = np.argwhere(~np.isfinite(table))
        if len(broken):
            state, action = broken[0]
            raise RequestError(
                f"values of {self.task}: Q({state}, {action}) = {table[state, action]}; "
                "every value must be finite"
            )
        table.flags.writeable = False
        object.__setattr__(self, "table", table)

    def __call__(self, observation: Any, /) -> np.ndarray:
        """Q*(s, .) as float64 [A]; the observation is the number of the state."""
        return self.table[observation]

    def digest(self) -> str:
        """A SHA-256 of the table and the discount: equal for values that decide alike."""
        shape = json.dumps([*self.table.shape, self.discount])
        return hashlib.sha256(shape.encode() + self.table.tobytes()).hexdigest()

    def save(self, path: str | Path) -> None:
        """Write a NumPy `.npz` file, atomically; `load_values` reads it back.

        Args:
            path: of the file.

        Raises:
            StoreError: where it cannot be written.
        """
        content = self.encoded()
        write_atomically(Path(path), lambda temporary: temporary.write_bytes(content))

    def encoded(self) -> bytes:
        """The values as the bytes of a NumPy `.npz` file."""
        provenance = {
            "task": self.task,
            "method": self.method,
            "discount": self.discount,
            "version": self.version,
            "sha256": self.digest(),
        }
        buffer = io.BytesIO()
        np.savez_compressed(buffer, table=self.table, provenance=json.dumps(provenance))
        return buffer.getvalue()


def load_values(path: str | Path) -> TabularValues | NetworkValues:
    """Read values that `TabularValues.save` or `NetworkValues.save` wrote.

    Args:
        path: of the file.

    Returns:
        The values.

    Raises:
        RequestError: where the file is missing, is no such file, or was changed since.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError as error:
        raise RequestError(f"values file {path}: there is none") from error
    except OSError as error:
        reason = error.strerror or error
        raise RequestError(f"values file {path}: not a file of Q values ({reason})") from error
    return decoded_values(content, str(path))


def decoded_values(content: bytes, path: str) -> TabularValues | NetworkValues:
    """Values from the bytes of a file that `save` wrote.

    Args:
        content: of the file.
        path: for messages.

    Returns:
        The values.

    Raises:
        RequestError: where it is no such file, its arrays do not fit together, or it was changed
            since.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = dict(archive.items())
        provenance = json.loads(str(arrays.pop("provenance")))
        expected = provenance.pop("sha256")
        if "table" in arrays:
            values = TabularValues(table=arrays["table"], **provenance)
        else:
            values = network_values(arrays, provenance)
    except RequestError as error:
        raise RequestError(f"values file {path}: {error}") from error
    except _DAMAGE as error:
        raise RequestError(f"values file {path}: not a file of Q values ({error})") from error
    if values.digest() != expected:
        raise RequestError(
            f"values file {path}: its contents do not match its hash; it was changed"
        )
    return values


def check_width(values: Any, actions: int, where: str) -> np.ndarray:
    """One row of action values, checked.

    Args:
        values: what a `QValues` returned.
        actions: A, how many are needed.
        where: for the message, for instance "at reset".

    Returns:
        float64 [A], a copy.

    Raises:
        RequestError: where the width is wrong or a value is not finite.
    """
    row = np.array(values, np.float64)
    if row.shape != (actions,):
        raise RequestError(
            f"Q values {where} have shape {row.shape}; one value an action, ({actions},), is needed"
        )
    # The sum is finite only where every value is; it is ten times as fast to look at.
    if not math.isfinite(sum(row.tolist())) and not np.isfinite(row).all():
        raise RequestError(f"Q values {where} are {row.tolist()}; every value must be finite")
    return row
