"""What registering rules and registering learners have in common: their NamedTuples of settings.

Compiled loops choose a function by the type of its settings when they are compiled, so every
registration has a class of its own. Compiled code knows numbers, tuples and arrays: texts and files
among the settings reach it as such.
"""

import contextlib
import inspect
import itertools
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from qbumpers.compilation import (
    CompilationError,
    compiled_for_session,
    compiles,
    is_compiled,
    shortened,
    uncompiled,
)
from qbumpers.errors import RequestError

_registrations = itertools.count()
_originals: dict[type, type] = {}

_FILE = "a file of numbers"

_nothing: Mapping[str, np.ndarray] = MappingProxyType({})
_kept: ContextVar[Mapping[str, np.ndarray]] = ContextVar("kept", default=_nothing)

File = Annotated[str, _FILE]
"""A setting that names a file of numbers, `.npy` or `.csv`; functions get a float64 array."""


def checked_class(kind: Any, where: str) -> type:
    """A class of settings, if it is a NamedTuple with types that can be looked up.

    Raises:
        RequestError: if it is not.
    """
    if not (isinstance(kind, type) and hasattr(kind, "_fields")):
        raise RequestError(f"{where} is {kind!r}; a NamedTuple class is needed")
    try:
        hints = get_type_hints(kind, include_extras=True)
    except Exception as error:  # whatever looking up a written name comes to
        raise RequestError(f"{where}: the types of its fields cannot be found: {error}") from error
    if any(kind.__annotations__.get(field, hint) is not hint for field, hint in hints.items()):
        kind.__annotations__ = hints  # written as texts, they would mean nothing elsewhere
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
    return part is None or str(part.__module__).partition(".")[0] == __name__.partition(".")[0]


def check_arguments(function: Any, arguments: Sequence[str], where: str) -> None:
    """Check that something can be called as it will be.

    Args:
        function: of the user's own, compiled or not.
        arguments: what it will be given, by position.
        where: for messages, for instance "rule 'guide': observe".

    Raises:
        RequestError: if it cannot.
    """
    given = f"({', '.join(arguments)})"
    if not callable(function):
        raise RequestError(f"{where} is {function!r}; a function of {given} is needed")
    try:
        signature = inspect.signature(uncompiled(function))
    except (TypeError, ValueError):  # of functions in C that do not tell
        return
    try:
        signature.bind(*arguments)
    except TypeError as error:
        raise RequestError(f"{where} takes {signature}; it is called with {given}") from error


def compiled_or_plain(
    what: str, functions: tuple[Any, ...], attempts: Mapping[str, Callable[..., None]]
) -> tuple[tuple[Any, ...], frozenset[str]]:
    """Functions of the user's own, compiled if that is possible, else as they are with a warning.

    Args:
        what: they belong to, for instance "assistant 'guide'".
        functions: of Python or compiled; None is left as it is.
        attempts: by what they are compiled for, for instance "states"; each is called with the
            functions and raises CompilationError if it fails. One that succeeds is enough.

    Returns:
        The functions, and what they compile for: nothing if they are plain Python.
    """
    if not compiles():
        return functions, frozenset()
    try:
        return _compiled(functions, attempts)
    except CompilationError as error:
        reason = shortened(error)
    warnings.warn(
        f"{what} cannot be compiled and will run as plain Python, slower: {reason}", stacklevel=4
    )
    return functions, frozenset()


def _compiled(
    functions: tuple[Any, ...], attempts: Mapping[str, Callable[..., None]]
) -> tuple[tuple[Any, ...], frozenset[str]]:
    session = tuple(
        f if f is None or is_compiled(f) else compiled_for_session(f) for f in functions
    )
    errors = []
    for kind, attempt in attempts.items():
        try:
            attempt(*session)
            return session, frozenset({kind})
        except CompilationError as error:
            errors.append(error)
    raise errors[0]


def sample(kind: Any, nested: Any = None) -> Any:
    """An instance of a class of settings, with a value of the right type in each field.

    Args:
        kind: the class; bounds are not looked at.
        nested: what stands for the settings of something else, a field `of`.

    Raises:
        CompilationError: if compiled code does not take settings of a type.
    """
    defaults = kind._field_defaults
    hints = get_type_hints(kind, include_extras=True)
    return kind._make(
        nested
        if field == "of" and nested is not None
        else _sample_of(hints.get(field), defaults.get(field))
        for field in kind._fields
    )


def _sample_of(hint: Any, default: Any) -> Any:
    if _is_file(hint):
        return np.zeros((0, 0))
    plain = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    if get_origin(plain) is Literal:
        return 0
    if get_origin(plain) is tuple:
        parts = [part for part in get_args(plain) if part is not Ellipsis]
        return default or tuple(_sample_of(part, None) for part in parts)
    if hasattr(plain, "_fields"):
        return sample(plain)
    if hint is None:  # a NamedTuple without types
        return default if isinstance(default, int | float) else 0.0
    numbers = {float: 0.0, int: 0, bool: False}
    if plain not in numbers:
        kind = inspect.formatannotation(plain)
        raise CompilationError(f"compiled code takes no settings of the type {kind}")
    return numbers[plain]


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
    return get_args(plain).index(value) if get_origin(plain) is Literal else value


def _is_file(hint: Any) -> bool:
    return get_origin(hint) is Annotated and _FILE in get_args(hint)


def _numbers_in(name: str, field: str) -> np.ndarray:
    """Float64 [N, K], the numbers in a file."""
    if name in _kept.get():
        return _kept.get()[name]
    try:
        found = np.load(name) if Path(name).suffix == ".npy" else _numbers_between_commas(name)
        numbers = np.ascontiguousarray(np.atleast_2d(found), np.float64)
    except (OSError, ValueError, EOFError, TypeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RequestError(
            f"{field} = {name!r}: not a .npy or .csv file of numbers ({reason})"
        ) from error
    if not np.isfinite(numbers).all():
        raise RequestError(f"{field} = {name!r}: every number in it must be finite")
    return numbers


def _numbers_between_commas(name: str) -> np.ndarray:
    lines = Path(name).read_text(encoding="utf-8-sig").splitlines()  # spreadsheets write a mark
    if not any(lines):
        raise ValueError("it is empty")
    return np.loadtxt(lines, delimiter=",")
