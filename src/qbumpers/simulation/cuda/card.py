"""The card itself: its memory, and the kernels that are compiled for it.

With `NUMBA_ENABLE_CUDASIM=1` and `NUMBA_DISABLE_JIT=1` there is no card: threads of Python do what
those of a card would, in the processor's memory.
"""

import contextlib
import functools
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from numba import cuda as numba_cuda
from numba import typeof
from numba.core import config, types

from qbumpers.simulation.cuda.devices import Card
from qbumpers.simulation.cuda.kernel import trial_of_thread
from qbumpers.simulation.cuda.layout import LANES, WORD, Far, Space, changed

cuda: Any = numba_cuda

SIMULATED: bool = bool(config.ENABLE_CUDASIM)  # type: ignore[attr-defined]

THREADS = 128
"""Threads of a block of the card."""

SHARED_BYTES = 3 * WORD * THREADS
"""Shared memory of a block of the card: three words for each thread."""

_SIMULATED_BYTES = 1 << 30

if not SIMULATED:
    from qbumpers.simulation.cuda import device_code  # noqa: F401


class _NoneAsNumber:
    """Passes None to a kernel, whose code never looks at it, as a number."""

    def prepare_args(self, kind: Any, value: Any, **_: Any) -> tuple[Any, Any]:
        """What is passed for an argument of a type."""
        return (types.uint64, 0) if kind == types.none else (kind, value)


@contextlib.contextmanager
def chosen(card: Card) -> Iterator[None]:
    """Within the block, arrays and kernels are those of a card."""
    cuda.select_device(card.number)
    yield


def free_bytes(card: Card) -> int:
    """Free memory of a card."""
    if SIMULATED:
        return _SIMULATED_BYTES
    with chosen(card):
        return int(cuda.current_context().get_memory_info().free)


def own_arrays(first: np.ndarray, groups: int) -> Far:
    """Arrays of all trials of a block, each of which holds what a trial begins with.

    Args:
        first: what that is.
        groups: of `LANES` trials.
    """
    shape = (groups, *first.shape, LANES)
    if SIMULATED:
        return Far(np.broadcast_to(first[..., None], shape).copy())
    arrays = cuda.device_array(math.prod(shape), first.dtype)
    blocks = -(-arrays.size // THREADS)
    _spread[blocks, THREADS](cuda.to_device(first.reshape(-1)), arrays)
    return Far(arrays.reshape(shape))


def empty_array(shape: tuple[int, ...], kind: Any) -> Any:
    """An array to be filled, its first axis innermost."""
    return (np.zeros if SIMULATED else cuda.device_array)(shape, kind, order="F")


@cuda.jit
def _spread(first: Any, arrays: Any) -> None:
    """Fill arrays, laid out one after another with `LANES` innermost, with what one holds."""
    index = cuda.grid(1)
    if index < arrays.size:
        arrays[index] = first[index // LANES % first.size]


def launch(space: Space, arguments: Any, trials: int) -> Any:
    """Run the kernel, and wait until it is done.

    Args:
        space: near memory of each trial.
        arguments: of the kernel; arrays of the processor are sent to the card.
        trials: threads.

    Returns:
        The arguments as they are then, their arrays on the card.
    """
    kernel = _kernel(space, None if SIMULATED else types_on_card(arguments))
    sent = arguments if SIMULATED else changed((np.ndarray, np.generic), _sent, arguments)
    # A card ends the thread in which something is raised; its simulator raises it, whatever it is.
    unheard = contextlib.suppress(Exception) if SIMULATED else contextlib.nullcontext()
    with warnings.catch_warnings(), unheard:
        warnings.filterwarnings("ignore", "Grid size .* low occupancy")
        kernel[-(-trials // THREADS), THREADS, 0, SHARED_BYTES](*sent)
    cuda.synchronize()
    return sent


def returned(found: Any) -> Any:
    """What a kernel found, in arrays of the processor."""
    if SIMULATED:
        return found
    on_card = cuda.devicearray.DeviceNDArray
    return changed(on_card, lambda array: array.copy_to_host(), found)


def _sent(part: Any) -> Any:
    """An array on the card, or a number as a number of Python."""
    return cuda.to_device(part) if isinstance(part, np.ndarray) else part.item()


@functools.cache
def _kernel(space: Space, kinds: tuple[Any, ...] | None) -> Any:
    settings: dict[str, Any] = {} if SIMULATED else {"extensions": [_NoneAsNumber()]}
    return cuda.jit(kinds, **settings)(trial_of_thread(space))


def types_on_card(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """The types that code of a card has for arguments, wherever their arrays are."""

    def example(array: Any) -> np.ndarray:
        order = "C" if array.flags["C_CONTIGUOUS"] else "F"
        return np.empty((2,) * array.ndim, array.dtype, order)

    kinds = np.ndarray if SIMULATED else (np.ndarray, cuda.devicearray.DeviceNDArray)
    return tuple(typeof(changed(kinds, example, each)) for each in arguments)
