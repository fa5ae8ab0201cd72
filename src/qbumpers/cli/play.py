"""`qbumpers play` and `qbumpers study`."""

import contextlib
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from qbumpers.cli.application import application
from qbumpers.cli.console import OUTPUT
from qbumpers.cli.working import Imports
from qbumpers.errors import RequestError, counted
from qbumpers.imports import import_modules

if TYPE_CHECKING:
    from qbumpers.experiments.participants import Exported
    from qbumpers.play.replaying import Replayed

study = typer.Typer(
    help="Studies with participants, and what was played in the browser.", no_args_is_help=True
)
application.add_typer(study, name="study")

_RECORDS = "play.sqlite"  # in the folder of --out
_DEFAULT = ("stochastic-q-bumpers", {"alpha": 0.5})

Records = Annotated[
    str,
    typer.Argument(
        help="What play recorded: a file, or the URL of a PostgreSQL database.", metavar="RECORDS"
    ),
]
Host = Annotated[
    str,
    typer.Option(
        help="Where to listen; elsewhere than on loopback only with TLS or behind a proxy.",
        metavar="ADDRESS",
    ),
]
Certificate = Annotated[Path | None, typer.Option(help="For TLS, in PEM.", metavar="FILE")]
Key = Annotated[Path | None, typer.Option(help="Of the certificate, in PEM.", metavar="FILE")]
BehindProxy = Annotated[
    str | None,
    typer.Option(
        help="Where a proxy serves it: https://study.example.org",
        metavar="URL",
        show_default=False,
    ),
]
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
Port = Annotated[int, typer.Option(help="0 for any that is free.", metavar="N")]
Browser = Annotated[bool, typer.Option(help="Open the page in the browser.")]
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
    host: Host = "127.0.0.1",
    port: Port = 8765,
    certificate: Certificate = None,
    key: Key = None,
    behind_proxy: BehindProxy = None,
    browser: Browser = True,
    out: Annotated[
        Path, typer.Option(help="Folder for the record of what is played.", metavar="DIR")
    ] = Path("results/play"),
    records: Annotated[
        str | None,
        typer.Option(
            help="PostgreSQL database for the record, which several servers may share.",
            show_default="a file in the folder of --out",
            metavar="URL",
        ),
    ] = None,
    imports: Imports = None,
) -> None:
    """Play a task in the browser, with an assistant.

    Any further option is one of the assistant's, as 'qbumpers list' shows them. Ctrl-C ends it.

    Example: qbumpers play lunar-lander --assistant stochastic-q-bumpers --alpha 0.7
    """
    check_installed()
    import_modules(imports or (), "--import")
    from qbumpers.play.addresses import Address
    from qbumpers.play.game import Choice
    from qbumpers.play.running import play as serve
    from qbumpers.play.setup import Setup
    from qbumpers.play.stores import place_of

    options = dict(options_in(context.args))
    if alpha is not None:
        options["alpha"] = alpha
    if assistant is None and not options:
        choice = Choice(*_DEFAULT)
    else:
        choice = Choice(assistant or _DEFAULT[0], options)
    address = Address(host, port, certificate, key, behind_proxy or "")
    address.check()  # before anything is solved
    setup = Setup(task, values, discount=discount)
    place = _database_at(records) if records is not None else out / _RECORDS

    def announce(url: str) -> None:
        OUTPUT.print(f"Play at [bold]{url}[/bold]", soft_wrap=True)
        where = escape(place_of(place))
        OUTPUT.print(f"The record goes into {where}; Ctrl-C ends it.", soft_wrap=True)

    with contextlib.suppress(KeyboardInterrupt):
        serve(setup, choice, place, address=address, browser=browser, announce=announce)
    OUTPUT.print("\nStopped; what was played is kept.")


def _database_at(records: str) -> str:
    from qbumpers.play.stores import is_url

    if not is_url(records):
        raise RequestError(
            f"records = {records!r}; postgresql://USER@HOST/DATABASE is needed, or --out for a file"
        )
    return records


def options_in(arguments: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Names and values of an assistant's options: `--p-max 0.9`, `--p-max=0.9`, `--second`.

    Args:
        arguments: of the command, those that are none of its own.

    Raises:
        RequestError: if one of them is no option.
    """
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
    records: Records,
    session: Annotated[
        list[str] | None,
        typer.Option(help="Only this one; may be repeated.", metavar="ID", show_default="all"),
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="Say it here, and show no page.")] = False,
    port: Port = 8766,
    browser: Browser = True,
    imports: Imports = None,
) -> None:
    """Decide recorded sessions again, say whether anything comes out differently, and show them.

    Exit status 1 if anything does. Ctrl-C ends the page.

    Example: qbumpers study replay results/play/play.sqlite
    """
    check_installed()
    import_modules(imports or (), "--import")
    from qbumpers.play.replaying import replay_file
    from qbumpers.play.running import show
    from qbumpers.play.showing import Showing
    from qbumpers.play.stores import shown
    from qbumpers.play.tables import open_records

    replayed: list[Replayed] = []
    for found in replay_file(records, session or ()):
        sizes = f"{counted(found.episodes, 'episode')}, {counted(found.steps, 'step')}"
        verdict = f"different: {found.difference}" if found.difference else "OK"
        line = f"{found.session} {found.task}: {sizes}: {verdict}"
        OUTPUT.print(escape(line), soft_wrap=True)
        replayed.append(found)
    if not check:
        if not replayed:
            raise RequestError(f"{shown(records)}: it has no session to be shown")
        showing = Showing(open_records(records, new=False), replayed)
        with contextlib.suppress(KeyboardInterrupt):
            show(showing, port=port, browser=browser, announce=_announce_replay)
    if any(found.difference for found in replayed):
        raise typer.Exit(1)


def _announce_replay(url: str) -> None:
    OUTPUT.print(f"Watch at [bold]{url}[/bold] ; Ctrl-C ends it.", soft_wrap=True)


@study.command("export")
def export(
    records: Annotated[
        str,
        typer.Argument(help="What play recorded, or a study file.", metavar="RECORDS|STUDY.toml"),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the files.", metavar="DIR")],
    mode: Annotated[
        str, typer.Option(help="Of a study: live, pilot or simulated.", metavar="MODE")
    ] = "live",
    folder: Annotated[
        Path | None,
        typer.Option(help="Of a study's records.", show_default="results/NAME", metavar="DIR"),
    ] = None,
    imports: Imports = None,
) -> None:
    """Write what was played as an experiment's files, a participant in the place of a trial.

    `qbumpers report`, `qbumpers fit` and `qbumpers.load` read them. A study is also written as a
    Psych-DS data set.

    Example: qbumpers study export results/play/play.sqlite --out results/played
    """
    check_installed()
    import_modules(imports or (), "--import")
    if records.endswith(".toml"):
        from qbumpers.cli.study_data import export_data

        export_data(Path(records), out, mode, folder)
        return
    from qbumpers.experiments.participants import STEPS, export_records

    for found in export_records(records, out):
        OUTPUT.print(
            f"[bold]{escape(found.task)}[/bold]: {counted(found.participants, 'participant')}, "
            f"{counted(found.episodes, 'episode')}, into {escape(str(found.folder))}",
            soft_wrap=True,
        )
        for text in _unfinished(found):
            OUTPUT.print(text, soft_wrap=True)
        OUTPUT.print(f"  qbumpers fit {escape(str(found.folder / STEPS))}", soft_wrap=True)
        if found.pairs:
            OUTPUT.print(f"  qbumpers report {escape(str(found.folder))}", soft_wrap=True)


def _unfinished(found: "Exported") -> Iterator[str]:
    """What is not in the tables of a report, in sentences."""
    if not found.pairs:
        yield "No unassisted episode follows an assisted one: there is nothing for a report."
    elif found.unpaired:
        yield (
            f"{counted(found.unpaired, 'episode')} not in the report, which compares each assisted "
            "episode with the unassisted one after it; played.parquet has all."
        )
    if found.unfinished:
        yield f"{counted(found.unfinished, 'episode')} did not end: steps are there, returns not."
    if found.idle:
        yield f"{counted(found.idle, 'session')} without a step."


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
