"""Compiling a rule for the types that every host passes, to find out whether Numba can."""

from typing import Any, Literal

import numpy as np

from qbumpers.borrowing import read_only
from qbumpers.compilation import CompilationError, result_type, type_of
from qbumpers.decisions import Decision, Model, Noise, Situation, Step
from qbumpers.errors import RequestError
from qbumpers.tasks.dynamics import Dynamics

Kind = Literal["states", "vectors"]

BY_POSITION = (
    "a Situation has more fields than a rule can unpack by position; read them by name, for "
    "instance situation.values"
)
"""What is said of a rule that unpacks a situation by position."""


def compile_functions(kind: Kind, decide: Any, start: Any, observe: Any, options: Any) -> None:
    """Compile the functions of a rule for the types that every host passes, without a call.

    Args:
        kind: what its tasks have, numbered "states" or "vectors".
        decide: the rule itself, a function that Numba is to compile.
        start: makes its memory; None if it has none.
        observe: changes its memory; None if it has none.
        options: an example of its options, as numbers.

    Raises:
        CompilationError: if one of them cannot be compiled for these types.
        RequestError: if the rule unpacks the situation by position, or does not return a Decision.
    """
    state = 0 if kind == "states" else read_only(np.zeros(1, np.float32))
    values, others = read_only((np.zeros(2), np.zeros((0, 2))))
    situation = type_of(Situation(state, values, others, 0, 0.0, 1.0, 0.0, 0, 0))
    noise = type_of(Noise(0.0, 0.0))
    options = type_of(options)
    arguments: tuple[Any, ...] = (situation, noise, options)
    if start is not None:
        dynamics = _example_dynamics() if kind == "states" else None
        model = type_of(read_only(Model(1, 0, 2, -1, 1.0, dynamics, np.zeros((2, 2)))))
        memory = result_type(start, options, model)
        step = type_of(
            Step(0, state, 0, 0, False, 0, False, 0.0, 0.0, 0.0, values, 0.0, 0.0, state, 0)
        )
        observed = result_type(observe, memory, step, options)
        if observed != memory:
            raise CompilationError(
                f"observe returns {observed}, but start makes a memory of {memory}"
            )
        arguments = (*arguments, memory)
    try:
        decided = result_type(decide, *arguments)
    except CompilationError as error:
        if "wrong tuple length" in str(error) and f"got {len(Situation._fields)}" in str(error):
            raise RequestError(BY_POSITION) from error
        raise
    always, sometimes = (
        getattr(kind, "instance_class", None) is Decision
        for kind in (decided, getattr(decided, "type", None))
    )
    if not always:
        error = CompilationError if sometimes else RequestError
        raise error(f"it returns {decided}, not {'always ' if sometimes else ''}a Decision")


def _example_dynamics() -> Dynamics:
    whole, real = np.zeros(1, np.int64), np.zeros(1)
    return Dynamics(whole, real, real, np.zeros(1, np.uint8), 1, 1, whole, real, 1)
