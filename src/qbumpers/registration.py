"""What registering rules and registering learners have in common: their NamedTuples of settings.

Compiled loops choose a function by the type of its settings when they are compiled, so every
registration has a class of its own. Compiled code knows numbers, tuples and arrays: texts and files
among the settings reach it as such.
"""

import contextlib
import itertools
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from qbumpers.compilation import CompilationError, compiled_for_session, compiles, is_compiled
from qbumpers.errors import RequestError

_registrations = itertools.count()
_originals: dict[type, type] = {}

_COLOUR_CODE = re.compile(r"\x1b\[[\d;]*m")

_FILE = "a file of numbers"

_nothing: Mapping[str, np.ndarray] = MappingProxyType({})
_kept: ContextVar[Mapping[str, np.ndarray]] = ContextVar("kept", default=_nothing)

File = Annotated[str, _FILE]
"""A setting that names a file of numbers, `.npy` or `.csv`; functions get a float64 array."""


def checked_class(kind: Any, where: str) -> type:
    """A class of settings, if it is a NamedTuple.

    Raises:
        RequestError: if it is not.
    """
    if not (isinstance(kind, type) and hasattr(kind, "_fields")):
        raise RequestError(f"{where} is {kind!r}; a NamedTuple class is needed")
    return kind


def fresh_class(kind: type, name: str, remade: Callable[[str, tuple[Any, ...]], Any]) -> type:
    """A class like `kind` that no other registration has.

    Numba tells NamedTuples apart by name, and what is registered again (an edited notebook cell)
    must not meet its old code. Instances are pickled by the name of what is registered.

    Args:
        kind: a NamedTuple class.
        name: under which it is registered.
        remade: an instance of the name and the values of the fields, called on unpickling.
    """

    def reduce(instance: tuple[Any, ...]) -> Any:
        """How pickle makes an instance again: by name, as the class there is another."""
        return remade, (name, tuple(instance))

    members = {"__slots__": (), "__reduce__": reduce}
    fresh = type(f"{kind.__name__}_{next(_registrations)}", (kind,), members)
    _originals[fresh] = kind
    return fresh


def original_class(kind: type) -> type:
    """The class that a fresh one was made of; any other class itself."""
    return _originals.get(kind, kind)


def is_written_here(part: Any) -> bool:
    """Whether a function or class is of this package; so is None, which is nobody's."""
    return part is None or part.__module__.partition(".")[0] == __name__.partition(".")[0]


def compiled_or_plain(
    what: str, functions: tuple[Any, ...], attempts: Mapping[str, Callable[..., None]]
) -> tuple[tuple[Any, ...], frozenset[str]]:
    """Functions of the user's own, compiled if that is possible, else as they are with a warning.

    Args:
        what: they belong to, for instance "assistant 'guide'".
        functions: of Python or compiled; None is left as it is.
        attempts: by what they are compiled for, for instance "states"; each is called with the
            functions and raises what Numba does. One that succeeds is enough.

    Returns:
        The functions, and what they compile for: nothing if they are plain Python.
    """
    if not compiles():
        return functions, frozenset()
    session = tuple(
        f if f is None or is_compiled(f) else compiled_for_session(f) for f in functions
    )
    reason = ""
    for kind, attempt in attempts.items():
        try:
            attempt(*session)
            return session, frozenset({kind})
        except CompilationError as error:
            reason = reason or shortened(error)
    warnings.warn(
        f"{what} cannot be compiled and will run as plain Python, slower: {reason}", stacklevel=4
    )
    return functions, frozenset()


def shortened(error: BaseException) -> str:
    """The beginning of Numba's message in one line, without its colours."""
    lines = _COLOUR_CODE.sub("", str(error)).splitlines()[:4]
    return "; ".join(line.strip() for line in lines if line.strip())


def sample(kind: Any, nested: Any = None) -> Any:
    """An instance of a class of settings, with a value of the right type in each field.

    Args:
        kind: the class; bounds are not looked at.
        nested: what stands for the settings of something else.
    """
    defaults = kind._field_defaults
    hints = get_type_hints(kind, include_extras=True)
    return kind._make(_sample_of(hints.get(f), defaults.get(f), nested) for f in kind._fields)


def _sample_of(hint: Any, default: Any, nested: Any) -> Any:
    if _is_file(hint):
        return np.zeros((0, 0))
    plain = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    if plain is Any:
        return nested
    if get_origin(plain) is Literal:
        return 0
    if get_origin(plain) is tuple:
        parts = [part for part in get_args(plain) if part is not Ellipsis]
        return default if default else tuple(_sample_of(part, None, nested) for part in parts)
    if hasattr(plain, "_fields"):
        return sample(plain, nested)
    return {float: 0.0, int: 0, bool: False}.get(plain, 0.0)


def as_numbers(settings: Any) -> Any:
    """Settings as compiled code takes them.

    Args:
        settings: a NamedTuple, checked. Of a field with fixed texts (`Literal`), the place of its
            text among them is taken; of a `File`, the numbers in it.

    Returns:
        The same NamedTuple with numbers, arrays, tuples and NamedTuples of them.

    Raises:
        RequestError: if a file cannot be read or holds anything but finite numbers.
    """
    hints = get_type_hints(type(settings), include_extras=True)
    return settings._make(
        _number_of(value, hints.get(field), field)
        for field, value in zip(settings._fields, settings, strict=True)
    )


@contextlib.contextmanager
def files_from(kept: Mapping[str, np.ndarray]) -> Iterator[None]:
    """Within the block, what is in some files is taken from here: they may have changed by now.

    Args:
        kept: float64 [N, K] by the name of the file, as settings have it.
    """
    before = _kept.set(kept)
    try:
        yield
    finally:
        _kept.reset(before)


def files_in(settings: Any, numbers: Any) -> dict[str, np.ndarray]:
    """What is in the files that settings name, by the names that they have there.

    Args:
        settings: a NamedTuple, checked.
        numbers: the same from `as_numbers`.
    """
    found: dict[str, np.ndarray] = {}
    for value, number in zip(settings, numbers, strict=True):
        if isinstance(number, np.ndarray):
            found[value] = number
        elif hasattr(value, "_fields"):
            found |= files_in(value, number)
    return found


def _number_of(value: Any, hint: Any, field: str) -> Any:
    if hasattr(value, "_fields"):
        return as_numbers(value)
    if not isinstance(value, str):
        return value
    if _is_file(hint):
        return _numbers_in(value, field)
    plain = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return get_args(plain).index(value)


def _is_file(hint: Any) -> bool:
    return get_origin(hint) is Annotated and _FILE in get_args(hint)


def _numbers_in(name: str, field: str) -> np.ndarray:
    """Float64 [N, K], the numbers in a file."""
    if name in _kept.get():
        return _kept.get()[name]
    try:
        if Path(name).suffix == ".npy":
            found = np.load(name)
        else:
            found = np.loadtxt(name, delimiter=",", encoding="utf-8-sig", ndmin=2)
        numbers = np.ascontiguousarray(np.atleast_2d(found), np.float64)
    except (OSError, ValueError, EOFError, TypeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RequestError(
            f"{field} = {name!r}: not a .npy or .csv file of numbers ({reason})"
        ) from error
    if not np.isfinite(numbers).all():
        raise RequestError(f"{field} = {name!r}: every number in it must be finite")
    return numbers
