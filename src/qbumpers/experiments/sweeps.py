"""Sweeps: every combination of what a file gives as lists."""

import itertools
import math
from collections.abc import Mapping
from typing import Any, get_type_hints

from qbumpers.assistants import assistants
from qbumpers.errors import RequestError


def combinations(options: Mapping[str, Any]) -> int:
    """How many combinations `swept` makes."""
    return math.prod(len(value) for value in options.values() if isinstance(value, list))


def swept(options: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """Every combination of listed options.

    Args:
        options: by name; lists are swept over.
        where: for messages, for instance "assistant stochastic-q-bumpers".

    Returns:
        Options by name, the last listed one changing fastest.

    Raises:
        RequestError: if a list is empty.
    """
    for option, values in options.items():
        if values == []:
            raise RequestError(f"{where}: {option} = []; at least one value is needed")
    lists = [value if isinstance(value, list) else [value] for value in options.values()]
    return [dict(zip(options, values, strict=True)) for values in itertools.product(*lists)]


def options_listed(name: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Options with a list if, and only if, they are to be swept over.

    A list is a value of an option that is a tuple, and a list of such lists is swept over; the
    options of another assistant (`of`) are swept over inside their own table.
    """
    rules = assistants()
    hints = get_type_hints(rules[name].options_type) if name in rules else {}
    listed = dict(options)
    for option, value in options.items():
        is_tuple = getattr(hints.get(option), "__origin__", None) is tuple
        if is_tuple and isinstance(value, list) and not any(isinstance(v, list) for v in value):
            listed[option] = [value]
        elif option == "of":
            given = value if isinstance(value, list) else [value]
            listed[option] = [one for each in given for one in _others(each)]
    return listed


def _others(given: Any) -> list[Any]:
    """The assistants that a rule is over: one for each combination of listed options of a table."""
    if not (isinstance(given, dict) and isinstance(given.get("name"), str)):
        return [given]
    name = given["name"]
    options = {field: each for field, each in given.items() if field != "name"}
    return [
        {"name": name, **table}
        for table in swept(options_listed(name, options), f"assistant {name}")
    ]


def tables_listed(learner: dict[str, Any]) -> dict[str, Any]:
    """A learner whose tables of layers around it are swept over if something in them is."""
    listed = dict(learner)
    for field in learner.keys() & {"perception", "motor", "forgetting"}:
        given = learner[field] if isinstance(learner[field], list) else [learner[field]]
        found = [
            table
            for each in given
            for table in (swept(each, f"learner: {field}") if isinstance(each, dict) else [each])
        ]
        listed[field] = found[0] if len(found) == 1 else found
    return listed
