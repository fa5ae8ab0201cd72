"""Assistants: a registered rule with checked options, and making one from whatever names it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_type_hints

import numpy as np

from qbumpers.assistants import dispatch
from qbumpers.assistants.compiling import BY_POSITION
from qbumpers.assistants.registry import NEEDS, Rule, compile_rule, registered
from qbumpers.compilation import CompilationError, shortened, uncompiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step, checked_decision
from qbumpers.errors import RequestError, checked, unknown_name
from qbumpers.registration import as_numbers, files_in

NEEDED_THINGS = {
    "states": "numbered states",
    "dynamics": "table of transitions",
    "distance": "distance between actions",
    "undo": "state that can be taken back (snapshot and restore)",
    "no_op": "action that does nothing (no_op)",
}
"""What a rule may need of a task, in words, for each of `NEEDS`."""


@dataclass(frozen=True)
class Assistant:
    """A rule with its options; stateless, so one serves any number of hosts.

    Attributes:
        rule: what decides, as registered.
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
    def files(self) -> dict[str, np.ndarray]:
        """What is in the files that its options and those of `of` name, float64 [N, K] by name."""
        own = self.options._replace(of=self.of.options) if self.of else self.options
        return files_in(own, self.numbers)

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
        """The options by name, as JSON-like data; `of` as a table with a name, None left out."""
        fields = {f: value for f, value in self.options._asdict().items() if value is not None}
        if self.of:
            fields["of"] = {"name": self.of.name, **self.of.described()}
        return fields

    def start(self, model: Model) -> Any:
        """The rule's memory before the first episode; 0 of a memoryless rule."""
        return dispatch.start(self.numbers, model)

    def decide(self, situation: Situation, noise: Noise, memory: Any = 0) -> Decision:
        """Decide once, from Python; arguments and errors are the rule's."""
        rule = self.rule
        try:
            if rule.start is None:
                found = uncompiled(rule.decide)(situation, noise, self.numbers)
            else:
                found = uncompiled(rule.decide)(situation, noise, self.numbers, memory)
        except ValueError as error:
            if "too many values to unpack" in str(error):
                raise RequestError(f"assistant {self.name}: {BY_POSITION}") from error
            raise
        return checked_decision(found, self.name)

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
                    f"assistant {self.name}: task {task} has no {NEEDED_THINGS[need]}, which it "
                    "needs"
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
    rule = registered(name)
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


def _unpickled(name: str, options: dict[str, Any], numbers: tuple[Any, ...]) -> Assistant:
    """An assistant where it arrives; its files are not read again."""
    rule = registered(name)
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
