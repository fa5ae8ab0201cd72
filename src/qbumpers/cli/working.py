"""Options that long work has in common: where it is done, and where its results go."""

import contextlib
from collections.abc import Generator
from typing import TYPE_CHECKING, Annotated

import typer

from qbumpers.cli.console import OUTPUT
from qbumpers.errors import RequestError

if TYPE_CHECKING:
    from qbumpers.experiments.run import Backend

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
        help="Run on a Ray cluster: its address, or 'local' for a Ray of its own.",
        metavar="ADDRESS",
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


@contextlib.contextmanager
def backend_for(workers: int | None, on: str | None) -> Generator["Backend", None, None]:
    """Where cells are worked on: cores of this machine, or a Ray cluster."""
    from qbumpers.experiments.local import ThisMachine

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
