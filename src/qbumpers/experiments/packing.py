"""What the cells of an experiment share, packed into bytes for another process."""

import pickle
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import cloudpickle
import numba
from numba.core.dispatcher import Dispatcher

from qbumpers.assistants import register_assistant
from qbumpers.assistants.registry import Rule
from qbumpers.compilation import uncompiled
from qbumpers.experiments.plan import Plan
from qbumpers.simulation import Condition


class Shared(NamedTuple):
    """What all cells of an experiment need.

    Attributes:
        conditions: by their content.
        seed: of the experiment.
    """

    conditions: dict[str, Condition]
    seed: int


class _Function(NamedTuple):
    """A user's function, and the settings of Numba that it was compiled with, if it was."""

    source: Callable[..., Any]
    settings: dict[str, Any] | None


class _Registration(NamedTuple):
    """What `register_assistant` was told about a user's rule; None for what it has not."""

    name: str
    options_type: type
    decide: _Function
    start: _Function | None
    observe: _Function | None
    check_start: Callable[[Any, float], None] | None


def packed(plan: Plan) -> bytes:
    """Pack what all cells share, users' own rules included.

    Args:
        plan: the experiment.

    Returns:
        Bytes for `unpacked`, in a process that has this package; modules of users' rules need not
        be there.
    """
    rules = {c.assistant.name: c.assistant.rule for c in plan.conditions.values()}
    own = [_registration(rule) for rule in rules.values() if not rule.built_in]
    modules = {module for each in own for module in _modules(each)}
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        # Conditions name their rules, so they are unpacked when those are registered.
        return cloudpickle.dumps((own, pickle.dumps(plan.conditions), plan.experiment.seed))
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)


def unpacked(content: bytes) -> Shared:
    """Unpack what all cells share; registers users' own rules in this process.

    Args:
        content: from `packed`.

    Returns:
        What was packed.
    """
    own, conditions, seed = pickle.loads(content)
    for each in own:
        register_assistant(
            each.name,
            each.options_type,
            start=_rebuilt(each.start),
            observe=_rebuilt(each.observe),
            check_start=each.check_start,
        )(_rebuilt(each.decide))
    return Shared(pickle.loads(conditions), seed)


def _registration(rule: Rule) -> _Registration:
    options_type = rule.options_type.__base__  # registering had made a fresh class of it
    assert options_type is not None
    return _Registration(
        rule.name,
        options_type,
        _taken_apart(rule.decide),
        rule.start and _taken_apart(rule.start),
        rule.observe and _taken_apart(rule.observe),
        rule.check_start,
    )


def _taken_apart(function: Callable[..., Any]) -> _Function:
    settings = function.targetoptions if isinstance(function, Dispatcher) else None
    return _Function(uncompiled(function), settings)


def _rebuilt(function: _Function | None) -> Any:
    if function is None or function.settings is None:
        return function and function.source
    return numba.jit(**function.settings)(function.source)


def _modules(own: _Registration) -> list[Any]:
    """Modules that a user's rule comes from, but for that of a script or notebook."""
    sources = [f.source for f in (own.decide, own.start, own.observe) if f is not None]
    names = {part.__module__ for part in (own.options_type, own.check_start, *sources) if part}
    return [
        sys.modules[name] for name in sorted(names) if name in sys.modules and name != "__main__"
    ]
