"""Further action values beside Q*, by name, for rules that ask for them: checked, and kept with it.

A name may stand for several: those of "goals" are "goals_0", "goals_1" and so on. In a file their
arrays are named "others.NAME.ARRAY", and their provenance is part of that of Q*.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from qbumpers.errors import RequestError

_PREFIX = "others"

PER_PROPOSAL = "proposals"
"""Name of further values of which there is one for each proposal, "proposals_0" and so on."""


def check_others(values: Any, shape_of: Callable[[Any], Any]) -> None:
    """Check that further values are of the same kind and shape as those that hold them.

    Args:
        values: what holds them, a `TabularValues` or `NetworkValues`.
        shape_of: what must be equal, of values of this kind.

    Raises:
        RequestError: if a name is no identifier, or further values are of another kind or shape or
            have further ones of their own.
    """
    for name, further in values.others.items():
        where = f"values of {values.task}: others[{name!r}]"
        if not (isinstance(name, str) and name.isidentifier()):
            raise RequestError(f"{where}: the name must be one word of letters, digits and _")
        if not isinstance(further, type(values)):
            kind = type(values).__name__
            raise RequestError(f"{where} is a {type(further).__name__}; {kind} are needed")
        if further.others:
            raise RequestError(f"{where} has further values of its own, which nothing could name")
        if shape_of(further) != shape_of(values):
            raise RequestError(
                f"{where} has the shape {shape_of(further)}; {shape_of(values)}, that of Q*, is "
                "needed"
            )


def digest_of_others(others: Mapping[str, Any]) -> bytes:
    """What the digest of values adds for further ones; nothing if there are none."""
    if not others:
        return b""
    digests = {name: further.digest() for name, further in others.items()}
    return json.dumps(digests, sort_keys=True).encode()


def arrays_of_others(others: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The arrays of further values, by the names that they have in a file."""
    return {
        f"{_PREFIX}.{name}.{array}": numbers
        for name, further in others.items()
        for array, numbers in further.arrays().items()
    }


def provenance_of_others(others: Mapping[str, Any]) -> dict[str, Any]:
    """What the provenance of values adds for further ones; nothing if there are none."""
    if not others:
        return {}
    return {_PREFIX: {name: further.provenance() for name, further in others.items()}}


def separated(
    arrays: Mapping[str, np.ndarray],
) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """The arrays of a file that are Q*'s own, and those of each of its further values."""
    own: dict[str, np.ndarray] = {}
    others: dict[str, dict[str, np.ndarray]] = {}
    for full_name, numbers in arrays.items():
        if full_name.startswith(f"{_PREFIX}."):
            _, name, array = full_name.split(".", 2)
            others.setdefault(name, {})[array] = numbers
        else:
            own[full_name] = numbers
    return own, others


def numbered(name: str, count: int) -> list[str]:
    """Names of the rows of further values that have several: NAME_0, NAME_1, ..."""
    return [f"{name}_{place}" for place in range(count)]


def all_further_values(
    values: Any, names: Iterable[str], assistant: str, actions: int
) -> dict[str, Any]:
    """Further values beside Q* of several names, by the names of their rows, in that order.

    Args:
        values: as for `further_values`.
        names: which further values its rule asks for.
        assistant: its name, for the message.
        actions: A.

    Raises:
        RequestError: as `further_values`.
    """
    found: dict[str, Any] = {}
    for name in names:
        found |= further_values(values, name, assistant, actions)
    return found


def further_values(values: Any, name: str, assistant: str, actions: int) -> dict[str, Any]:
    """Further values beside Q*, by name.

    Args:
        values: the assistant's Q*, of any kind; further ones are in `others`.
        name: which further values its rule asks for.
        assistant: its name, for the message.
        actions: A.

    Returns:
        The values of that name, or else those of NAME_0, NAME_1, ... in this order.

    Raises:
        RequestError: if the values hold none of the name, or not one for each proposal of
            `PER_PROPOSAL`.
    """
    further = getattr(values, "others", {})
    if name in further and name != PER_PROPOSAL:
        return {name: further[name]}
    found = {row: further[row] for row in numbered(name, len(further)) if row in further}
    if not found:
        known = ", ".join(further) or "none"
        raise RequestError(
            f"assistant {assistant}: it needs further values {name!r}; known: {known}"
        )
    if name == PER_PROPOSAL and len(found) != actions:
        raise RequestError(
            f"assistant {assistant}: it needs further values {', '.join(numbered(name, actions))}, "
            f"one for each proposal; known: {', '.join(further)}"
        )
    return found
