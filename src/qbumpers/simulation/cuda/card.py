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
from qbumpers.simulation.cuda.layout import LANES, WORD, Far, Space, changed, of_all, room_for_all
from qbumpers.simulation.outcomes import Outcomes, TrialMeans

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
    if SIMULATED:
        return Far(of_all(first, groups))
    shape = room_for_all(first.shape, groups)
    arrays = cuda.device_array(math.prod(shape), first.dtype)
    blocks, row = -(-arrays.size // THREADS), first.shape[-1] if first.ndim > 1 else 1
    with _unwarned():
        _spread[blocks, THREADS](cuda.to_device(first.reshape(-1)), row, arrays)
    return Far(arrays.reshape(shape))


@contextlib.contextmanager
def _unwarned() -> Iterator[None]:
    """Within the block, few threads are no fault: there are as many as trials."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*Grid size .* low occupancy")  # in colour, perhaps
        yield


def empty_array(shape: tuple[int, ...], kind: Any) -> Any:
    """An array to be filled, its first axis innermost."""
    return (np.zeros if SIMULATED else cuda.device_array)(shape, kind, order="F")


@cuda.jit
def _spread(first: Any, row: Any, arrays: Any) -> None:
    """Fill the arrays of all trials, in rows of so many numbers, with what one holds."""
    index = cuda.grid(1)
    if index < arrays.size:
        arrays[index] = first[(index // (LANES * row) * row + index % row) % first.size]


def sent(arguments: Any) -> Any:
    """Arguments of a kernel with the arrays that are the processor's sent to the card."""
    return arguments if SIMULATED else changed((np.ndarray, np.generic), _sent, arguments)


def launch(space: Space, arguments: Any, trials: int) -> None:
    """Run the kernel, and wait until it is done.

    Args:
        space: near memory of each trial.
        arguments: of the kernel, from `sent`.
        trials: threads.
    """
    kernel = _kernel(space, None if SIMULATED else types_on_card(arguments))
    # A card ends the thread in which something is raised; its simulator raises it, whatever it is.
    unheard = contextlib.suppress(Exception) if SIMULATED else contextlib.nullcontext()
    with _unwarned(), unheard:
        kernel[-(-trials // THREADS), THREADS, 0, SHARED_BYTES](*arguments)
    cuda.synchronize()


def means(outcomes: Outcomes, training: int) -> TrialMeans:
    """Means of each trial, found on the card.

    Args:
        outcomes: of the kernel, on the card.
        training: how many of the episodes, from the first one on, are training.
    """
    trials = outcomes.assisted_return.shape[0]
    found = TrialMeans(*(empty_array((trials,), np.float64) for _ in TrialMeans._fields))
    with _unwarned():
        _average[-(-trials // THREADS), THREADS](outcomes, training, found)
    return returned(found)


@cuda.jit
def _average(outcomes: Any, training: Any, found: Any) -> None:
    """Means of the trial whose place in the block is the number of the thread."""
    trial = cuda.grid(1)
    if trial < outcomes.assisted_return.shape[0]:
        assisted = unassisted = 0.0
        assisted_steps = unassisted_steps = overrides = 0
        for episode in range(training):
            assisted += outcomes.assisted_return[trial, episode]
            unassisted += outcomes.unassisted_return[trial, episode]
            assisted_steps += outcomes.assisted_length[trial, episode]
            unassisted_steps += outcomes.unassisted_length[trial, episode]
            overrides += outcomes.overrides[trial, episode]
        found.assisted_return[trial] = assisted / training
        found.unassisted_return[trial] = unassisted / training
        found.assisted_length[trial] = assisted_steps / training
        found.unassisted_length[trial] = unassisted_steps / training
        found.overrides[trial] = overrides / training


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
