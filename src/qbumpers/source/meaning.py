"""Following code of the user's own to everything that it refers to."""

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import json
import sys
import types
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from qbumpers.compilation import compilation_settings, uncompiled
from qbumpers.source.origins import Home, home_of, known_as, module_of
from qbumpers.source.references import global_names, imports_of
from qbumpers.source.syntax import bare, syntax_of

_PLAIN = (bool, int, float, complex, str, type(None), type(Ellipsis))
_COMPILED_ELSEWHERE = (
    types.BuiltinFunctionType, types.MethodDescriptorType, types.WrapperDescriptorType, np.ufunc,
)  # fmt: skip
_CACHED = type(functools.cache(len))


class Meaning(NamedTuple):
    """What some code means.

    Attributes:
        code: digests of the functions, classes and constants of the user's own, by name.
        packages: versions of the installed packages that they refer to, by name.
        of_package: names of the modules of this package that they refer to.
        modules: names of the modules of the user's own.
        unknown: what cannot be known, a phrase each; empty if all is known.
    """

    code: dict[str, str]
    packages: dict[str, str]
    of_package: frozenset[str]
    modules: frozenset[str]
    unknown: tuple[str, ...]


def meaning_of(things: Mapping[str, Any]) -> Meaning:
    """What functions, classes, objects and modules mean, with all that they refer to.

    Args:
        things: any, data and tuples of several too, by the name that they have in `Meaning.code`.

    Returns:
        The same for the same code and data, in every process and wherever its files are.
    """
    reader = _Reader()
    reader.read(things)
    return Meaning(
        dict(sorted(reader.code.items())),
        dict(sorted(reader.packages.items())),
        frozenset(reader.of_package),
        frozenset(reader.modules),
        tuple(dict.fromkeys(reader.unknown)),
    )


class _Reader:
    """Follows references, breadth first; what it has come across is in its attributes."""

    def __init__(self) -> None:
        self.code: dict[str, str] = {}
        self.packages: dict[str, str] = {}
        self.of_package: set[str] = set()
        self.modules: set[str] = set()
        self.unknown: list[str] = []
        self._names: dict[int, str] = {}
        self._waiting: list[tuple[str, Any]] = []
        self._seen: dict[int, int] = {}  # objects within the part that is described
        self._alive: list[Any] = []  # so that no two objects get the same id

    def read(self, things: Mapping[str, Any]) -> None:
        """Describe things, and all that they lead to."""
        for name, thing in things.items():
            self.code[name] = _digest(self._value(thing, name))
        while self._waiting:
            name, thing = self._waiting.pop(0)
            self._seen = {}
            describe = self._class if isinstance(thing, type) else self._function
            self.code[name] = _digest(describe(thing, name))

    def _value(self, value: Any, where: str) -> Any:
        """A description of anything, JSON-like."""
        self._alive.append(value)
        if type(value) in _PLAIN:
            return [type(value).__name__, repr(value)]
        if type(value) in (bytes, bytearray):
            return ["bytes", hashlib.sha256(value).hexdigest()]
        if isinstance(value, types.ModuleType):
            return self._module(value)
        if isinstance(value, np.ndarray | np.generic) and not value.dtype.hasobject:
            content = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
            return ["array", value.dtype.str, list(value.shape), content]
        if type(value) is tuple:
            return ["tuple", *(self._value(each, where) for each in value)]
        if _is_named(value):
            return self._named(value, where)
        if id(value) in self._seen:
            return ["again", self._seen[id(value)]]
        self._seen[id(value)] = len(self._seen)
        return self._object(value, where)

    def _object(self, value: Any, where: str) -> Any:
        """A description of a collection, or of any other object by what pickling takes of it."""
        if type(value) is list:
            return ["list", *(self._value(each, where) for each in value)]
        if type(value) is dict:
            return ["dict", *([self._value(part, where) for part in i] for i in value.items())]
        if isinstance(value, types.MappingProxyType):
            return self._object(dict(value), where)
        if isinstance(value, set | frozenset):
            return ["set", *sorted(json.dumps(self._value(each, where)) for each in value)]
        if hasattr(value, "__wrapped__"):
            return ["wrapped", self._value(value.__wrapped__, where)]
        try:
            reduced = value.__reduce_ex__(2)
        except Exception:  # each type has reasons of its own
            self.unknown.append(f"what {where} holds, a {type(value).__name__}, cannot be read")
            return "unknown"
        if isinstance(reduced, str):
            return ["global", self._value(type(value), where), reduced]
        parts = [list(part) if isinstance(part, Iterator) else part for part in reduced]
        return ["object", *(self._value(part, where) for part in parts)]

    def _named(self, value: Any, where: str) -> Any:
        """A reference to a function or class; those of the user's own are described later."""
        if isinstance(value, types.MethodType):
            bound = (value.__func__, value.__self__)
            return ["method", *(self._value(each, where) for each in bound)]
        written = uncompiled(value)
        module, name = module_of(written), getattr(written, "__qualname__", repr(written))
        home = home_of(module)
        if home.kind != "own":
            self._note(module, home)
            return [f"{module}.{name}", *self._captured(written, where)]
        if isinstance(written, _COMPILED_ELSEWHERE):
            self.unknown.append(f"{module}.{name} is compiled code, which cannot be read")
            return "unknown"
        self.modules.add(module)
        if id(value) not in self._names:
            self._names[id(value)] = self._fresh(f"{known_as(module)}.{name}")
            self._waiting.append((self._names[id(value)], value))
        return self._names[id(value)]

    def _captured(self, function: Any, where: str) -> list[Any]:
        """What an installed decorator made holds of what it decorated."""
        cells = getattr(function, "__closure__", None) or ()
        found = [self._value(cell.cell_contents, where) for cell in cells if _is_filled(cell)]
        if "__wrapped__" in getattr(function, "__dict__", {}):
            found.append(self._value(function.__wrapped__, where))
        return found

    def _fresh(self, name: str) -> str:
        """A name that nothing else has: functions that one function made share theirs."""
        taken, number = {*self.code, *self._names.values()}, 2
        free = name
        while free in taken:
            free, number = f"{name}#{number}", number + 1
        return free

    def _note(self, module: str, home: Home) -> None:
        self.packages.update(home.versions)
        if home.kind == "package":
            self.of_package.add(module)

    def _module(self, module: types.ModuleType) -> Any:
        """A module that is passed on as a whole."""
        home = home_of(module.__name__)
        if home.kind != "own":
            self._note(module.__name__, home)
            return module.__name__
        if module.__name__ not in self.modules or id(module) not in self._names:
            self.modules.add(module.__name__)
            self._names[id(module)] = known_as(module.__name__)
            names = [name for name in vars(module) if not name.startswith("__")]
            self._references([(name, []) for name in names], vars(module), module.__name__)
        return ["module", self._names[id(module)]]

    def _function(self, function: Any, name: str) -> Any:
        """A function of the user's own: its source, and what it refers to."""
        written = uncompiled(function)
        code = getattr(written, "__code__", None)
        if code is None:
            self.unknown.append(f"{name} is compiled code, which cannot be read")
            return "unknown"
        namespace = written.__globals__
        closure = dict(zip(code.co_freevars, written.__closure__ or (), strict=True))
        held = {
            "defaults": [written.__defaults__, written.__kwdefaults__],
            "settings": compilation_settings(function),
            "attributes": {f: v for f, v in vars(written).items() if f != "__wrapped__"},
            "wrapped": getattr(written, "__wrapped__", None),
            "closure": {f: c.cell_contents for f, c in closure.items() if _is_filled(c)},
        }
        return {
            "source": self._source(code, name, namespace),
            "names": self._refers(code, namespace, module_of(written)),
            **{part: self._value(value, name) for part, value in held.items()},
        }

    def _class(self, kind: type, name: str) -> Any:
        """A class of the user's own: its source, and what it refers to."""
        module = sys.modules.get(kind.__module__)
        namespace = vars(module) if module else {}
        own = [
            each
            for each in map(_plain_function, vars(kind).values())
            # What a decorator of the class made comes from elsewhere, or from no file.
            if each and each.__globals__ is namespace and each.__code__.co_filename != "<string>"
        ]
        file = getattr(module, "__file__", None) or next(
            (each.__code__.co_filename for each in own), "<unknown>"
        )
        syntax = syntax_of(file, namespace)
        bases = [self._value(b, name) for b in (*kind.__bases__, type(kind)) if b is not object]
        data = {f: v for f, v in vars(kind).items() if not f.startswith("__") and _is_data(v)}
        found: dict[str, Any] = {"bases": bases, "data": self._value(data, name)}
        bodies = [] if syntax is None else syntax.classes(kind.__qualname__)
        if syntax is None or not bodies:
            return {**found, **self._without_source(kind, name)}
        for function in own:
            self._source(function.__code__, name, namespace)
            found[function.__name__] = self._captured(function, name)
        found["source"] = [node for node, _ in bodies]
        found["names"] = [self._refers(code, namespace, kind.__module__) for _, code in bodies]
        return found

    def _without_source(self, kind: type, name: str) -> dict[str, Any]:
        """A class that no `class` statement made: a NamedTuple made by a call is its fields."""
        fields = getattr(kind, "_fields", None)
        if fields is None:
            self.unknown.append(f"there is no source of {name}")
            return {}
        types_of_fields = getattr(kind, "__annotations__", {})
        return {"fields": list(fields), "types": self._value(types_of_fields, name)}

    def _source(self, code: types.CodeType, name: str, namespace: Mapping[str, Any]) -> Any:
        """The syntax of a function, if it is what runs."""
        syntax = syntax_of(code.co_filename, namespace)
        known = [] if syntax is None else syntax.functions(code.co_qualname)
        if syntax is None or not known:
            self.unknown.append(f"there is no source of {name}")
            return "unknown"
        same = [node for node, compiled in known if bare(compiled) == bare(code)]
        if not same:
            self.unknown.append(f"the source of {name} is not what runs: it was edited since")
        return same

    def _refers(self, code: types.CodeType, namespace: Mapping[str, Any], module: str) -> Any:
        """What the names in code stand for."""
        for imported, names in imports_of(code):
            try:
                package = namespace.get("__package__") or ""
                self._import(importlib.util.resolve_name(imported, package), names)
            except ImportError:
                self.unknown.append(f"{module} imports {imported}, which is not there")
        return self._references(global_names(code), namespace, module)

    def _import(self, name: str, names: list[str]) -> None:
        module = importlib.import_module(name)
        for each in names:
            if not hasattr(module, each):
                with contextlib.suppress(ImportError):
                    importlib.import_module(f"{name}.{each}")
        if names:
            self._references([(each, []) for each in names], vars(module), name)
        else:
            self._value(module, name)

    def _references(
        self, chains: list[tuple[str, list[str]]], namespace: Mapping[str, Any], module: str
    ) -> dict[str, Any]:
        found = {}
        for root, attributes in chains:
            if root in namespace and not root.startswith("__"):
                path = ".".join([root, *attributes])
                found[path] = self._reference(namespace[root], root, attributes, module)
        return dict(sorted(found.items()))

    def _reference(self, value: Any, path: str, attributes: list[str], module: str) -> Any:
        """What a global name, or an attribute of a module, stands for."""
        for attribute in attributes:
            if not isinstance(value, types.ModuleType):
                break
            home = home_of(value.__name__)
            if home.kind != "own":
                self._note(value.__name__, home)
                return [value.__name__, *attributes]
            if not hasattr(value, attribute):
                break
            self.modules.add(value.__name__)
            module, path, value = value.__name__, attribute, getattr(value, attribute)
        named = isinstance(value, types.ModuleType | _CACHED) or _is_named(value)
        if named or type(value).__module__ == "typing":
            return self._value(value, f"{module}.{path}")
        return self._constant(value, f"{known_as(module)}.{path}")

    def _constant(self, value: Any, name: str) -> str:
        """A global constant, which has a part of its own."""
        if name not in self.code:
            self.code[name] = ""  # it may lead back to itself
            before, self._seen = self._seen, {}
            self.code[name] = _digest(self._value(value, name))
            self._seen = before
        return name


def _is_named(value: Any) -> bool:
    """Whether something is a function or class, which has a source of its own."""
    if isinstance(value, types.BuiltinFunctionType) and value.__self__ is not None:
        return isinstance(value.__self__, types.ModuleType | type)
    kinds = (types.FunctionType, types.MethodType, type, *_COMPILED_ELSEWHERE)
    return isinstance(uncompiled(value), kinds)


def _is_data(value: Any) -> bool:
    kinds = (*_PLAIN, bytes, tuple, list, dict, set, frozenset, np.ndarray, np.generic)
    return isinstance(value, kinds)


def _is_filled(cell: Any) -> bool:
    try:
        _ = cell.cell_contents
    except ValueError:  # it is filled later
        return False
    return True


def _plain_function(member: Any) -> types.FunctionType | None:
    """The function in a member of a class, if there is one."""
    for attribute in ("fget", "func", "__func__"):
        member = getattr(member, attribute, member)
    member = uncompiled(member)
    return member if isinstance(member, types.FunctionType) else None


def _digest(described: Any) -> str:
    content = json.dumps(described, sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:16]
