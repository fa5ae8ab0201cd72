"""Which assistants a participant can choose, and with which options."""

from collections.abc import Iterator
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from qbumpers.assistants import assistants
from qbumpers.assistants.registry import Options, Rule
from qbumpers.play.setup import Setup
from qbumpers.values.exact import SOLVED_ROWS

_STARTS = {"alpha": 0.5}
"""Of options without a default, where a form begins."""


def offers(setup: Setup) -> list[dict[str, Any]]:
    """The assistants that suit a task and whose options a form can ask for, JSON-like.

    Args:
        setup: what is played.

    Returns:
        Of each: its `name`; `summary`, what it does in a sentence; and `options`, see `_field`.
    """
    suitable = {
        name: rule
        for name, rule in assistants().items()
        if name != "none" and all(setup.has[need] for need in rule.needs) and _has(setup, rule)
    }
    alone = [name for name, rule in suitable.items() if not rule.over_a_rule and _eases(rule)]
    found: list[dict[str, Any]] = []
    for name, rule in suitable.items():
        fields = list(_fields(rule, alone))
        if all(field["kind"] != "other" or not field["needed"] for field in fields):
            shown = [field for field in fields if field["kind"] != "other"]
            summary = " ".join((rule.decide.__doc__ or "").strip().partition("\n\n")[0].split())
            found.append({"name": name, "summary": summary, "options": shown})
    return found


def _has(setup: Setup, rule: Rule) -> bool:
    """Whether there are the further values that a rule reads."""
    solved = "exact" in setup.task.value_sources
    announced = {"safety": "crash", "success": "success"}
    return all(
        solved
        and row in SOLVED_ROWS
        and (row not in announced or announced[row] in setup.task.events)
        for row in rule.values
    )


def _eases(rule: Rule) -> bool:
    """Whether a rule can be named without any options."""
    kind: Any = rule.options_type
    return set(kind._fields) == set(kind._field_defaults)


def _fields(rule: Rule, alone: list[str]) -> Iterator[dict[str, Any]]:
    kind: Any = rule.options_type
    hints = get_type_hints(kind, include_extras=True)
    for field in kind._fields:
        needed = field not in kind._field_defaults
        default = kind._field_defaults.get(field)
        if hints[field] == Options:
            known = {"kind": "choice", "choices": alone, "default": "maximal"}
        else:
            known = _field(TypeAdapter(hints[field]).json_schema(), field, needed, default)
        yield {"name": field, "needed": needed, **known}


def _field(schema: dict[str, Any], name: str, needed: bool, default: Any) -> dict[str, Any]:
    """How a form asks for an option.

    Returns:
        Its `kind`: "number" (with `least`, `most` and whether it is `whole`), "flag", "choice" (of
        `choices`) or "other", which no form can ask for; and its `default`, null for none.
    """
    kinds: list[dict[str, Any]] = schema.get("anyOf", [schema])
    given = [each for each in kinds if each.get("type") != "null"]
    found: dict[str, Any] = given[0] if len(given) == 1 else {}
    if "enum" in found:
        start = found["enum"][0] if needed else default
        return {"kind": "choice", "choices": found["enum"], "default": start}
    if found.get("type") == "boolean":
        return {"kind": "flag", "default": bool(default)}
    if found.get("type") not in ("number", "integer"):
        return {"kind": "other", "default": None}
    least: float | None = found.get("minimum", found.get("exclusiveMinimum"))
    most: float | None = found.get("maximum", found.get("exclusiveMaximum"))
    is_whole = bool(found["type"] == "integer")
    return {
        "kind": "number",
        "whole": is_whole,
        "least": least,
        "most": most,
        "default": _start(name, least, most, is_whole) if needed else default,
    }


def _start(name: str, least: float | None, most: float | None, whole: bool) -> float:
    """Where a form begins: in the middle of a range, else a little above its lower end."""
    if name in _STARTS:
        return _STARTS[name]
    if least is not None and most is not None:
        middle = (least + most) / 2
        return int(middle) if whole else middle
    return 5 if least is None else least + 5
