"""Decision rules by name: registering one, and finding it again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

from qbumpers.assistants.compiling import Kind, compile_functions
from qbumpers.compilation import compiled, is_compiled, is_of_package
from qbumpers.decisions import Decision, Step
from qbumpers.errors import RequestError, unknown_name
from qbumpers.registration import (
    check_arguments,
    checked_class,
    compiled_or_plain,
    fresh_class,
    is_written_here,
    original_class,
    sample,
)

NEEDS = ("states", "dynamics", "distance", "undo", "no_op")
"""What a rule may need of a task: numbered states, transitions, a distance between actions, a state
that can be taken back, an action that does nothing."""

Options = Annotated[Any, "options of another assistant"]
"""Type of the field `of` in the options of a rule over a rule."""


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
        revision: raised when the numbers that it gives change although its code does not show it.
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
    revision: int = 1

    @property
    def parts(self) -> tuple[Any, ...]:
        """What it was registered with: its functions, None for those it lacks, and its options."""
        functions = (self.decide, self.start, self.observe, self.check_start)
        return (*functions, original_class(self.options_type))

    @property
    def compiled(self) -> bool:
        """Whether Numba compiles it."""
        return bool(self.compiles_for)

    @property
    def over_a_rule(self) -> bool:
        """Whether it is a rule over a rule: whether its options have a field `of`."""
        return "of" in self.options_type._fields  # type: ignore[attr-defined]


@compiled
def unchanged(memory: Any, step: Step, options: Any) -> Any:
    """The same memory: `observe` of a rule that remembers only what it was given at its start."""
    return memory


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
    revision: int = 1,
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
        revision: to be raised when the rule gives other numbers for a reason that its code does not
            show, for instance a file that it opens by itself; finished trials are then simulated
            again.

    Returns:
        A decorator for the rule, `(situation, noise, options) -> Decision`. The rule is compiled
        with Numba; if that is impossible it is called as it is, with one warning.

    Raises:
        RequestError: if `options_type` is no NamedTuple class, only one of `start` and `observe` is
            given, a need is unknown, or a function takes other arguments or returns something else.
    """
    _check(name, options_type, start, observe, check_start, needs, values)
    arguments = ("situation", "noise", "options", *(() if start is None else ("memory",)))

    def decorate(function: Callable[..., Decision]) -> Callable[..., Decision]:
        """Register the rule, compiled if possible; the function itself stays what it was."""
        check_arguments(function, arguments, f"rule {name!r}")
        others = (options_type, start, observe, check_start)
        built_in = is_of_package(function) and all(map(is_written_here, others))
        rule = Rule(
            name, function, options_type, start, observe, check_start, tuple(needs), tuple(values),
            frozenset(_kinds(needs) if is_compiled(function) else ()), built_in, revision,
        )  # fmt: skip
        if not built_in:
            rule = _of_user(rule)
        _rules[name] = rule
        _rules_by_options[rule.options_type] = rule
        return function

    return decorate


def _check(
    name: str, options_type: Any, start: Any, observe: Any, check_start: Any,
    needs: Sequence[str], values: Sequence[str],
) -> None:  # fmt: skip
    checked_class(options_type, f"options_type of {name!r}")
    if "name" in options_type._fields:
        raise RequestError(f"rule {name!r}: an option cannot be called 'name', as the rule is")
    if (start is None) != (observe is None):
        raise RequestError(f"rule {name!r}: give both start and observe, or neither")
    functions = {
        "start": (start, ("options", "model")),
        "observe": (observe, ("memory", "step", "options")),
        "check_start": (check_start, ("options", "start_value")),
    }
    for which, (function, arguments) in functions.items():
        if function is not None:
            check_arguments(function, arguments, f"rule {name!r}: {which}")
    for need in needs:
        if need not in NEEDS:
            raise unknown_name(f"need of rule {name!r}:", need, NEEDS)
    if "of" in options_type._fields and values:
        raise RequestError(f"rule {name!r}: a rule over a rule reads the rows of that rule")


def _of_user(rule: Rule) -> Rule:
    """A rule from outside the package: with options of its own class, compiled if possible."""
    rule = replace(
        rule,
        options_type=fresh_class(rule.options_type, rule.name, _remade),
        compiles_for=frozenset(),
    )
    attempts = {kind: partial(_compile, rule, kind) for kind in _kinds(rule.needs)}
    try:
        (decide, start, observe), compiles_for = compiled_or_plain(
            f"assistant {rule.name!r}", (rule.decide, rule.start, rule.observe), attempts
        )
    except RequestError as error:
        raise RequestError(f"assistant {rule.name!r}: {error}") from error
    return replace(rule, decide=decide, start=start, observe=observe, compiles_for=compiles_for)


def _compile(rule: Rule, kind: Kind, decide: Any, start: Any, observe: Any) -> None:
    nested = sample(_rules["none"].options_type) if "none" in _rules else None
    compile_functions(kind, decide, start, observe, sample(rule.options_type, nested))


def compile_rule(rule: Rule, kind: Kind) -> None:
    """Compile a rule for tasks with numbered "states" or with "vectors", without calling it.

    Raises:
        CompilationError: if it cannot be compiled for them.
    """
    _compile(rule, kind, rule.decide, rule.start, rule.observe)


def _kinds(needs: Sequence[str]) -> tuple[Kind, ...]:
    tables_only = {"states", "dynamics"} & set(needs)
    return ("states",) if tables_only else ("states", "vectors")


def rule_for_options(options_type: type) -> Rule:
    """The rule that options of this class belong to."""
    return _rules_by_options[options_type]


def is_options(kind: Any) -> bool:
    """Whether a class is that of some rule's options."""
    return kind in _rules_by_options


def assistants() -> dict[str, Rule]:
    """Every registered rule by name, in alphabetical order."""
    return dict(sorted(_rules.items()))


def registered(name: str) -> Rule:
    """The rule of that name.

    Raises:
        RequestError: if there is none.
    """
    if str(name) not in _rules:
        raise unknown_name("assistant", name, _rules)
    return _rules[name]


def _remade(name: str, values: tuple[Any, ...]) -> Any:
    """Options where they arrive, of the rule that is registered there."""
    return registered(name).options_type._make(values)  # type: ignore[attr-defined]
