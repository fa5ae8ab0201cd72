"""The rule that options belong to, called from the loops of the simulators.

Compiled loops cannot hold a registry. They choose the rule by the type of its options when they
are compiled, so that each loop is compiled for one rule, with the rule inside it.
"""

from typing import Any

from numba.extending import overload

from qbumpers.assistants.registry import rule_for_options
from qbumpers.compilation import INLINE
from qbumpers.decisions import Decision, Noise, Situation, Step


def decide(situation: Situation, noise: Noise, options: Any, memory: Any) -> Decision:
    """Apply the rule that `options` belong to."""
    rule = rule_for_options(type(options))
    if rule.start is None:
        return rule.decide(situation, noise, options)
    return rule.decide(situation, noise, options, memory)


def start(options: Any) -> Any:
    """The memory of the rule before a person's first episode."""
    rule = rule_for_options(type(options))
    return 0 if rule.start is None else rule.start(options)


def observe(memory: Any, step: Step, options: Any) -> Any:
    """The memory of the rule after a step."""
    rule = rule_for_options(type(options))
    return memory if rule.observe is None else rule.observe(memory, step, options)


@overload(decide, strict=False, jit_options=INLINE)
def _compiled_decide(situation: Any, noise: Any, options: Any, memory: Any) -> Any:
    rule = rule_for_options(options.instance_class)
    function = rule.decide
    if rule.start is None:
        return lambda situation, noise, options, memory: function(situation, noise, options)
    return lambda situation, noise, options, memory: function(situation, noise, options, memory)


@overload(start, strict=False, jit_options=INLINE)
def _compiled_start(options: Any) -> Any:
    function = rule_for_options(options.instance_class).start
    if function is None:
        return lambda options: 0
    return lambda options: function(options)


@overload(observe, strict=False, jit_options=INLINE)
def _compiled_observe(memory: Any, step: Any, options: Any) -> Any:
    function = rule_for_options(options.instance_class).observe
    if function is None:
        return lambda memory, step, options: memory
    return lambda memory, step, options: function(memory, step, options)
