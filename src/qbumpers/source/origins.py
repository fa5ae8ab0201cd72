"""Where a module comes from: Python, this package, an installed one, or the user."""

import functools
import importlib.metadata
import site
import sys
import sysconfig
import types
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_THIS_PACKAGE = __name__.partition(".")[0]


class Home(NamedTuple):
    """Where a module comes from.

    Attributes:
        kind: "python", "package" (this one), "installed" or "own", the user's.
        versions: of the distributions that an installed one belongs to, by name.
    """

    kind: str
    versions: Mapping[str, str] = {}


@functools.cache
def home_of(name: str) -> Home:
    """Where a module comes from, by its name."""
    root = name.partition(".")[0]
    if root == _THIS_PACKAGE:
        return Home("package")
    found = sys.modules.get(name) or sys.modules.get(root)
    file = getattr(found, "__file__", None)
    if file is None and root in sys.stdlib_module_names | {"builtins"}:
        return Home("python")
    if file is not None:
        path = Path(file).resolve()
        standard = (sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib"))
        installed = _is_in(path, _installed_places())
        if not installed and _is_in(path, [Path(place).resolve() for place in standard]):
            return Home("python")
        if installed or _is_in(path, _other_places(root)):
            versions = _versions(root)
            return Home("installed", versions) if versions else Home("own")
    return Home("own")


def _is_in(path: Path, places: Iterable[Path]) -> bool:
    return any(path.is_relative_to(place) for place in places)


@functools.cache
def _installed_places() -> list[Path]:
    places = [sysconfig.get_path("purelib"), sysconfig.get_path("platlib")]
    places += [*site.getsitepackages(), site.getusersitepackages()]
    return [Path(place).resolve() for place in dict.fromkeys(places)]


def _other_places(root: str) -> list[Path]:
    """Folders in which an installer put a package although Python does not name them.

    One that is edited where it lies is in none of them: its list of files is elsewhere.
    """
    distributions = [importlib.metadata.distribution(name) for name in _distributions(root)]
    installed = [each for each in distributions if each.read_text("RECORD") is not None]
    return [Path(str(each.locate_file(""))).resolve() for each in installed]


def _versions(root: str) -> dict[str, str]:
    try:
        return {root: importlib.metadata.version(root)}
    except importlib.metadata.PackageNotFoundError:
        return {name: importlib.metadata.version(name) for name in _distributions(root)}


def _distributions(root: str) -> list[str]:
    """Names of the distributions that a top-level module belongs to."""
    return sorted(set(_all_distributions(tuple(sys.path)).get(root, [])))


@functools.lru_cache(maxsize=1)
def _all_distributions(places: tuple[str, ...]) -> Mapping[str, list[str]]:
    """Of every module in those places; reading what is installed takes a third of a second."""
    return importlib.metadata.packages_distributions()


def version_of(module: str) -> dict[str, str]:
    """Versions of the installed distributions that a module comes from, by name.

    Args:
        module: name of a module that was imported.

    Returns:
        Empty if it comes from Python, from this package or from the user.
    """
    return dict(home_of(module).versions)


def known_as(module: str) -> str:
    """The name of a module; of the one that was started, the name that others import it by."""
    if module != "__main__":
        return module
    main: Any = sys.modules["__main__"]
    if getattr(main, "__spec__", None):
        return main.__spec__.name
    return Path(main.__file__).stem if getattr(main, "__file__", None) else module


def module_of(value: Any) -> str:
    """The module in which something was written, whatever a decorator says."""
    if isinstance(value, types.FunctionType):
        return str(value.__globals__.get("__name__"))
    if isinstance(value, np.ufunc):
        return _module_of_ufunc(value)
    owner = getattr(value, "__objclass__", None) or getattr(value, "__self__", None)
    if isinstance(owner, types.ModuleType):
        return owner.__name__
    return str(getattr(value, "__module__", None) or getattr(owner, "__module__", None))


def _module_of_ufunc(value: np.ufunc) -> str:
    """The installed module that has a ufunc, which does not say where it is from."""
    for name, module in list(sys.modules.items()):
        has_it = getattr(module, "__dict__", {}).get(value.__name__) is value
        if has_it and home_of(name).kind == "installed":
            return name
    return "numpy"
