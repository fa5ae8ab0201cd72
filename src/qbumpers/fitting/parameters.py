"""The parameters of a learner, of its perception, its hand and its lapses, by their names.

Names are those of the settings: `epsilon.start`, `inverse_temperature`; then `perception.notices`,
`perception.penalty`, `motor.slip`, `motor.lag` and `lapse`. A whole schedule, `learning_rate`, is
one number that stays the same in all episodes.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

from qbumpers.errors import RequestError, check_number, unknown_name
from qbumpers.fitting.likelihood import Stack
from qbumpers.learners import Motor, Perception, Schedule, learner_type
from qbumpers.registration import as_numbers

FIXED = ("discount", "initial_value", "fraction")
"""Last parts of names that are not free unless they are asked for."""

LAPSE = 0.001
"""Lapse rate that every learner has unless it is said otherwise.

Without one, a single choice that a fitted learner excludes makes a whole record impossible."""

_AROUND = ("perception", "motor", "lapse")
_LEAST, _MOST, _FARTHEST = 1e-4, 1e2, 1e2


class Parameter(NamedTuple):
    """A number of a learner, and in what coordinate it is searched for.

    Between two bounds the coordinate is the arcsine of the root of the share of the way, which
    reaches both bounds; above one, the logarithm, from 0.0001 to 100 above it; without, the inverse
    hyperbolic sine, from -100 to 100.

    Attributes:
        name: as the settings have it.
        low: least value; -inf if there is none.
        high: largest value; inf if there is none.
    """

    name: str
    low: float
    high: float

    def coordinate(self, value: float) -> float:
        """Where a value lies; of one that is outside, the nearest end."""
        low, high = self.ends()
        if math.isfinite(self.high):
            share = (value - self.low) / (self.high - self.low)
            return math.asin(math.sqrt(min(max(share, 0.0), 1.0)))
        if math.isfinite(self.low):
            return min(max(math.log(max(value - self.low, _LEAST)), low), high)
        return min(max(math.asinh(value), low), high)

    def value(self, coordinate: float) -> float:
        """What lies at a coordinate."""
        if math.isfinite(self.high):
            return self.low + (self.high - self.low) * math.sin(coordinate) ** 2
        if math.isfinite(self.low):
            return self.low + math.exp(coordinate)
        return math.sinh(coordinate)

    def ends(self) -> tuple[float, float]:
        """The least and the largest coordinate."""
        if math.isfinite(self.high):
            return 0.0, math.pi / 2
        if math.isfinite(self.low):
            return math.log(_LEAST), math.log(_MOST)
        return -math.asinh(_FARTHEST), math.asinh(_FARTHEST)


def make_stack(learner: str, perception: Perception, fixed: Mapping[str, float]) -> Stack:
    """A learner with its default settings, but for some numbers.

    Args:
        learner: its registered name.
        perception: how it reads overridden steps.
        fixed: numbers by the names of their parameters.

    Raises:
        RequestError: if there is no such learner or parameter, or a number is out of range.
    """
    kind: Any = learner_type(learner).settings_type
    stack = Stack(as_numbers(kind()), as_numbers(perception), Motor(), LAPSE)
    known = parameters_of(stack)
    for name, number in fixed.items():
        parameter = known_parameter(known, name, learner)
        check_number(number, name, f"in [{parameter.low:g}, {parameter.high:g}]")
        if not parameter.low <= number <= parameter.high:
            raise RequestError(
                f"{name} = {number!r}; it must lie in [{parameter.low:g}, {parameter.high:g}]"
            )
    return with_values(stack, fixed)


def known_parameter(known: Mapping[str, Parameter], name: str, learner: str) -> Parameter:
    """A parameter by its name.

    Raises:
        RequestError: if the learner has none of that name.
    """
    if name not in known:
        raise unknown_name(f"parameter of learner {learner}:", name, known)
    return known[name]


def parameters_of(stack: Stack) -> dict[str, Parameter]:
    """Every parameter that a learner and what lies around it have, by name.

    Whole numbers and fixed texts are no parameters: they cannot be searched along a line.
    """
    found = [*_leaves(type(stack.settings), "")]
    found += [*_leaves(Perception, "perception."), *_leaves(Motor, "motor.")]
    return {each.name: each for each in [*found, Parameter("lapse", 0.0, 1.0)]}


def free_by_default(stack: Stack) -> list[str]:
    """Names of the parameters that are estimated unless it is said otherwise: the learner's own.

    All its numbers but discount, initial value, and over which share of the episodes a schedule
    changes.
    """
    return [
        name
        for name in parameters_of(stack)
        if name.partition(".")[0] not in _AROUND
        and name.rpartition(".")[2] not in FIXED
        and not isinstance(_reached(stack, name), Schedule)
    ]


def values_of(stack: Stack, names: Iterable[str]) -> dict[str, float]:
    """The numbers of some parameters; of a whole schedule, its end."""
    found = {name: _reached(stack, name) for name in names}
    return {n: float(v.end if isinstance(v, Schedule) else v) for n, v in found.items()}


def with_values(stack: Stack, values: Mapping[str, float]) -> Stack:
    """The same learner with some parameters changed."""
    for name, value in values.items():
        path = name.split(".")
        stack = _replaced(stack, path if path[0] in _AROUND else ["settings", *path], value)
    return stack


def _leaves(kind: Any, prefix: str) -> Iterator[Parameter]:
    for field, hint in get_type_hints(kind, include_extras=True).items():
        plain = get_args(hint)[0] if get_origin(hint) is Annotated else hint
        if plain is Schedule:
            yield Parameter(prefix + field, 0.0, 1.0)
            yield from _leaves(plain, f"{prefix}{field}.")
        elif plain is float:
            yield Parameter(prefix + field, *_bounds(hint))


def _bounds(hint: Any) -> tuple[float, float]:
    """Bounds written as `Annotated[float, Field(ge=0, le=1)]`."""
    stated = [bound for each in get_args(hint)[1:] for bound in getattr(each, "metadata", (each,))]
    low = [getattr(bound, name, None) for bound in stated for name in ("ge", "gt")]
    high = [getattr(bound, name, None) for bound in stated for name in ("le", "lt")]
    return (
        max((float(each) for each in low if each is not None), default=-np.inf),
        min((float(each) for each in high if each is not None), default=np.inf),
    )


def _reached(stack: Stack, name: str) -> Any:
    path = name.split(".")
    found: Any = stack if path[0] in _AROUND else stack.settings
    for part in path:
        found = getattr(found, part)
    return found


def _replaced(part: Any, path: list[str], value: float) -> Any:
    if path:
        field = path[0]
        return part._replace(**{field: _replaced(getattr(part, field), path[1:], value)})
    return part._replace(start=value, end=value) if isinstance(part, Schedule) else float(value)
