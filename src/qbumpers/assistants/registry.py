"""Decision rules by name: registering one, and making an assistant of a rule and its options."""

import itertools
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_type_hints

import numba
import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError

from qbumpers.compilation import compiled_for_session, uncompiled
from qbumpers.decisions import Decision, Noise, Situation, Step
from qbumpers.errors import RequestError, checked, unknown_name


@dataclass(frozen=True)
class Rule:
    """A decision rule as registered.

    Attributes:
        name: how users name it.
        decide: `(situation, noise, options) -> Decision`, with `memory` as a fourth argument where
            the rule has one.
        options_type: the NamedTuple of its options; it also selects the rule in compiled code.
        start: `(options) -> memory` for a rule that remembers, else None.
        observe: `(memory, step, options) -> memory` for a rule that remembers, else None.
        check_start: `(options, start_value)`, raises ValueError where an episode of that V*(s_0)
            does not suit the options.
        compiled: whether Numba could compile all of it.
        built_in: whether it belongs to this package, whose compiled code is kept on disk.
    """

    name: str
    decide: Callable[..., Decision]
    options_type: type
    start: Callable[..., Any] | None
    observe: Callable[..., Any] | None
    check_start: Callable[[Any, float], None] | None
    compiled: bool
    built_in: bool


@dataclass(frozen=True)
class Assistant:
    """A rule with its options; stateless, so one serves any number of hosts.

    Attributes:
        rule: the registered rule.
        options: checked options, an instance of `rule.options_type`.
    """

    rule: Rule
    options: Any

    def __reduce__(self) -> Any:
        """Pickle by name, so that the rule is the one registered where it is unpickled."""
        return _unpickled, (self.rule.name, self.options._asdict())

    @property
    def name(self) -> str:
        """Name of the rule."""
        return self.rule.name

    def start(self) -> Any:
        """The rule's memory before a person's first episode; None for a memoryless rule."""
        return self.rule.start(self.options) if self.rule.start else None

    def decide(self, situation: Situation, noise: Noise, memory: Any = None) -> Decision:
        """Decide once, from Python."""
        decide = uncompiled(self.rule.decide)
        if self.rule.start is None:
            return decide(situation, noise, self.options)
        return decide(situation, noise, self.options, memory)

    def observe(self, memory: Any, step: Step) -> Any:
        """The rule's memory after a step; unchanged for a memoryless rule."""
        return self.rule.observe(memory, step, self.options) if self.rule.observe else memory

    def check_start(self, start_value: float) -> None:
        """Check that an episode may start.

        Args:
            start_value: V*(s_0), in reward units.

        Raises:
            RequestError: where the options do not suit an episode of that value.
        """
        if self.rule.check_start is None:
            return
        try:
            self.rule.check_start(self.options, start_value)
        except ValueError as error:
            raise RequestError(f"assistant {self.name}: {error}") from error


_rules: dict[str, Rule] = {}
_rules_by_options: dict[type, Rule] = {}
_registrations = itertools.count()


def register_assistant(
    name: str,
    options_type: type,
    *,
    start: Callable[..., Any] | None = None,
    observe: Callable[..., Any] | None = None,
    check_start: Callable[[Any, float], None] | None = None,
) -> Callable[[Callable[..., Decision]], Callable[..., Decision]]:
    """Register a decision rule under a name; it then works in every host.

    Args:
        name: how users will name it.
        options_type: a NamedTuple class of numbers. Bounds written as
            `Annotated[float, Field(ge=0, le=1)]` are checked when an assistant is made.
        start: `(options) -> memory`, for a rule that remembers. The rule then takes `memory` as
            its fourth argument.
        observe: `(memory, step, options) -> memory`, called after each step with its `Step`.
        check_start: `(options, start_value)`, raises ValueError where the options do not suit an
            episode with that V*(s_0).

    Returns:
        A decorator for the rule, `(situation, noise, options) -> Decision`. The rule is compiled
        with Numba; where that is impossible it is called as it is, with one warning.

    Raises:
        RequestError: where `options_type` is no NamedTuple class, or only one of `start` and
            `observe` is given.
    """
    if not (isinstance(options_type, type) and hasattr(options_type, "_fields")):
        raise RequestError(
            f"options_type of {name!r} is {options_type!r}; a NamedTuple class is needed"
        )
    if (start is None) != (observe is None):
        raise RequestError(f"rule {name!r}: give both start and observe, or neither")

    def decorate(function: Callable[..., Decision]) -> Callable[..., Decision]:
        built_in = isinstance(function, Dispatcher) and function.__module__.startswith("qbumpers.")
        if built_in:
            rule = Rule(name, function, options_type, start, observe, check_start, True, True)
        else:
            rule = _user_rule(name, function, options_type, start, observe, check_start)
        _rules[name] = rule
        _rules_by_options[rule.options_type] = rule
        return function

    return decorate


def _user_rule(
    name: str,
    function: Callable[..., Decision],
    options_type: type,
    start: Callable[..., Any] | None,
    observe: Callable[..., Any] | None,
    check_start: Callable[[Any, float], None] | None,
) -> Rule:
    # A fresh class for each registration, with a fresh name: compiled code is selected by the type
    # of the options, which Numba tells apart by name, and a rule registered again (an edited
    # notebook cell) must not meet its old code.
    fresh_name = f"{options_type.__name__}_{next(_registrations)}"
    fresh = type(fresh_name, (options_type,), {"__slots__": ()})
    plain = (function, start, observe)
    compiled: list[Any] = [
        f if f is None or isinstance(f, Dispatcher) else compiled_for_session(f) for f in plain
    ]
    try:
        _compile_once(compiled[0], compiled[1], compiled[2], fresh)
    except (NumbaError, TypeError) as error:
        reason = "; ".join(line.strip() for line in str(error).splitlines()[:4] if line.strip())
        warnings.warn(
            f"assistant {name!r} cannot be compiled and will run as plain Python, slower: {reason}",
            stacklevel=3,
        )
        return Rule(name, function, fresh, start, observe, check_start, False, False)
    return Rule(name, compiled[0], fresh, compiled[1], compiled[2], check_start, True, False)


def _compile_once(decide: Any, start: Any, observe: Any, options_type: type) -> None:
    """Compile a rule for the types that every host passes, without calling it."""
    values = np.zeros(2)
    situation = numba.typeof(Situation(values, 0, 0.0, 1.0, 0.0))
    noise = numba.typeof(Noise(0.0, 0.0))
    options = numba.typeof(_sample(options_type))
    arguments: tuple[Any, ...] = (situation, noise, options)
    if start is not None:
        start.compile((options,))
        memory = start.overloads[(options,)].signature.return_type
        step = numba.typeof(Step(0, 0, 0, False, 0.0, 0.0, 0.0, values, 0.0, 0.0))
        observe.compile((memory, step, options))
        observed = observe.overloads[memory, step, options].signature.return_type
        if observed != memory:
            raise TypeError(f"observe returns {observed}, but start makes a memory of {memory}")
        arguments = (*arguments, memory)
    decide.compile(arguments)
    decided = decide.overloads[arguments].signature.return_type
    if getattr(decided, "instance_class", None) is not Decision:
        raise TypeError(f"it returns {decided}, not a Decision")


def _sample(options_type: Any) -> Any:
    """An instance with a value of the right type in each field, whatever the bounds."""
    samples = {float: 0.0, int: 0, bool: False}
    hints = get_type_hints(options_type)
    return options_type._make(samples.get(hints.get(f), 0.0) for f in options_type._fields)


def rule_for_options(options_type: type) -> Rule:
    """The rule that options of this class belong to."""
    return _rules_by_options[options_type]


def assistants() -> dict[str, Rule]:
    """Every registered rule by name, in the order of registration."""
    return dict(_rules)


def make_assistant(name: str, **options: Any) -> Assistant:
    """An assistant: a rule by name, with checked options.

    Args:
        name: a registered name, for instance "stochastic-q-bumpers".
        **options: the rule's options, for instance `alpha=0.7`.

    Returns:
        The assistant.

    Raises:
        RequestError: where the name is unknown, or an option is unknown, missing or out of range.
    """
    if name not in _rules:
        raise unknown_name("assistant", name, _rules)
    rule = _rules[name]
    return Assistant(rule, _checked(rule, options))


def _unpickled(name: str, options: dict[str, Any]) -> Assistant:
    return make_assistant(name, **options)


def _checked(rule: Rule, options: dict[str, Any]) -> Any:
    fields: tuple[str, ...] = rule.options_type._fields  # type: ignore[attr-defined]
    for option in options:
        if option not in fields:
            raise unknown_name(f"option of assistant {rule.name}:", option, fields)
    return checked(rule.options_type, options, f"assistant {rule.name}")
