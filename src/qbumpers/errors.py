"""Errors that a user can mend: each names the field, the value and what is allowed."""

import difflib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


_LONGEST_SHOWN = 80


class RequestError(ValueError):
    """The request was wrong: a name, an option, a file or an environment that cannot serve."""


def shown(value: Any) -> str:
    """A value as messages show it: in one line, and not at length."""
    text = " ".join(repr(value).split())
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


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
    allowed = ", ".join(names) if names else "there are none"
    return RequestError(f"unknown {kind} {name!r}{_nearest(name, names)}. Known: {allowed}")


def _nearest(name: str, known: Iterable[str]) -> str:
    nearest = difflib.get_close_matches(str(name), list(known), n=1, cutoff=0.4)
    return f" (did you mean {nearest[0]!r}?)" if nearest else ""


def from_validation(
    error: "ValidationError", where: str, known_fields: Iterable[str] = ()
) -> RequestError:
    """One readable message of everything that Pydantic found wrong.

    Args:
        error: what Pydantic raised.
        where: what was being checked, for instance "assistant stochastic-q-bumpers".
        known_fields: names of fields, to suggest one for an unknown field.

    Returns:
        The error, to be raised by the caller.
    """
    problems = []
    for problem in error.errors(include_url=False):
        field = ".".join(str(part) for part in problem["loc"])
        given = "" if problem["type"] == "missing" else f" = {problem['input']!r}"
        message = problem["msg"][:1].lower() + problem["msg"][1:]
        if "ctx" in problem and isinstance(problem["ctx"].get("error"), RequestError):
            problems.append(str(problem["ctx"]["error"]))  # says itself what was given and where
            continue
        if problem["type"] == "extra_forbidden":
            message = f"unknown field{_nearest(str(problem['loc'][-1]), known_fields)}"
        problems.append(f"{field}{given}: {message}" if field else message)
    return RequestError(f"{where}: " + "; ".join(problems))


def checked(kind: type, fields: Mapping[str, Any], where: str) -> Any:
    """A NamedTuple of checked numbers.

    Args:
        kind: the NamedTuple class, its bounds written as `Annotated[float, Field(ge=0, le=1)]`.
        fields: values by name.
        where: for messages, for instance "learner".

    Returns:
        An instance of `kind`, whole numbers turned into floats where its fields are.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(kind).validate_python(dict(fields), strict=True)
    except ValidationError as error:
        raise from_validation(error, where) from error
