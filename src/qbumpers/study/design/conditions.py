"""Conditions of a study, levels of its factors crossed; and orders of what is counterbalanced."""

import itertools
from collections.abc import Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field, model_validator

from qbumpers.errors import RequestError
from qbumpers.experiments.design import AssistantDesign
from qbumpers.experiments.models import Model
from qbumpers.study.design.instruments import Identifier

Visibility = Literal["hidden", "shown", "explained"]
"""Whether the page says that a step was overridden, and why."""

MOST_PERMUTED = 3
"""So many parts are put into every order; more, into those of a balanced Latin square."""


def _named_assistant(given: Any) -> Any:
    return {"name": given} if isinstance(given, str) else given


class Level(Model):
    """A level of a factor: what it says of a condition.

    Attributes:
        name: of the level.
        assistant: who helps in training, by name or as a table with options.
        overrides: whether they are "hidden", "shown" or "explained".
        yoked_to: name of another level: as many overrides as a participant had there, at other
            moments.
        cap: most participants of this level, complete and ongoing ones.
    """

    name: Identifier
    assistant: Annotated[AssistantDesign, BeforeValidator(_named_assistant)] | None = None
    overrides: Visibility | None = None
    yoked_to: str | None = None
    cap: Annotated[int, Field(ge=1)] | None = None

    @model_validator(mode="after")
    def _one_source_of_overrides(self) -> "Level":
        if self.yoked_to is not None and self.assistant is not None:
            raise RequestError(
                f"level {self.name}: yoked_to = {self.yoked_to!r} and an assistant; give one"
            )
        if self.assistant is not None and self.assistant.count() != 1:
            raise RequestError(
                f"level {self.name}: assistant {self.assistant.name} with lists of options is "
                f"{self.assistant.count()} assistants; make each a level"
            )
        return self


class Factor(Model):
    """A factor, crossed with all others.

    Attributes:
        name: of the factor.
        levels: at least two.
    """

    name: Identifier
    levels: Annotated[list[Level], Field(min_length=2)]


class Condition(NamedTuple):
    """What a participant is assigned to.

    Attributes:
        name: names of its levels, joined by "/".
        levels: by the name of their factor.
        assistant: name of the rule that helps in training; "none" if it is yoked.
        options: of the rule.
        overrides: "hidden", "shown" or "explained".
        yoked_to: name of the condition whose participants it is yoked to; empty if it is not.
        caps: (factor, level, most participants) of levels that have a cap.
    """

    name: str
    levels: dict[str, str]
    assistant: str
    options: dict[str, Any]
    overrides: Visibility
    yoked_to: str
    caps: tuple[tuple[str, str, int], ...]


def crossed(factors: Sequence[Factor]) -> list[Condition]:
    """Every combination of levels, the last factor fastest.

    Args:
        factors: at least one.

    Raises:
        RequestError: if two levels of a condition say the same thing, none names an assistant, or
            a level is yoked to none or to a yoked one.
    """
    for factor in factors:
        _check_names(factor)
    return [
        _condition(factors, levels) for levels in itertools.product(*(f.levels for f in factors))
    ]


def _check_names(factor: Factor) -> None:
    names = [level.name for level in factor.levels]
    for name in names:
        if names.count(name) > 1:
            raise RequestError(f"factor {factor.name}: level {name} occurs twice")
    free = [level.name for level in factor.levels if level.yoked_to is None]
    for level in factor.levels:
        if level.yoked_to is not None and level.yoked_to not in free:
            raise RequestError(
                f"level {level.name}: yoked_to = {level.yoked_to!r}; one of {', '.join(free)} is "
                "needed"
            )


def _condition(factors: Sequence[Factor], levels: Sequence[Level]) -> Condition:
    name = "/".join(level.name for level in levels)
    yoked = [level.yoked_to for level in levels if level.yoked_to is not None]
    helping = [a for level in levels if level.assistant for a in level.assistant.assistants()]
    showing: list[Visibility] = [level.overrides for level in levels if level.overrides is not None]
    if len(yoked) + len(helping) != 1:
        raise RequestError(
            f"condition {name}: {len(yoked) + len(helping)} of its levels say who assists; exactly "
            'one must, by assistant = "..." or yoked_to = "..."'
        )
    if len(showing) > 1:
        raise RequestError(f"condition {name}: two of its levels say whether overrides are shown")
    partner = "/".join(level.yoked_to or level.name for level in levels) if yoked else ""
    return Condition(
        name=name,
        levels={factor.name: level.name for factor, level in zip(factors, levels, strict=True)},
        assistant=helping[0].name if helping else "none",
        options=helping[0].described() if helping else {},
        overrides=showing[0] if showing else "shown",
        yoked_to=partner,
        caps=tuple(
            (factor.name, level.name, level.cap)
            for factor, level in zip(factors, levels, strict=True)
            if level.cap is not None
        ),
    )


def orders_of(size: int) -> list[tuple[int, ...]]:
    """The orders into which so many things are put.

    Args:
        size: how many, at least 2.

    Returns:
        All permutations of up to `MOST_PERMUTED`; else the rows of a balanced Latin square
        (Williams 1949), in which each thing follows each other one equally often.
    """
    if size <= MOST_PERMUTED:
        return list(itertools.permutations(range(size)))
    zigzag = [(k + 1) // 2 if k % 2 else -(k // 2) for k in range(size)]
    rows = [tuple((start + move) % size for move in zigzag) for start in range(size)]
    return rows if size % 2 == 0 else [*rows, *(row[::-1] for row in rows)]
