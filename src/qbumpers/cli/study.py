"""`qbumpers play` and `qbumpers study`."""

import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from qbumpers.cli.application import application
from qbumpers.cli.console import OUTPUT
from qbumpers.cli.working import Imports
from qbumpers.errors import RequestError, counted
from qbumpers.imports import import_modules

study = typer.Typer(
    help="Studies with participants, and what was played in the browser.", no_args_is_help=True
)
application.add_typer(study, name="study")

_DEFAULT = ("stochastic-q-bumpers", {"alpha": 0.5})

Alpha = Annotated[
    float | None,
    typer.Option(help="How much the assistant leaves to you.", metavar="SHARE"),
]
Values = Annotated[
    Path | None,
    typer.Option(
        help="Q* of the assistant.",
        show_default="solved, or the shipped expert's",
        metavar="FILE",
    ),
]
Discount = Annotated[
    float | None, typer.Option(help="Of a Gymnasium environment, which has none.", metavar="NUMBER")
]


@application.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def play(
    context: typer.Context,
    task: Annotated[
        str, typer.Argument(help="Name of a task, or of a Gymnasium environment.", metavar="TASK")
    ],
    assistant: Annotated[
        str | None,
        typer.Option(
            help="Who assists; the page can change it.",
            show_default="stochastic-q-bumpers with alpha = 0.5",
            metavar="NAME",
        ),
    ] = None,
    alpha: Alpha = None,
    values: Values = None,
    discount: Discount = None,
    port: Annotated[int, typer.Option(help="Of this machine; 0 for any.", metavar="N")] = 8765,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    out: Annotated[
        Path, typer.Option(help="Folder for the record of what is played.", metavar="DIR")
    ] = Path("results/play"),
    imports: Imports = None,
) -> None:
    """Play a task in the browser, with an assistant.

    Any further option is one of the assistant's, as 'qbumpers list' shows them. Ctrl-C ends it.

    Example: qbumpers play lunar-lander --assistant stochastic-q-bumpers --alpha 0.7
    """
    check_installed()
    import_modules(imports or (), "--import")
    from qbumpers.study.game import Choice
    from qbumpers.study.running import play as serve
    from qbumpers.study.setup import Setup

    options = dict(_options_in(context.args))
    if alpha is not None:
        options["alpha"] = alpha
    if assistant is None and not options:
        choice = Choice(*_DEFAULT)
    else:
        choice = Choice(assistant or _DEFAULT[0], options)
    setup = Setup(task, values, discount=discount)
    try:
        serve(setup, choice, out, port=port, browser=browser, announce=_announce)
    except KeyboardInterrupt:
        OUTPUT.print("\nStopped; what was played is kept.")


def _announce(url: str, records: Path) -> None:
    OUTPUT.print(f"Play at [bold]{url}[/bold]", soft_wrap=True)
    OUTPUT.print(f"The record goes into {escape(str(records))}; Ctrl-C ends it.", soft_wrap=True)


def _options_in(arguments: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Names and values of an assistant's options: `--p-max 0.9`, `--p-max=0.9`, `--second`."""
    waiting = list(arguments)
    while waiting:
        name = waiting.pop(0)
        if not name.startswith("--"):
            raise RequestError(f"argument {name!r}: an option of the assistant begins with --")
        option, equals, text = name.removeprefix("--").partition("=")
        if not equals:
            valued = bool(waiting) and not waiting[0].startswith("--")
            text = waiting.pop(0) if valued else "true"
        yield option.replace("-", "_"), _value_of(text)


def _value_of(text: str) -> Any:
    """A value as a TOML file would have it; a text needs no quotation marks."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


@study.command("replay")
def replay_records(
    file: Annotated[Path, typer.Argument(help="What play recorded.", metavar="FILE")],
    imports: Imports = None,
) -> None:
    """Decide recorded sessions again, and say whether anything comes out differently.

    Example: qbumpers study replay results/play/play.sqlite
    """
    check_installed()
    import_modules(imports or (), "--import")
    from qbumpers.study.replaying import replay_file

    different = 0
    for found in replay_file(file):
        sizes = f"{counted(found.episodes, 'episode')}, {counted(found.steps, 'step')}"
        verdict = f"different: {found.difference}" if found.difference else "OK"
        line = f"{found.session} {found.task}: {sizes}: {verdict}"
        OUTPUT.print(escape(line), soft_wrap=True)
        different += bool(found.difference)
    if different:
        raise typer.Exit(1)


def check_installed() -> None:
    """Check that the extra `study` is installed; RequestError naming what is missing if not."""
    try:
        import itsdangerous as itsdangerous
        import msgspec as msgspec
        import sqlalchemy as sqlalchemy
        import starlette as starlette
        import uvicorn as uvicorn
        import websockets as websockets
    except ImportError as error:
        raise RequestError(f"{error.name} is missing; pip install 'qbumpers[study]'") from error
