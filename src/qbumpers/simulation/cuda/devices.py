"""Which device simulates, and one sentence on why there is none."""

import importlib.util
import re
from typing import Any, Literal, NamedTuple, get_args

from qbumpers.compilation import compiles, shortened
from qbumpers.errors import RequestError, counted, unknown_name

PROCESSOR, GPU = "processor", "gpu"

Precision = Literal["float64", "float32"]

REVISION: int = 1
"""Raised when cards give other trials by anything that processors have no part in."""


class Card(NamedTuple):
    """A graphics card that simulates.

    Attributes:
        number: of the card, as its driver counts them.
        precision: in which it keeps tables, values and rewards.
    """

    number: int = 0
    precision: Precision = "float64"


def is_gpu(device: str) -> bool:
    """Whether a text names a graphics card, whatever else is wrong with it."""
    return device == GPU or device.startswith(f"{GPU}:")


def device_of(device: str, precision: str = "float64") -> Card | None:
    """The card that a text names, if it can be used here; None for the processor.

    Args:
        device: "processor", "gpu", or the number of a card too, as "gpu:1".
        precision: "float64" or, on a card alone, "float32".

    Raises:
        RequestError: if it names nothing, or what it names is not here.
    """
    if precision not in get_args(Precision):
        raise unknown_name("precision", precision, get_args(Precision))
    if device == PROCESSOR:
        if precision != "float64":
            raise RequestError(f"precision = {precision!r}; a processor simulates in 'float64'")
        return None
    found = re.fullmatch(rf"{GPU}(:\d+)?", device)
    if found is None:
        raise RequestError(
            f"device = {device!r}; {PROCESSOR!r}, {GPU!r} or the number of a card, as '{GPU}:1', "
            "is needed"
        )
    card = Card(int((found[1] or ":0")[1:]), precision)  # type: ignore[arg-type]
    _check(device, card.number)
    return card


def _check(device: str, number: int) -> None:
    where = f"device = {device!r}"
    if importlib.util.find_spec("numba_cuda") is None:
        raise RequestError(
            f"{where}: the extra gpu is not installed; pip install 'qbumpers[gpu]' installs it"
        )
    from numba import cuda
    from numba.core import config

    if config.ENABLE_CUDASIM:  # type: ignore[attr-defined]
        return
    if not compiles():
        raise RequestError(f"{where}: with NUMBA_DISABLE_JIT=1 nothing is compiled for it")
    cards = _cards(where, cuda)
    if number >= cards:
        verb = "is" if cards == 1 else "are"
        raise RequestError(f"{where}: there {verb} {counted(cards, 'card')} here, counted from 0")
    driver, needed = cuda.driver.driver.get_version(), cuda.runtime.get_version()
    if driver[0] < needed[0]:
        raise RequestError(
            f"{where}: the driver of the card is one of CUDA {driver[0]}.{driver[1]}; one of CUDA "
            f"{needed[0]} or later is needed"
        )


def _cards(where: str, cuda: Any) -> int:
    try:
        return len(cuda.gpus)
    except cuda.CudaSupportError as error:
        reason = " ".join(str(error).split()).rstrip(" :")
        raise RequestError(f"{where}: no NVIDIA card can be used here: {reason}") from error


_NAMES = re.compile(r"Function\(<function ([a-z]\w*) at")
_ALLOCATES = ("NRT required", "Only accept returning of array")


def why_not_compiled(error: BaseException) -> str:
    """What an error of the compiler for cards means, in words.

    Args:
        error: of Numba, which tells of every function on the way to what is wrong.
    """
    names = _NAMES.findall(str(error))
    if names and any(phrase in str(error) for phrase in _ALLOCATES):
        return (
            f"{names[-1]} makes an array, which a GPU cannot; qbumpers.borrowing.scratch gives one "
            "for a step"
        )
    return f"{names[-1]}: {shortened(error)}" if names else shortened(error)
