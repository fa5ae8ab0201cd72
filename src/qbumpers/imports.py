"""Modules that register environments, tasks, rules and learners of others, imported by name."""

import contextlib
import importlib
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from qbumpers.errors import RequestError

_imported: dict[str, None] = {}


def module_and_name(name: str) -> tuple[str, str]:
    """A name as Gymnasium takes it, for instance "minigrid:MiniGrid-Empty-5x5-v0", in its parts.

    Returns:
        The module that is to be imported first, empty if none is named, and the name itself.
    """
    module, colon, rest = name.partition(":")
    return (module, rest) if colon else ("", name)


def imported() -> list[str]:
    """Names of the modules that were imported here, in the order in which they were."""
    return list(_imported)


def import_modules(names: Iterable[str], where: str) -> None:
    """Import modules, so that what they register can be named.

    As with `python -m`, they may be in the current directory.

    Args:
        names: of modules, for instance "minigrid" or "my_tasks".
        where: for messages, for instance "imports".

    Raises:
        RequestError: naming the first that cannot be imported.
    """
    for name in names:
        parts = str(name).split(".")
        if not all(part.isidentifier() for part in parts) or parts[-1] == "py":
            ending = "; leave .py out" if parts[-1] == "py" else ""
            raise RequestError(
                f"{where}: {name!r} is no name of a module, such as 'minigrid' or 'my_tasks'"
                f"{ending}"
            )
        with found_in([Path.cwd()]):
            _import(name, where)
        _imported[name] = None


def _import(name: str, where: str) -> None:
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise RequestError(
                f"{where}: module {name!r} needs module {error.name!r}, which is not installed"
            ) from error
        raise RequestError(
            f"{where}: there is no module {name!r}; install the package that has it, or put "
            f"{name.partition('.')[0]}.py into the current directory or beside the experiment file"
        ) from error
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise RequestError(
            f"{where}: module {name!r} fails while it is imported: {reason}"
        ) from error


@contextlib.contextmanager
def found_in(folders: Iterable[Path]) -> Iterator[None]:
    """Within the block, modules are looked for in these folders first; later, there at last.

    Args:
        folders: the first of them comes first.
    """
    resolved = dict.fromkeys(str(folder.resolve()) for folder in folders)
    places = [place for place in resolved if place not in sys.path]
    sys.path[:0] = places
    importlib.invalidate_caches()
    try:
        yield
    finally:
        for place in places:
            sys.path.remove(place)
        # What a module imports when it is first needed may be beside it.
        sys.path += places
