"""Users' own rules and learners on their way to other processes, which register them there.

A condition is pickled with what it needs of them, so that pools of processes and clusters can take
conditions as they are.
"""

import functools
import pickle
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from qbumpers.assistants import assistants, register_assistant
from qbumpers.assistants.registry import Rule
from qbumpers.compilation import compilation_settings, compiled_with, uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import LearnerType, learners, register_learner
from qbumpers.registration import original_class
from qbumpers.simulation.by_value import dumped
from qbumpers.simulation.sending import Registered, cannot_be_sent
from qbumpers.source import Meaning, meaning_of


class _Function(NamedTuple):
    """A user's function, and the settings that it was compiled with, if it was."""

    source: Callable[..., Any]
    settings: dict[str, Any] | None


class _Registration(NamedTuple):
    """What `register_assistant` or `register_learner` was given.

    Attributes:
        settings_type: options of a rule, settings of a learner.
        functions: by parameter; None if it was not given. The rule itself is `decide`.
        others: further arguments, by parameter.
    """

    settings_type: type
    functions: dict[str, _Function | None]
    others: dict[str, Any]


class Own:
    """Users' own rules and learners, packed; unpickling it registers them in that process.

    Args:
        rules: any; those of this package are left out.
        kinds: registered kinds of learners, likewise.
    """

    def __init__(self, rules: Iterable[Rule], kinds: Iterable[LearnerType]) -> None:
        own = [each for each in (*rules, *kinds) if not each.built_in]
        # Rules over rules come first and are registered last: they are compiled with others inside.
        self.packed = tuple(
            # What a rule refers to may have changed since it was packed before.
            (type(each) is Rule, each.name, _packed(each, tuple(_meaning(each).code.items())))
            for each in own[::-1]
        )

    def __reduce__(self) -> Any:
        return _register_all, (self.packed,)


def packed(conditions: Mapping[str, Any]) -> bytes:
    """Pack conditions for a process that need not have the modules of what they name.

    Rules, learners, tasks and environments from outside this package are registered there.

    Args:
        conditions: `qbumpers.simulation.Condition`s, by any name.

    Returns:
        Bytes, which `pickle.loads` unpacks in a process that has this package.

    Raises:
        RequestError: naming what cannot be pickled.
    """
    own = [
        each
        for condition in conditions.values()
        for each in (*condition.assistant.chain, condition.learner_type)
        if not each.built_in
    ]
    tasks = {f"task {each.task.name}": each.task.code for each in conditions.values()}
    code = {f"{type(each).__name__} {each.name}": each.parts for each in own} | tasks
    sent = _Sent(Registered(), dict(conditions))
    try:
        return dumped(sent, meaning_of(code).modules, map(_home, _parts(own)))
    except RequestError:
        raise
    except Exception as error:  # each type has reasons of its own
        raise cannot_be_sent(" or ".join(tasks), error) from error


class _Sent(NamedTuple):
    """Conditions, and what is to be registered before they are unpickled."""

    registered: Registered
    conditions: dict[str, Any]

    def __reduce__(self) -> Any:
        return _conditions_of, tuple(self)


def _conditions_of(registered: None, conditions: dict[str, Any]) -> dict[str, Any]:
    return conditions


@functools.lru_cache(maxsize=256)
def _packed(registered: Rule | LearnerType, code: tuple[tuple[str, str], ...]) -> bytes:
    home = map(_home, _parts([registered]))
    try:
        return dumped(_registration(registered), _meaning(registered).modules, home)
    except Exception as error:  # each type has reasons of its own
        kind = "assistant" if isinstance(registered, Rule) else "learner"
        raise cannot_be_sent(f"{kind} {registered.name!r}", error) from error


def _registration(registered: Rule | LearnerType) -> _Registration:
    rule = isinstance(registered, Rule)
    functions = ("decide", "start", "observe") if rule else _LEARNER_FUNCTIONS
    others = ("check_start", "needs", "values") if rule else ("observes",)
    return _Registration(
        original_class(registered.options_type if rule else registered.settings_type),
        {name: _taken_apart(getattr(registered, name)) for name in functions},
        {name: getattr(registered, name) for name in (*others, "revision")},
    )


_LEARNER_FUNCTIONS = ("start", "choose", "prefer", "policy", "learn", "begin")


def _taken_apart(function: Callable[..., Any] | None) -> _Function | None:
    if function is None:
        return None
    return _Function(uncompiled(function), compilation_settings(function))


def _rebuilt(function: _Function | None) -> Any:
    if function is None or function.settings is None:
        return function and function.source
    return compiled_with(function.source, function.settings)


_received: dict[tuple[bool, str], tuple[bytes, Any]] = {}  # what came here, and what it became


def _register_all(packed: tuple[tuple[bool, str, bytes], ...]) -> None:
    for is_rule, name, content in packed:
        known = assistants if is_rule else learners
        before, became = _received.get((is_rule, name), (b"", None))
        if before == content and known().get(name) is became:
            continue  # compiled code can go on being used
        _register(is_rule, name, pickle.loads(content))
        _received[is_rule, name] = content, known()[name]


def _register(is_rule: bool, name: str, given: _Registration) -> None:
    functions = {each: _rebuilt(function) for each, function in given.functions.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # it was said where it was registered first
        if is_rule:
            decide = functions.pop("decide")
            register_assistant(name, given.settings_type, **functions, **given.others)(decide)
        else:
            register_learner(name, given.settings_type, **functions, **given.others)


def _parts(own: Iterable[Rule | LearnerType]) -> list[Any]:
    return [part for each in own for part in each.parts if part is not None]


def _meaning(registered: Rule | LearnerType) -> Meaning:
    return meaning_of({registered.name: registered.parts})


def _home(part: Any) -> str:
    return uncompiled(part).__module__
