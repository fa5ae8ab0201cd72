"""Decision rules by name: registering one, and making an assistant of a rule and its options."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, get_type_hints

import numpy as np

from qbumpers.compilation import (
    CompilationError,
    is_compiled,
    is_of_package,
    result_type,
    type_of,
    uncompiled,
)
from qbumpers.decisions import Decision, Model, Noise, Situation, Step
from qbumpers.errors import RequestError, checked, unknown_name
from qbumpers.registration import (
    as_numbers,
    checked_class,
    compiled_or_plain,
    fresh_class,
    sample,
    shortened,
)
from qbumpers.tasks.dynamics import Dynamics

NEEDS = ("states", "dynamics", "distance", "undo", "no_op")
"""What a rule may need of a task: numbered states, transitions, a distance between actions, a state
that can be taken back, an action that does nothing."""

Options = Annotated[Any, "options of another assistant"]
"""Type of the field `of` in the options of a rule over a rule."""

_BY_POSITION = (
    "a Situation has more fields than a rule can unpack by position; read them by name, for "
    "instance situation.values"
)


@dataclass(frozen=True)
class Rule:
    """A decision rule as registered.

    Attributes:
        name: how users name it.
        decide: `(situation, noise, options) -> Decision`, with `memory` as a fourth argument if the
            rule has one.
        options_type: the NamedTuple of its options; it also selects the rule in compiled code.
        start: `(options, model) -> memory` of a rule that remembers, else None.
        observe: `(memory, step, options) -> memory` of a rule that remembers, else None.
        check_start: `(options, start_value)`, raises ValueError if an episode of that V*(s_0) does
            not suit the options.
        needs: of `NEEDS`, what it cannot do without.
        values: names of the further rows of values that it reads from `Situation.others`.
        compiles_for: "states" or "vectors" if Numba compiled it for such tasks; empty if it runs as
            plain Python.
        built_in: whether it belongs to this package, whose compiled code is kept on disk.
    """

    name: str
    decide: Callable[..., Decision]
    options_type: type
    start: Callable[..., Any] | None
    observe: Callable[..., Any] | None
    check_start: Callable[[Any, float], None] | None
    needs: tuple[str, ...]
    values: tuple[str, ...]
    compiles_for: frozenset[str]
    built_in: bool

    @property
    def compiled(self) -> bool:
        """Whether Numba compiles it."""
        return bool(self.compiles_for)

    @property
    def over_a_rule(self) -> bool:
        """Whether it is a rule over a rule: whether its options have a field `of`."""
        return "of" in self.options_type._fields  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Assistant:
    """A rule with its options; stateless, so one serves any number of hosts.

    Attributes:
        rule: the registered rule.
        options: checked options, an instance of `rule.options_type`. In the options of a rule over
            a rule, `of` is the other Assistant.
    """

    rule: Rule
    options: Any

    def __reduce__(self) -> Any:
        """Pickle by name, so that the rule is the one registered where it is unpickled."""
        own = self.numbers._replace(of=None) if self.of else self.numbers
        # A tuple: the class of a user's options is another wherever the rule is registered.
        return _unpickled, (self.rule.name, self.options._asdict(), tuple(own))

    @property
    def name(self) -> str:
        """Name of the rule."""
        return self.rule.name

    @property
    def of(self) -> "Assistant | None":
        """The assistant that this one is over; None if it is over none."""
        return self.options.of if self.rule.over_a_rule else None

    @cached_property
    def chain(self) -> list[Rule]:
        """This assistant's rule, the rule that it is over, and so on."""
        return [self.rule, *(self.of.chain if self.of else [])]

    @cached_property
    def numbers(self) -> Any:
        """The options as rules take them: texts and files as numbers, `of` as options."""
        own = self.options._replace(of=self.of.numbers) if self.of else self.options
        return as_numbers(own)

    @property
    def needs(self) -> frozenset[str]:
        """Of `NEEDS`, what the rule and those below it cannot do without."""
        return frozenset(need for rule in self.chain for need in rule.needs)

    @property
    def values(self) -> tuple[str, ...]:
        """Names of the further rows of values that `Situation.others` must have."""
        return next((rule.values for rule in self.chain if rule.values), ())

    @property
    def built_in(self) -> bool:
        """Whether all of it belongs to this package."""
        return all(rule.built_in for rule in self.chain)

    @property
    def compiled(self) -> bool:
        """Whether Numba compiles all of it."""
        return all(rule.compiled for rule in self.chain)

    def described(self) -> dict[str, Any]:
        """The options by name, as JSON-like data; `of` as a table with a name."""
        fields = self.options._asdict()
        if self.of:
            fields["of"] = {"name": self.of.name, **self.of.described()}
        return fields

    def start(self, model: Model) -> Any:
        """The rule's memory before the first episode; 0 of a memoryless rule."""
        from qbumpers.assistants import dispatch

        return dispatch.start(self.numbers, model)

    def decide(self, situation: Situation, noise: Noise, memory: Any = 0) -> Decision:
        """Decide once, from Python; arguments and errors are the rule's."""
        rule = self.rule
        try:
            if rule.start is None:
                return uncompiled(rule.decide)(situation, noise, self.numbers)
            return uncompiled(rule.decide)(situation, noise, self.numbers, memory)
        except ValueError as error:
            if "too many values to unpack" in str(error):
                raise RequestError(f"assistant {self.name}: {_BY_POSITION}") from error
            raise

    def observe(self, memory: Any, step: Step) -> Any:
        """The rule's memory after a step; unchanged if it is memoryless."""
        if self.rule.observe is None:
            return memory
        return uncompiled(self.rule.observe)(memory, step, self.numbers)

    def check_start(self, start_value: float) -> None:
        """Check that an episode may start.

        Args:
            start_value: V*(s_0), in reward units.

        Raises:
            RequestError: if the options do not suit an episode of that value.
        """
        if self.of:
            self.of.check_start(start_value)
        if self.rule.check_start is None:
            return
        try:
            self.rule.check_start(self.options, start_value)
        except ValueError as error:
            raise RequestError(f"assistant {self.name}: {error}") from error

    def check_task(self, task: str, has: Mapping[str, bool]) -> None:
        """Check that a task has what the rule needs.

        Args:
            task: its name, for the message.
            has: whether the task has it, for each of `NEEDS`.

        Raises:
            RequestError: if it lacks something, or the rule compiles only for other observations.
        """
        for need in NEEDS:
            if need in self.needs and not has[need]:
                raise RequestError(
                    f"assistant {self.name}: task {task} has no {_WORDS[need]}, which it needs"
                )
        kind = "states" if has["states"] else "vectors"
        for rule in self.chain:
            if rule.compiled and not rule.built_in and kind not in rule.compiles_for:
                try:
                    compile_rule(rule, kind)
                except CompilationError as error:
                    raise RequestError(
                        f"assistant {rule.name}: it compiles for {' and '.join(rule.compiles_for)}"
                        f", not for {kind}, which task {task} has: {shortened(error)}"
                    ) from error


_WORDS = {
    "states": "numbered states",
    "dynamics": "table of transitions",
    "distance": "distance between actions",
    "undo": "state that can be taken back (snapshot and restore)",
    "no_op": "action that does nothing (no_op)",
}

_rules: dict[str, Rule] = {}
_rules_by_options: dict[type, Rule] = {}


def register_assistant(
    name: str,
    options_type: type,
    *,
    start: Callable[..., Any] | None = None,
    observe: Callable[..., Any] | None = None,
    check_start: Callable[[Any, float], None] | None = None,
    needs: Sequence[str] = (),
    values: Sequence[str] = (),
) -> Callable[[Callable[..., Decision]], Callable[..., Decision]]:
    """Register a decision rule under a name; it then works in every host.

    Args:
        name: how users will name it.
        options_type: a NamedTuple class of numbers, tuples of numbers, `Literal` texts and `File`
            names. Bounds written as `Annotated[float, Field(ge=0, le=1)]` are checked when an
            assistant is made. A rule over a rule has a field `of: Options`.
        start: `(options, model) -> memory`, of a rule that remembers; `model` is a
            `qbumpers.decisions.Model`. The rule then takes `memory` as its fourth argument. A
            memory is a number, an array, or a NamedTuple of them, and keeps its type.
        observe: `(memory, step, options) -> memory`, called after each step with its `Step`; the
            only place in which the arrays of a memory may change.
        check_start: `(options, start_value)`, raises ValueError if the options do not suit an
            episode with that V*(s_0).
        needs: of `NEEDS`, what the rule cannot do without; a task that cannot give it is refused.
        values: names of further rows of values that the assistant's values must hold beside Q*, in
            the order in which the rule finds them in `Situation.others`.

    Returns:
        A decorator for the rule, `(situation, noise, options) -> Decision`. The rule is compiled
        with Numba; if that is impossible it is called as it is, with one warning.

    Raises:
        RequestError: if `options_type` is no NamedTuple class, only one of `start` and `observe` is
            given, `start` does not take a model, or a need is unknown.
    """
    checked_class(options_type, f"options_type of {name!r}")
    if (start is None) != (observe is None):
        raise RequestError(f"rule {name!r}: give both start and observe, or neither")
    if start is not None and len(inspect.signature(uncompiled(start)).parameters) != 2:
        raise RequestError(f"rule {name!r}: start takes two arguments, (options, model)")
    for need in needs:
        if need not in NEEDS:
            raise unknown_name(f"need of rule {name!r}:", need, NEEDS)

    def decorate(function: Callable[..., Decision]) -> Callable[..., Decision]:
        built_in = is_of_package(function)
        rule = Rule(
            name, function, options_type, start, observe, check_start, tuple(needs), tuple(values),
            frozenset({"states", "vectors"} if is_compiled(function) else ()), built_in,
        )  # fmt: skip
        if rule.over_a_rule and values:
            raise RequestError(f"rule {name!r}: a rule over a rule reads the rows of that rule")
        if not built_in:
            rule = _of_user(rule)
        _rules[name] = rule
        _rules_by_options[rule.options_type] = rule
        return function

    return decorate


def _of_user(rule: Rule) -> Rule:
    fresh = fresh_class(rule.options_type, rule.name, _remade)
    # Registered while it is compiled, so that it can be found by its options.
    attempts = {
        kind: lambda decide, start, observe, kind=kind: _compile_for(
            kind, decide, start, observe, fresh
        )
        for kind in _kinds(rule)
    }
    plain = (rule.decide, rule.start, rule.observe)
    try:
        (decide, start, observe), compiles_for = compiled_or_plain(
            f"assistant {rule.name!r}", plain, attempts
        )
    except RequestError as error:
        raise RequestError(f"assistant {rule.name!r}: {error}") from error
    return Rule(
        rule.name, decide, fresh, start, observe, rule.check_start, rule.needs, rule.values,
        compiles_for, False,
    )  # fmt: skip


def _kinds(rule: Rule) -> tuple[str, ...]:
    tables_only = {"states", "dynamics"} & set(rule.needs)
    return ("states",) if tables_only else ("states", "vectors")


def compile_rule(rule: Rule, kind: str) -> None:
    """Compile a rule for tasks with numbered "states" or with "vectors", without calling it.

    Raises:
        NumbaError: if it cannot be compiled for them.
    """
    _compile_for(kind, rule.decide, rule.start, rule.observe, rule.options_type)


def _compile_for(kind: str, decide: Any, start: Any, observe: Any, options_type: type) -> None:
    """Compile a rule for the types that every host passes."""
    state = 0 if kind == "states" else np.zeros(1, np.float32)
    values = np.zeros(2)
    situation = type_of(Situation(state, values, np.zeros((0, 2)), 0, 0.0, 1.0, 0.0, 0, 0))
    noise = type_of(Noise(0.0, 0.0))
    nested = sample(_rules["none"].options_type) if "none" in _rules else None
    options = type_of(sample(options_type, nested))
    arguments: tuple[Any, ...] = (situation, noise, options)
    if start is not None:
        dynamics = _example_dynamics() if kind == "states" else None
        model = type_of(Model(1, 0, 2, -1, 1.0, dynamics, np.zeros((2, 2))))
        memory = result_type(start, options, model)
        step = type_of(
            Step(0, state, 0, 0, False, 0, False, 0.0, 0.0, 0.0, values, 0.0, 0.0, state, 0)
        )
        observed = result_type(observe, memory, step, options)
        if observed != memory:
            raise TypeError(f"observe returns {observed}, but start makes a memory of {memory}")
        arguments = (*arguments, memory)
    try:
        decided = result_type(decide, *arguments)
    except CompilationError as error:
        if "wrong tuple length" in str(error) and f"got {len(Situation._fields)}" in str(error):
            raise RequestError(_BY_POSITION) from error
        raise
    if getattr(decided, "instance_class", None) is not Decision:
        raise TypeError(f"it returns {decided}, not a Decision")


def _example_dynamics() -> Dynamics:
    whole, real = np.zeros(1, np.int64), np.zeros(1)
    return Dynamics(whole, real, real, np.zeros(1, np.uint8), 1, 1, whole, real, 1)


def rule_for_options(options_type: type) -> Rule:
    """The rule that options of this class belong to."""
    return _rules_by_options[options_type]


def is_options(kind: Any) -> bool:
    """Whether a class is that of some rule's options."""
    return kind in _rules_by_options


def assistants() -> dict[str, Rule]:
    """Every registered rule by name, in the order of registration."""
    return dict(_rules)


def make_assistant(name: str, **options: Any) -> Assistant:
    """An assistant: a rule by name, with checked options.

    Args:
        name: a registered name, for instance "stochastic-q-bumpers".
        **options: the rule's options, for instance `alpha=0.7`. The option `of` of a rule over a
            rule is an Assistant, the name of one, or a table with its `name` and options.

    Returns:
        The assistant.

    Raises:
        RequestError: if the name is unknown, or an option is unknown, missing or out of range.
    """
    rule = _registered(name)
    if rule.over_a_rule and "of" in options:
        options = {**options, "of": assistant_of(options["of"], f"assistant {name}: of")}
    made = Assistant(rule, _checked(rule, options))
    _ = made.numbers  # reads its files, or says what is wrong with them
    return made


def assistant_of(given: Any, where: str) -> Assistant:
    """An assistant from whatever names one.

    Args:
        given: an Assistant, a name, or a table with a `name` and options.
        where: for messages, for instance "assistant budget: of".

    Raises:
        RequestError: if it names none.
    """
    if isinstance(given, Assistant):
        return given
    if isinstance(given, str):
        return make_assistant(given)
    if isinstance(given, Mapping) and isinstance(given.get("name"), str):
        options = {option: value for option, value in given.items() if option != "name"}
        return make_assistant(given["name"], **options)
    raise RequestError(
        f"{where} = {given!r}: an assistant is needed, its name or a table with name and options"
    )


def _registered(name: str) -> Rule:
    if name not in _rules:
        raise unknown_name("assistant", name, _rules)
    return _rules[name]


def _remade(name: str, values: tuple[Any, ...]) -> Any:
    """Options where they arrive, of the rule that is registered there."""
    return _registered(name).options_type._make(values)  # type: ignore[attr-defined]


def _unpickled(name: str, options: dict[str, Any], numbers: tuple[Any, ...]) -> Assistant:
    """An assistant where it arrives; its files are not read again."""
    rule = _registered(name)
    made = Assistant(rule, rule.options_type(**options))
    again: Any = rule.options_type(*numbers)
    made.__dict__["numbers"] = again._replace(of=made.of.numbers) if made.of else again
    return made


def _checked(rule: Rule, options: dict[str, Any]) -> Any:
    fields: tuple[str, ...] = rule.options_type._fields  # type: ignore[attr-defined]
    for option in options:
        if option not in fields:
            raise unknown_name(f"option of assistant {rule.name}:", option, fields)
    hints = get_type_hints(rule.options_type)
    given = {
        option: tuple(value)
        if isinstance(value, list) and getattr(hints.get(option), "__origin__", None) is tuple
        else value
        for option, value in options.items()
    }
    return checked(rule.options_type, given, f"assistant {rule.name}")
