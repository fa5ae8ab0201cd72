"""Errors that a user can mend: each names the field, the value and what is allowed."""

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError


class RequestError(ValueError):
    """The request was wrong: a name, an option, a file or an environment that cannot serve."""


def unknown_name(kind: str, name: str, known: Iterable[str]) -> RequestError:
    """An error for an unknown name, with the nearest known one.

    Args:
        kind: what was named, for instance "assistant".
        name: what the user wrote.
        known: the names that exist.

    Returns:
        The error, to be raised by the caller.
    """
    names = list(known)
    nearest = difflib.get_close_matches(str(name), names, n=1, cutoff=0.4)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
    allowed = ", ".join(names) if names else "there are none"
    return RequestError(
        f"unknown {kind} {name!r}{hint} Known: {allowed}"
        if hint
        else f"unknown {kind} {name!r}. Known: {allowed}"
    )


def from_validation(error: "ValidationError", where: str) -> RequestError:
    """One readable message of everything that Pydantic found wrong.

    Args:
        error: what Pydantic raised.
        where: what was being checked, for instance "assistant stochastic-q-bumpers".

    Returns:
        The error, to be raised by the caller.
    """
    problems = []
    for problem in error.errors(include_url=False):
        field = ".".join(str(part) for part in problem["loc"])
        given = "" if problem["type"] == "missing" else f" = {problem['input']!r}"
        problems.append(f"{field}{given}: {problem['msg']}" if field else problem["msg"])
    return RequestError(f"{where}: " + "; ".join(problems))
