"""How the package compiles its hot functions: one decorator, and a cache that notices changes.

Numba's own cache looks at the file of the function alone; a compiled loop would keep calling an old
decision rule after the rule's file had changed. Here the stamp of every cached function covers the
sources of the whole package. What cannot be kept, or was damaged, is compiled again.

With `NUMBA_DISABLE_JIT=1` nothing is compiled and everything runs as the Python that it is.
"""

import contextlib
import functools
import hashlib
import re
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import config
from numba.core.caching import FunctionCache, NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.experimental import structref
from numba.extending import register_jitable

from qbumpers.errors import RequestError
from qbumpers.kept_code import CodeFiles, KeptCodeWarning, reason

F = TypeVar("F", bound=Callable[..., Any])

_SETTINGS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
INLINE: Any = {"forceinline": True, **_SETTINGS}
"""Settings for pieces of a hot loop: their calls must vanish, with all reference counting."""


_NEVER_COMPILED = {
    "analysis", "cli", "conformance.py", "experiments", "files.py", "play", "reproduction",
    "session.py", "shared_control.py", "source", "study", "tuning",
}  # fmt: skip


@functools.cache
def source_stamp() -> str:
    """A digest of every source of this package that compiled code can come from."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        relative = path.relative_to(root)
        if relative.parts[0] not in _NEVER_COMPILED:
            digest.update(str(relative).encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


class _PackageCache(FunctionCache):
    """Numba's on-disk cache, stamped with the whole package instead of one file."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file: Any = CodeFiles(
            self._cache_path, self._impl.filename_base, source_stamp()
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Code from disk; None if there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # of any kind: what is wrong can be made anew
            _warn_once("cannot be used", f"in {self.cache_path}: {reason(error)}")
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code on disk if that is possible."""
        try:
            super().save_overload(sig, data)
        except Exception as error:
            _warn_once("cannot be kept", f"in {self.cache_path}: {reason(error)}")


class _NoCache(NullCache):
    """In place of a cache if there is no folder for one."""

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Say that nothing is kept."""
        _warn_once("cannot be kept", "no folder for it can be written")


_warned: set[str] = set()


def _warn_once(problem: str, detail: str) -> None:
    """Warn of a problem with code on disk, once in a process: there are hundreds of functions."""
    if problem not in _warned:
        _warned.add(problem)
        message = f"compiled code {problem} ({detail}); it is compiled anew, which takes seconds"
        warnings.warn(message, KeptCodeWarning, stacklevel=2)


class CompilationError(Exception):
    """A function, or what it is to be called with, is nothing that Numba compiles."""


_COLOUR_CODE = re.compile(r"\x1b\[[\d;]*m")


def shortened(error: BaseException) -> str:
    """The beginning of Numba's message in one line, without its colours."""
    lines = _COLOUR_CODE.sub("", str(error)).splitlines()[:4]
    return "; ".join(line.strip() for line in lines if line.strip())


@contextlib.contextmanager
def compiling_together(
    what: str, reason: Callable[[BaseException], str] = shortened
) -> Iterator[None]:
    """Within the block, an error of compiling says what was compiled.

    Args:
        what: for the message, for instance "assistant guide, learner q-learning".
        reason: says in words what an error of Numba means.

    Raises:
        RequestError: in place of Numba's error.
    """
    try:
        yield
    except NumbaError as error:
        raise RequestError(f"{what}: cannot be compiled together: {reason(error)}") from error


def compiles() -> bool:
    """Whether functions are compiled at all: not with `NUMBA_DISABLE_JIT=1`."""
    settings: Any = config  # which has its names when it is loaded
    return not settings.DISABLE_JIT


def is_compiled(function: Any) -> bool:
    """Whether a function is one that Numba compiles."""
    return isinstance(function, Dispatcher)


def compiled(function: F) -> F:
    """Compile a function of this package with Numba, kept on disk between processes.

    Args:
        function: a function in Numba's subset of Python.

    Returns:
        The same function; it compiles at its first call and then runs without the GIL.
    """
    return _kept(function, INLINE)


def inlined(function: F) -> F:
    """Make a function a piece of the compiled code that calls it; Python calls it as it is.

    Args:
        function: a function in Numba's subset of Python.

    Returns:
        The same function.
    """
    return register_jitable(**INLINE)(function)


def called(function: F) -> F:
    """As `inlined`, for a piece that is called in several places, or is slow to compile twice.

    Args:
        function: a function in Numba's subset of Python.

    Returns:
        The same function.
    """
    return register_jitable(forceinline=False, **_SETTINGS)(function)


def compiled_apart(function: F) -> F:
    """As `compiled`, for functions too large to be copied into each of their callers.

    Args:
        function: a function in Numba's subset of Python.

    Returns:
        The same function.
    """
    # Said outright: else a function called from a piece that is inlined would be inlined too.
    return _kept(function, {"forceinline": False, **_SETTINGS})


def _kept(function: Any, settings: dict[str, Any]) -> Any:
    dispatcher: Any = numba.njit(**settings)(function)
    if not is_compiled(dispatcher):
        return np.errstate(all="ignore")(function)  # compiled code does not warn of numbers either
    try:
        dispatcher._cache = _PackageCache(function)
    except RuntimeError:  # without a writable folder, every process compiles
        dispatcher._cache = _NoCache()
    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda kinds, named: template(map(_any_integer, kinds), named)
    return dispatcher


def _any_integer(kind: Any) -> Any:
    """Numba's type of any integer for that of a certain one.

    A call with a number written out would compile the function, and all that it calls, once more.
    """
    return numba.types.unliteral(kind) if isinstance(kind, numba.types.IntegerLiteral) else kind


def compiled_for_session(function: F) -> F:
    """Compile a function whose source may change while the process lives: nothing kept on disk.

    Args:
        function: a function in Numba's subset of Python, for instance a user's own rule.

    Returns:
        The same function, compiled at its first call.

    Raises:
        CompilationError: if it is no function but something else that can be called.
    """
    try:
        dispatcher: Any = numba.njit(**INLINE)(function)
    except TypeError as error:
        raise CompilationError(f"{function!r} is not a function") from error
    return dispatcher


@structref.register
class _HeldType(numba.types.StructRef):
    """Numba's type of `Held`."""


class Held(structref.StructRefProxy):
    """Values that compiled code is entered with again and again; `hold` makes one.

    Numba takes every argument of a call apart, which for tuples of many arrays takes microseconds.
    These were taken apart once.

    Attributes:
        content: the values; compiled code alone reads them.
    """

    def __new__(cls, content: Any) -> "Held":
        """Compiled code alone makes one."""
        return hold(content)


structref.define_boxing(_HeldType, Held)
structref.define_constructor(Held, _HeldType, ["content"])
structref.define_attributes(_HeldType)


@compiled_apart
def hold(content: Any) -> Held:
    """Take values apart for compiled code.

    Args:
        content: of a type that compiled code has; its arrays stay the same arrays.
    """
    return Held(content)


def entered(function: Any, *examples: Any) -> Any:
    """Compiled code for arguments of known types, entered without looking them up at every call.

    The look-up takes microseconds if arguments are tuples. Nothing checks the types any more.

    Args:
        function: compiled; one that is not is returned as it is.
        *examples: one for each argument; later arguments must be of the same types, arrays of the
            same kind and number of dimensions.

    Returns:
        A function of the same arguments.
    """
    if not hasattr(function, "compile"):
        return function
    return function.compile(tuple(map(numba.typeof, examples)))


def uncompiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """The Python source of a function, to be called if compiled code is no faster.

    Handing a few numbers over to compiled code and back takes longer than working them out.

    Args:
        function: compiled or not.

    Returns:
        The function as it was written.
    """
    return getattr(function, "py_func", function)


def compilation_settings(function: Any) -> dict[str, Any] | None:
    """The settings of Numba that a function was compiled with; None if it was not."""
    return function.targetoptions if is_compiled(function) else None


def compiled_with(function: F, settings: dict[str, Any]) -> F:
    """Compile a function with settings from `compilation_settings`, nothing kept on disk."""
    return numba.jit(**settings)(function)  # type: ignore[no-any-return]


def type_of(value: Any) -> Any:
    """The type that compiled code has for a value."""
    return numba.typeof(value)


def result_type(function: Any, *types: Any) -> Any:
    """Compile a function for arguments of some types, without calling it.

    Args:
        function: from `compiled_for_session`.
        *types: one per argument, see `type_of`.

    Returns:
        The type of what it returns.

    Raises:
        CompilationError: if it cannot be compiled.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of what Numba itself does
        try:
            function.compile(types)
        except Exception as error:  # Numba raises much beside its own kind of errors
            raise CompilationError(str(error)) from error
    # A constant has a type of its own, which is also that of other whole numbers.
    return numba.types.unliteral(function.overloads[types].signature.return_type)


def is_of_package(function: Any) -> bool:
    """Whether a function is of this package, whose compiled code is kept on disk."""
    return str(function.__module__).startswith("qbumpers.")
