"""The rule that options belong to, called from the loops of the simulators.

Compiled loops cannot hold a registry. They choose the rule by the type of its options when they
are compiled, so that each loop is compiled for one rule, with the rule inside it. A rule over a
rule calls these same functions with the options and the memory of the other.
"""

import functools
from typing import Any

from numba import types
from numba.extending import overload

from qbumpers.assistants.registry import Rule, is_options, rule_for_options
from qbumpers.compilation import INLINE, compiled_for_session, inlined, uncompiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step, checked_decision


def decide(situation: Situation, noise: Noise, options: Any, memory: Any) -> Decision:
    """Apply the rule that `options` belong to."""
    rule = rule_for_options(type(options))
    function = uncompiled(rule.decide)
    if rule.start is None:
        return checked_decision(function(situation, noise, options), rule.name)
    return checked_decision(function(situation, noise, options, memory), rule.name)


def start(options: Any, model: Model) -> Any:
    """The memory of the rule before the first episode of a learner or participant."""
    rule = rule_for_options(type(options))
    return 0 if rule.start is None else uncompiled(rule.start)(options, model)


def observe(memory: Any, step: Step, options: Any) -> Any:
    """The memory of the rule after a step."""
    rule = rule_for_options(type(options))
    return memory if rule.observe is None else uncompiled(rule.observe)(memory, step, options)


def undoes(decision: Decision) -> bool:
    """Whether a decision takes the state back after the action."""
    return bool(decision.undo)


def executing(decision: Decision, action: int, probability: float) -> Decision:
    """Another action in place of a decision, for rules over rules.

    Args:
        decision: of the rule below; in compiled code the result has as many fields.
        action: to execute instead; it is not undone.
        probability: of an override, before the coin was tossed.
    """
    return Decision(action, probability)


def with_probability(decision: Decision, probability: float) -> Decision:
    """A decision with another probability of an override, for rules over rules."""
    return decision._replace(probability=probability)


@inlined
def overrides(decision: Decision, proposed: int) -> bool:
    """Whether a decision executes another action than the proposed one, or undoes it."""
    return decision.action != proposed or undoes(decision)


@inlined
def declined(decision: Decision, proposed: int) -> Decision:
    """The proposed action in place of a decision, for rules over rules.

    Args:
        decision: of the rule below; in compiled code the result has as many fields.
        proposed: the action to execute instead.
    """
    return executing(decision, proposed, 0.0)


@overload(decide, strict=False, jit_options=INLINE)
def _compiled_decide(situation: Any, noise: Any, options: Any, memory: Any) -> Any:
    rule = rule_for_options(options.instance_class)
    function = _callable(rule, options, rule.decide)
    if rule.start is None:
        return lambda situation, noise, options, memory: function(situation, noise, options)
    return lambda situation, noise, options, memory: function(situation, noise, options, memory)


@overload(start, strict=False, jit_options=INLINE)
def _compiled_start(options: Any, model: Any) -> Any:
    rule = rule_for_options(options.instance_class)
    if rule.start is None:
        return lambda options, model: 0
    function = _callable(rule, options, rule.start)
    return lambda options, model: function(options, model)


@overload(observe, strict=False, jit_options=INLINE)
def compiled_observe(memory: Any, step: Any, options: Any) -> Any:
    """What `observe` is in compiled code, from the types of its arguments."""
    rule = rule_for_options(options.instance_class)
    if rule.observe is None:
        return lambda memory, step, options: memory
    function = _callable(rule, options, rule.observe)
    return lambda memory, step, options: function(memory, step, options)


@overload(undoes, strict=False, jit_options=INLINE)
def _compiled_undoes(decision: Any) -> Any:
    if decision.count == 3:
        return lambda decision: bool(decision.undo)
    return lambda decision: False


@overload(executing, strict=False, jit_options=INLINE)
def _compiled_executing(decision: Any, action: Any, probability: Any) -> Any:
    if decision.count == 3:
        return lambda decision, action, probability: Decision(action, probability, False)
    return lambda decision, action, probability: Decision(action, probability)


@overload(with_probability, strict=False, jit_options=INLINE)
def _compiled_with_probability(decision: Any, probability: Any) -> Any:
    if decision.count == 3:
        return lambda decision, probability: Decision(decision.action, probability, decision.undo)
    return lambda decision, probability: Decision(decision.action, probability)


def _callable(rule: Rule, options: Any, function: Any) -> Any:
    """A function of a rule; for this session alone if a rule below is the user's or the same."""
    if (rule.built_in and not _all_built_in(options)) or _is_below(rule, options):
        return _for_session(uncompiled(function), options)
    return function


def _is_below(rule: Rule, options: Any) -> bool:
    """Whether a rule is over itself: compiled code that calls itself would never be inlined."""
    nested = [kind for kind in options.types if isinstance(kind, types.NamedTuple)]
    return any(
        is_options(kind.instance_class)
        and (rule_for_options(kind.instance_class) is rule or _is_below(rule, kind))
        for kind in nested
    )


def _all_built_in(options: Any) -> bool:
    if not (isinstance(options, types.NamedTuple) and is_options(options.instance_class)):
        return True
    rule = rule_for_options(options.instance_class)
    return rule.built_in and all(map(_all_built_in, options.types))


@functools.lru_cache(maxsize=256)
def _for_session(function: Any, options: Any) -> Any:
    """A function compiled for this session, another one for every type of options."""
    return compiled_for_session(function)
