"""Options that long work has in common: where it is done, and where its results go."""

import contextlib
from collections.abc import Generator
from typing import TYPE_CHECKING, Annotated

import typer

from qbumpers.cli.console import OUTPUT
from qbumpers.errors import RequestError

if TYPE_CHECKING:
    from qbumpers.experiments.run import Backend
    from qbumpers.simulation import Card

Imports = Annotated[
    list[str] | None,
    typer.Option(
        "--import",
        help="Import this first: it registers tasks, assistants or learners. May be repeated.",
        metavar="MODULE",
    ),
]
Workers = Annotated[
    int | None, typer.Option(help="Cores to use.", show_default="all cores", metavar="N", min=1)
]
On = Annotated[
    str | None,
    typer.Option(
        "--on",
        help="Run on a graphics card: 'gpu', or 'gpu:1' for the second one; or on a Ray cluster: "
        "its address, or 'local' for a Ray of its own.",
        metavar="gpu|ADDRESS",
    ),
]
PrecisionOfCard = Annotated[
    str | None,
    typer.Option(
        "--precision",
        help="In which a graphics card keeps tables, values and rewards.",
        show_default="float64",
        metavar="float64|float32",
    ),
]
Out = Annotated[
    str | None,
    typer.Option(
        help="Folder for the results, or a URL of an object store.",
        show_default="results/NAME",
        metavar="DIR",
    ),
]


def card_for(workers: int | None, on: str | None, precision: str | None) -> "Card | None":
    """The graphics card that is asked for; None if none is.

    Raises:
        RequestError: if it cannot be used, or other options do not go with it.
    """
    from qbumpers.simulation.cuda.devices import device_of, is_gpu

    if on is None or not is_gpu(on):
        if precision is not None:
            raise RequestError(f"--precision {precision}: only with --on gpu")
        return None
    if workers is not None:
        raise RequestError(f"--workers {workers} --on {on}: cores, or a graphics card; give one")
    return device_of(on, precision or "float64")


@contextlib.contextmanager
def backend_for(
    workers: int | None, on: str | None, card: "Card | None"
) -> Generator["Backend", None, None]:
    """Where cells are worked on: cores of this machine, a graphics card, or a Ray cluster."""
    from qbumpers.experiments.local import ThisMachine
    from qbumpers.experiments.on_card import GraphicsCard

    if card is not None:
        yield GraphicsCard(card)
        return
    if on is None:
        yield ThisMachine(workers)
        return
    if workers is not None:
        raise RequestError(
            f"--workers {workers} --on {on}: threads of this machine, or a cluster; give one"
        )
    from qbumpers.experiments.cluster import RayCluster

    with contextlib.ExitStack() as stack:
        with OUTPUT.status("connecting to Ray"):
            cluster = stack.enter_context(RayCluster(on))
        yield cluster
