"""Action values of a tabular task, with their provenance, in memory and in a file."""

import hashlib
import io
import json
import math
import operator
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, cast
from zipfile import BadZipFile

import numpy as np

import qbumpers
from qbumpers.errors import RequestError, counted, in_short
from qbumpers.files import write_atomically
from qbumpers.values.fitting import Use, check_fit, check_made_for
from qbumpers.values.network import NetworkValues, network_values
from qbumpers.values.others import (
    arrays_of_others,
    check_others,
    digest_of_others,
    provenance_of_others,
    separated,
)

DECIMALS = 9
"""Exact values are rounded so: actions equally good in truth must not differ by round-off."""

# What NumPy and the archive's reader raise at a file of another kind, or with a byte changed.
_DAMAGE = (
    OSError, EOFError, KeyError, TypeError, ValueError, AttributeError, RuntimeError, BadZipFile,
    zlib.error,
)  # fmt: skip


class QValues(Protocol):
    """The assistant's action values: any callable from an observation to values.

    A `discount` attribute, if there is one, says which discount the values were made with.
    """

    def __call__(self, observation: Any, /) -> Any:
        """Q*(s, .) as float [A], in reward units."""
        ...


@dataclass(frozen=True, eq=False)
class TabularValues:
    """Q*(s, a) of every state and action, and where it comes from.

    Attributes:
        table: float64 [S, A], in reward units, read-only.
        discount: gamma of the values, in (0, 1].
        task: name of the task.
        method: how they were made, in words.
        version: which version of the package made them.
        others: further values by name, of the same shape, for rules that ask for them; an array
            [S, A] will do.
        made_for: identity of the task that they were made for; empty if it is not known.

    Raises:
        RequestError: if a table is not two-dimensional or holds a number that is not finite, the
            discount is out of range, or further values do not suit.
    """

    table: np.ndarray
    discount: float
    task: str
    method: str
    version: str = qbumpers.__version__
    others: Mapping[str, "TabularValues"] = field(default_factory=dict[str, "TabularValues"])
    made_for: str = ""

    def __post_init__(self) -> None:
        """Check the table and freeze it."""
        if not 0 < self.discount <= 1:
            raise RequestError(
                f"values of {self.task}: discount = {self.discount!r}; it must lie in (0, 1]"
            )
        table = _numbers(self.table, f"values of {self.task}: table")
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
        others = {name: self._further(given) for name, given in self.others.items()}
        object.__setattr__(self, "others", others)
        check_others(self, lambda values: values.table.shape)

    def _further(self, given: Any) -> Any:
        """Further values; an array is taken for a table of the same origin."""
        if not isinstance(given, np.ndarray):
            return given
        return TabularValues(
            cast(np.ndarray, given), self.discount, self.task, self.method, self.version
        )

    def __call__(self, observation: Any, /) -> np.ndarray:
        """Q*(s, .) as float64 [A]; the observation is the number of the state, from 0.

        Raises:
            RequestError: if it is no such number.
        """
        try:
            state = operator.index(observation)
        except TypeError:
            state = -1
        if not 0 <= state < len(self.table):  # -1 would be taken for the last state
            raise RequestError(
                f"values of {self.task}: {in_short(observation)} is not the number of a state; "
                f"their table has {counted(len(self.table), 'state')}, from 0 on"
            )
        return self.table[state]

    def reordered(self, actions: Sequence[int]) -> "TabularValues":
        """The same values with their actions in another order.

        Args:
            actions: [A], each once; action a has the values that action actions[a] has here.
        """
        others = {name: each.reordered(actions) for name, each in self.others.items()}
        return replace(self, table=self.table[:, list(actions)], others=others)

    def check_fit(self, use: Use) -> None:
        """Compare them with what they are put to.

        Args:
            use: what that is.

        Raises:
            RequestError: if they are too few, too many or of another kind, or were made for
                something else.
        """
        if self.table.shape != (use.rows, use.actions):
            raise RequestError(
                f"values of {self.task}: a table {list(self.table.shape)}; {use.name} needs "
                f"{use.needs()}"
            )
        check_made_for(self, use)

    def digest(self) -> str:
        """A SHA-256 of tables and discounts: equal for values that decide alike."""
        shape = json.dumps([*self.table.shape, self.discount])
        content = shape.encode() + self.table.tobytes() + digest_of_others(self.others)
        return hashlib.sha256(content).hexdigest()

    def save(self, path: str | Path) -> None:
        """Write a NumPy `.npz` file, atomically; `load_values` reads it back.

        Args:
            path: where the file goes.

        Raises:
            StoreError: if it cannot be written.
        """
        content = self.encoded()
        write_atomically(Path(path), lambda temporary: temporary.write_bytes(content))

    def encoded(self) -> bytes:
        """The values as the bytes of a NumPy `.npz` file."""
        provenance = json.dumps({**self.provenance(), "sha256": self.digest()})
        arrays: dict[str, Any] = {**self.arrays(), **arrays_of_others(self.others)}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays, provenance=provenance)
        return buffer.getvalue()

    def arrays(self) -> dict[str, np.ndarray]:
        """The numbers by the names that they have in a file."""
        return {"table": self.table}

    def provenance(self) -> dict[str, Any]:
        """Where the values come from, as JSON-like data."""
        return {
            "task": self.task,
            "method": self.method,
            "discount": self.discount,
            "version": self.version,
            **({"made_for": self.made_for} if self.made_for else {}),
            **provenance_of_others(self.others),
        }


def load_values(path: str | Path) -> TabularValues | NetworkValues:
    """Read values that `TabularValues.save` or `NetworkValues.save` wrote.

    Args:
        path: where the file is.

    Returns:
        The values.

    Raises:
        RequestError: if the file is missing, is no such file, or was changed since.
    """
    try:
        content = Path(path).read_bytes()
    except FileNotFoundError as error:
        raise RequestError(f"values file {path}: there is none") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RequestError(f"values file {path}: not a file of Q values ({reason})") from error
    return decoded_values(content, str(path))


def decoded_values(content: bytes, path: str) -> TabularValues | NetworkValues:
    """Values from the bytes of a file that `save` wrote.

    Args:
        content: the bytes of the file.
        path: for messages.

    Returns:
        The values.

    Raises:
        RequestError: if it is no such file, its arrays do not fit together, or it was changed
            since.
    """
    version = ""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = dict(archive.items())
        provenance = json.loads(str(arrays.pop("provenance", "{}")))
        version = str(provenance.get("version", ""))
        expected = provenance.pop("sha256")
        values = _with_others(arrays, provenance)
    except RequestError as error:
        raise RequestError(f"values file {path}: {error}") from error
    except _DAMAGE as error:
        raise RequestError(f"values file {path}: {_reason(content, version, error)}") from error
    if values.digest() != expected:
        raise RequestError(
            f"values file {path}: its contents do not match its hash; it was changed"
        )
    return values


def _reason(content: bytes, version: str, error: Exception) -> str:
    """Why a file cannot be read."""
    if version not in ("", qbumpers.__version__):
        return f"written by qbumpers {version}, and this is {qbumpers.__version__} ({error})"
    if not content.startswith(b"PK"):
        return f"not a file of Q values ({'no archive of NumPy' if content else 'it is empty'})"
    if b"_stable_baselines3_version" in content:
        return (
            "a model of Stable-Baselines3; convert it by qbumpers.experts.from_stable_baselines "
            "and save the values"
        )
    return f"not a file of Q values ({error})"


def _with_others(
    arrays: dict[str, np.ndarray], provenance: dict[str, Any]
) -> TabularValues | NetworkValues:
    own, further = separated(arrays)
    origins = provenance.pop("others", {})
    if set(further) != set(origins):
        raise RequestError(
            f"it holds further values {sorted(further)} and the provenance of {sorted(origins)}"
        )
    others = {name: _values(further[name], dict(origins[name])) for name in origins}
    return _values(own, {**provenance, "others": others})


def _values(
    arrays: dict[str, np.ndarray], provenance: dict[str, Any]
) -> TabularValues | NetworkValues:
    if "table" in arrays:
        return TabularValues(table=arrays["table"], **provenance)
    return network_values(arrays, provenance)


def _numbers(given: Any, what: str) -> np.ndarray:
    try:
        return np.array(given, np.float64)
    except (TypeError, ValueError) as error:
        raise RequestError(f"{what} = {in_short(given)}; an array of numbers is needed") from error


def as_values(values: Any, use: Use) -> QValues:
    """Values of whatever may be given as such, compared with what they are put to.

    Args:
        values: a float array [S, A], or what is called for the values of a state.
        use: what they are put to.

    Returns:
        The values; of an array, a table with the discount of the use, if that is known.

    Raises:
        RequestError: as `check_fit`.
    """
    if isinstance(values, np.ndarray) and use.discount is not None:
        table = cast(np.ndarray, values)
        return as_values(TabularValues(table, use.discount, use.name, "given as an array"), use)
    check_fit(values, use)
    return cast(QValues, values)


def check_width(values: Any, actions: int, where: str) -> np.ndarray:
    """One row of action values, checked.

    Args:
        values: what a `QValues` returned.
        actions: A, how many are needed.
        where: for the message, for instance "at reset".

    Returns:
        float64 [A], a copy.

    Raises:
        RequestError: if the width is wrong or a value is not finite.
    """
    row = _numbers(values, f"Q values {where}")
    if row.shape != (actions,):
        raise RequestError(
            f"Q values {where} have shape {row.shape}; one value per action, ({actions},), is "
            "needed"
        )
    # The sum is finite only if every value is; it is ten times as fast to look at.
    if not math.isfinite(sum(row.tolist())) and not np.isfinite(row).all():
        raise RequestError(f"Q values {where} are {row.tolist()}; every value must be finite")
    return row
