"""Kernels compiled for a card that is not there: to PTX, and to LLVM's code."""

import contextlib
import types
from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda
from numba import typeof
from numba.cuda import dispatcher as numba_dispatcher
from numba.cuda.cudadrv import nvvm

from qbumpers.simulation import Condition
from qbumpers.simulation.cuda.block import Begun, begin
from qbumpers.simulation.cuda.card import types_on_card
from qbumpers.simulation.cuda.devices import Precision
from qbumpers.simulation.cuda.engine import kernel_arguments
from qbumpers.simulation.cuda.kernel import trial_of_thread
from qbumpers.simulation.cuda.layout import Far, of_all

cuda: Any = numba_cuda
dispatcher: Any = numba_dispatcher

COMPUTE_CAPABILITY = (9, 0)
"""Of the cards that tests compile for."""


class Kernel(NamedTuple):
    """A kernel, with what it was compiled for."""

    ptx: str
    modules: list[str]
    arguments: tuple[Any, ...]
    kinds: tuple[Any, ...]
    begun: Begun


def own_arrays(first, groups):
    return Far(of_all(first, groups))


def empty_array(shape, kind):
    return np.zeros(shape, kind, order="F")


def compile_kernel(
    condition: Condition, trials=range(2), precision: Precision = "float64", recorded=False, seed=5
) -> Kernel:
    begun = begin(condition, precision, recorded)
    arguments = kernel_arguments(condition, begun, [trials], seed, own_arrays, empty_array)
    kinds = types_on_card(arguments)
    with _without_card() as modules:
        ptx, _ = cuda.compile_ptx(trial_of_thread(begun.space), kinds, cc=COMPUTE_CAPABILITY)
    return Kernel(ptx, modules[-1], arguments, kinds, begun)


def compile_plain(plain: Any, kind: str, bits: str) -> str:
    """The kernel of benchmarks/plain_gpu.py."""
    tables, found, steps = plain.tables(kind), np.zeros((2, 2)), np.zeros(2, np.int64)
    kinds = tuple(map(typeof, (*tables, np.dtype(kind).type(0.7), 2, found, steps)))
    with _without_card():
        ptx, _ = cuda.compile_ptx(
            plain.make_kernel(kind, bits).py_func, kinds, cc=COMPUTE_CAPABILITY
        )
    return ptx


@contextlib.contextmanager
def _without_card():
    """Say for which card functions are compiled, and keep what they are compiled from."""
    device = types.SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    asked, compiled, modules = dispatcher.get_current_device, nvvm.compile_ir, []

    def keep(code, **options):
        modules.append(code)
        return compiled(code, **options)

    dispatcher.get_current_device, nvvm.compile_ir = lambda: device, keep
    try:
        yield modules
    finally:
        dispatcher.get_current_device, nvvm.compile_ir = asked, compiled
