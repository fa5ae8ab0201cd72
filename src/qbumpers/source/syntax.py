"""The syntax of functions and classes in a file, without what does not change their meaning."""

import ast
import functools
import inspect
import linecache
import types
from collections import defaultdict
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

_SKIPPED = {"ctx", "kind", "type_comment", "type_ignores", "annotation", "returns"}
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)

Found = list[tuple[Any, types.CodeType]]
"""The syntax of definitions that share a name, JSON-like, each with its compiled code."""


class Syntax(NamedTuple):
    """What a file defines, by qualified name.

    Attributes:
        definitions: functions, lambdas and classes.
    """

    definitions: dict[str, Found]

    def functions(self, name: str) -> Found:
        """Functions of a qualified name; there may be several, of which one runs."""
        return [pair for pair in self.definitions.get(name, []) if _is_function(pair[1])]

    def classes(self, name: str) -> Found:
        """Classes of a qualified name."""
        return [pair for pair in self.definitions.get(name, []) if not _is_function(pair[1])]


def syntax_of(file: str, namespace: Mapping[str, Any]) -> Syntax | None:
    """What a file defines now.

    Args:
        file: its name.
        namespace: of its module, which says where to find what is in no folder.

    Returns:
        The definitions; None if there is no such file, or it cannot be compiled.
    """
    linecache.checkcache(file)
    lines = linecache.getlines(file, dict(namespace))
    return _syntax("".join(lines), file) if lines else None


@functools.lru_cache(maxsize=64)
def _syntax(text: str, file: str) -> Syntax | None:
    try:
        tree = ast.parse(text)
        code = compile(text, file, "exec", dont_inherit=True)
    except (SyntaxError, ValueError):
        return None
    nodes: dict[int, list[Any]] = defaultdict(list)
    for node in ast.walk(tree):
        if isinstance(node, _DEFINITIONS):
            nodes[_first_line(node)].append(node)
    definitions: dict[str, Found] = defaultdict(list)
    for each in _codes(code):
        name = each.co_name
        alike = [n for n in nodes[each.co_firstlineno] if getattr(n, "name", "<lambda>") == name]
        if alike:  # several lambdas of one line are not told apart
            definitions[each.co_qualname].append(([_plain(node) for node in alike], each))
    return Syntax(dict(definitions))


def _first_line(node: Any) -> int:
    return min([node.lineno, *(each.lineno for each in getattr(node, "decorator_list", ()))])


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield constant
            yield from _codes(constant)


def _is_function(code: types.CodeType) -> bool:
    return bool(code.co_flags & inspect.CO_NEWLOCALS)  # bodies of classes lack it


def _plain(node: Any) -> Any:
    """Syntax, JSON-like: no lines, comments, docstrings, or types of a function's arguments."""
    if isinstance(node, list):
        return [_plain(each) for each in node]
    if not isinstance(node, ast.AST):
        return [type(node).__name__, repr(node)]
    fields = {f: v for f, v in ast.iter_fields(node) if v not in (None, [])}
    if isinstance(node, (*_DEFINITIONS, ast.Module)) and not isinstance(node, ast.Lambda):
        fields["body"] = _without_docstring(node.body)
    skipped = _SKIPPED - ({"annotation"} if isinstance(node, ast.AnnAssign) else set())
    return [type(node).__name__, *([f, _plain(v)] for f, v in fields.items() if f not in skipped)]


def _without_docstring(body: list[Any]) -> list[Any]:
    match body[0]:
        case ast.Expr(value=ast.Constant(value=str())):
            return body[1:]
    return body


def bare(code: types.CodeType) -> tuple[Any, ...]:
    """Compiled code without its place in a file: equal for what runs alike."""
    constants = tuple(
        bare(each) if isinstance(each, types.CodeType) else _constant(each)
        for each in code.co_consts
    )
    return (
        code.co_qualname, code.co_code, code.co_names, code.co_varnames, code.co_freevars,
        code.co_cellvars, code.co_flags, code.co_argcount, code.co_posonlyargcount,
        code.co_kwonlyargcount, code.co_exceptiontable, constants,
    )  # fmt: skip


def _constant(value: Any) -> Any:
    if isinstance(value, frozenset):
        return ["frozenset", *sorted(map(repr, value))]
    return [type(value).__name__, repr(value)]
