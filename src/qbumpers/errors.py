"""Errors that a user can mend: each names the field, the value and what is allowed."""

import difflib
import numbers
import operator
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


_LONGEST_SHOWN = 80
_SYNONYMS = {
    "gamma": ("discount",),
    "discount_factor": ("discount",),
    "lr": ("learning_rate",),
    "step_size": ("learning_rate",),
    "alpha": ("learning_rate",),
    "eps": ("epsilon",),
    "exploration": ("epsilon",),
    "max_episode_steps": ("episode_limit",),
    "n_episodes": ("episodes",),
    "n_trials": ("trials",),
    "runs": ("trials",),
    "env": ("task",),
    "environment": ("task",),
    "env_kwargs": ("arguments",),
    "kwargs": ("arguments",),
    "q_values": ("values",),
    "agent": ("learner", "learners"),
    "agents": ("learners",),
    "policy": ("assistant", "assistants"),
}
"""What is known elsewhere by another word, and the words for it here."""


class RequestError(ValueError):
    """The request was wrong: a name, an option, a file or an environment that cannot serve."""


def whole_number(value: Any, where: str, allowed: str) -> int:
    """A number of an action or the like.

    Args:
        value: an int or one of NumPy's integers; a fraction or a text is no such number, and is not
            rounded.
        where: for the message, for instance "action".
        allowed: for the message, for instance "in [0, 4)".

    Raises:
        RequestError: if it is not whole.
    """
    try:
        return operator.index(value)
    except TypeError as error:
        raise RequestError(f"{where} = {value!r}; a whole number {allowed} is needed") from error


def action_number(value: Any, where: str, first: int, actions: int) -> int:
    """The number of an action.

    Args:
        value: as for `whole_number`.
        where: for the message, for instance "action".
        first: number of the first action.
        actions: how many there are.

    Raises:
        RequestError: if it is not whole, or not one of those actions.
    """
    if type(value) is int and first <= value < first + actions:  # of every step: without a text
        return value
    allowed = f"in [{first}, {first + actions})"
    number = whole_number(value, where, allowed)
    if not first <= number < first + actions:
        raise RequestError(f"{where} = {value!r}; it must lie {allowed}")
    return number


def in_short(value: Any) -> str:
    """A value as messages show it: in one line that is not long."""
    shown = " ".join(repr(value).split())
    return shown if len(shown) <= 80 else f"{shown[:77]}..."


def counted(number: int, noun: str) -> str:
    """How many of something, for instance "1 trial" or "2,000 trials"."""
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"


def check_number(value: Any, where: str, allowed: str) -> None:
    """Check that something is a number at all, before it is compared.

    Args:
        value: an int, a float or one of NumPy's numbers; a text is none.
        where: for the message, for instance "discount".
        allowed: for the message, for instance "in (0, 1]".

    Raises:
        RequestError: if it is none.
    """
    if not isinstance(value, numbers.Real):
        raise RequestError(f"{where} = {value!r}; a number {allowed} is needed")


def unknown_name(kind: str, name: str, known: Iterable[str], otherwise: str = "") -> RequestError:
    """An error for an unknown name, with the nearest known one.

    Args:
        kind: what was named, for instance "assistant".
        name: what the user wrote.
        known: names that would have been right, which the message lists.
        otherwise: what may help if no known one is near.

    Returns:
        The error, to be raised by the caller.
    """
    names = list(known)
    allowed = ", ".join(names) if names else "there are none"
    near = suggestion(name, names) or otherwise
    return RequestError(f"unknown {kind} {name!r}{near}. Known: {allowed}")


def suggestion(name: str, known: Iterable[str]) -> str:
    """The known name that may be meant, in brackets, for a message; empty if none is near.

    Args:
        name: what the user wrote.
        known: names that would have been right.
    """
    names = list(known)
    meant = [each for each in _SYNONYMS.get(str(name), ()) if each in names]
    nearest = meant or difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
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
    problems: list[str] = []
    for problem in error.errors(include_url=False):
        field = ".".join(str(part) for part in problem["loc"])
        given = "" if problem["type"] == "missing" else f" = {problem['input']!r}"
        message = problem["msg"][:1].lower() + problem["msg"][1:]
        if "ctx" in problem and isinstance(problem["ctx"].get("error"), RequestError):
            problems.append(str(problem["ctx"]["error"]))  # says itself what was given and where
            continue
        if problem["type"] == "extra_forbidden":
            message = f"unknown field{suggestion(str(problem['loc'][-1]), known_fields)}"
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
    from pydantic.errors import PydanticUserError

    try:
        return TypeAdapter(kind).validate_python(dict(fields), strict=True)
    except ValidationError as error:
        raise from_validation(error, where) from error
    except PydanticUserError as error:
        reason = str(error).partition(". ")[0]
        raise RequestError(f"{where}: {reason}") from error
