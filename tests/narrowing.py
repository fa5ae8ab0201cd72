"""Assertions that also tell the type checker what a test goes on with."""

from typing import TypeVar

Thing = TypeVar("Thing")


def present(thing: Thing | None) -> Thing:
    """The thing itself: a test fails if there is none."""
    assert thing is not None
    return thing


def of_kind(kind: type[Thing], thing: object) -> Thing:
    """The thing itself: a test fails if it is of another class."""
    assert isinstance(thing, kind), f"a {type(thing).__name__}, not a {kind.__name__}"
    return thing
