"""The code that is compiled for a card, run on the processor, one thread after another.

It is LLVM's code before the part of the compiler that knows cards. Here it is compiled for the
processor, with a few functions in the place of what only a card has.
"""

import ctypes
import re
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba.core import types

from qbumpers.decisions import Step
from qbumpers.simulation.cuda.card import THREADS
from qbumpers.simulation.cuda.layout import of_one
from tests.narrowing import present

_MATHS = {"exp": 1, "log": 1, "pow": 2, "fabs": 1, "fmax": 2, "fmin": 2, "floor": 1}
_PLACES = ("tid.x", "ctaid.x")  # of a thread, and of its block
_SCRATCH_WORDS = 3 * THREADS
_POINTER = re.compile(r"(?:\b(?:i\d+|double|float|ptr)|\[[^][]*\]|\{[^{}]*\}) ?\*+")
_OPENING = {")": "(", "]": "[", "}": "{"}


def run_on_processor(kernel):
    """Run every trial of a kernel; its arguments then hold what a card would have put there.

    Returns the outcomes, what else was found, and a table of steps per trial if they are kept.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    whole = llvm.parse_assembly(_in_place_of_a_card())
    for text in kernel.modules:
        whole.link_in(llvm.parse_assembly(_for_processor(text)))
    missing = {each.name for each in whole.functions if each.is_declaration}
    known = {f"{name}{suffix}" for name in _MATHS for suffix in ("", "f")}
    unknown = {name for name in missing - known if not name.startswith("llvm.")}
    assert not unknown, f"a card has {sorted(unknown)}, but nothing is here in its place"
    [name] = re.findall(r"\.entry (\w+)", kernel.ptx)
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0)
    with llvm.create_mcjit_compiler(whole, machine) as engine:
        engine.finalize_object()
        arguments = _flat(kernel.kinds, kernel.arguments)
        function = ctypes.CFUNCTYPE(ctypes.c_int, *map(type, arguments))(
            engine.get_function_address(name)
        )
        thread, block = (
            ctypes.c_int32.from_address(engine.get_global_value_address(f"at.{place}"))
            for place in _PLACES
        )
        for trial in range(len(kernel.arguments[-1].finished)):
            block.value, thread.value = divmod(trial, THREADS)
            function(*arguments)
    *_, sinks, found = kernel.arguments
    return sinks.outcomes, found, steps_of_trials(sinks)


def steps_of_trials(sinks):
    """The steps that each trial took, cut out of what a block of trials has kept."""
    if sinks.record is None:
        return []
    lengths = sinks.outcomes.assisted_length.sum(axis=1)
    return [
        Step(*(of_one(far.arrays, trial)[:length] for far in sinks.record))
        for trial, length in enumerate(lengths)
    ]


def _in_place_of_a_card():
    lines = [f"@qbumpers_scratch = global [{_SCRATCH_WORDS} x i64] zeroinitializer"]
    for place in _PLACES:
        lines += [
            f"@at.{place} = global i32 0",
            f"define i32 @llvm_nvvm.{place}() {{ %v = load i32, ptr @at.{place} ret i32 %v }}",
        ]
    for name, number in {"ntid.x": THREADS, "tid.y": 0, "tid.z": 0}.items():
        lines.append(f"define i32 @llvm_nvvm.{name}() {{ ret i32 {number} }}")
    for name, count in _MATHS.items():
        for kind, suffix in (("double", ""), ("float", "f")):
            kinds = ", ".join([kind] * count)
            named = ", ".join(f"{kind} %{place}" for place in "ab"[:count])
            lines += [
                f"declare {kind} @{name}{suffix}({kinds})",
                f"define {kind} @__nv_{name}{suffix}({named}) {{",
                f"%v = call {kind} @{name}{suffix}({named}) ret {kind} %v }}",
            ]
    return "\n".join(lines)


def _for_processor(text):
    lines = []
    for line in text.splitlines():
        if line.startswith(("target ", "@llvm.used", '@"llvm.used"')):
            continue
        line = re.sub(r"llvm\.nvvm\.read\.ptx\.sreg\.", "llvm_nvvm.", line)
        line = re.sub(r" ?addrspace\(\d\)", "", line).replace("addrspacecast", "bitcast")
        lines.append(_untyped(line) if "*" in line else line)
    return "\n".join(lines)


def _untyped(line):
    """A line of code whose pointers do not say to what they point, as later LLVMs want it."""
    while "*" in line:
        simple = _POINTER.sub("ptr", line)
        if simple == line:
            before, after = line.split("*", 1)
            simple = before[: _begin_of_type(before)] + "ptr" + after
        line = simple
    return line


def _begin_of_type(text):
    text = text.rstrip()
    if text[-1] in _OPENING:
        depth = 0
        for place in range(len(text) - 1, -1, -1):
            depth += (text[place] == text[-1]) - (text[place] == _OPENING[text[-1]])
            if not depth:
                return _begin_of_type(text[:place]) if text[-1] == ")" else place
    return present(re.search(r'(%"[^"]*"|[%\w.]+)$', text)).start()


def _flat(kinds, values):
    """Arguments as a kernel takes them: arrays and tuples in their parts."""
    found: list[Any] = []
    for kind, value in zip(kinds, values, strict=True):
        if isinstance(kind, types.BaseTuple):
            parts: Any = kind
            found += _flat(parts.types, value)
        elif isinstance(kind, types.Array):
            sizes = (value.size, value.itemsize)
            found += [ctypes.c_void_p(), ctypes.c_void_p(), *map(ctypes.c_int64, sizes)]
            found.append(ctypes.c_void_p(value.ctypes.data))
            found += map(ctypes.c_int64, (*value.shape, *value.strides))
        elif value is None:
            found.append(ctypes.c_void_p())
        else:
            found.append(np.ctypeslib.as_ctypes_type(str(kind))(value))
    return found
