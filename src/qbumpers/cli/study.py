"""Commands of `qbumpers study` that make, rehearse and serve studies with participants."""

import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from qbumpers.cli.console import OUTPUT
from qbumpers.cli.play import (
    BehindProxy,
    Browser,
    Certificate,
    Host,
    Key,
    Port,
    check_installed,
    study,
)
from qbumpers.errors import counted

if TYPE_CHECKING:
    from qbumpers.study.design.models import Study

File = Annotated[Path, typer.Argument(help="The study file.", metavar="STUDY.toml")]


def say(text: str) -> None:
    """Print a line, whatever is in it."""
    OUTPUT.print(escape(text), soft_wrap=True)


@study.command("new")
def new_study(file: File) -> None:
    """Write a study file to begin with, with comments.

    Example: qbumpers study new my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import write_new

    write_new(file)
    say(f"{file} is written: change it, then: qbumpers study check {file}")


@study.command("check")
def check_study(file: File) -> None:
    """Check a study file, and say what it comes to.

    Example: qbumpers study check my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import check_playable, load_study

    design = load_study(file)
    check_playable(design)
    for line in _described(design):
        say(line)
    _warn_of_identities(file, design)
    say("OK")


def _warn_of_identities(file: Path, design: "Study") -> None:
    if datetime.datetime.now(datetime.UTC).date() > design.keep_identities_until:
        say(
            f"Identities were to be kept until {design.keep_identities_until}: delete them, by "
            f"qbumpers study forget {file} --identities"
        )


def _described(design: "Study") -> list[str]:
    """What a study comes to, a line each."""
    from qbumpers.study.design.parts import Block, Sitting

    conditions = [condition.name for condition in design.all_conditions()]
    blocks = [
        f"{part.id} ({counted(len(part.plan()), 'episode')})"
        for part in design.parts
        if isinstance(part, Block)
    ]
    sittings = 1 + sum(isinstance(part, Sitting) for part in design.parts)
    return [
        f"{design.name}: {design.title}",
        f"parts: {', '.join(part.id for part in design.parts)}",
        f"sittings: {sittings}; blocks: {', '.join(blocks)}",
        f"{counted(len(conditions), 'condition')}: {', '.join(conditions)}",
        f"{counted(len(design.orders()), 'order')} of parts",
    ]


Folder = Annotated[
    Path | None,
    typer.Option(
        "--out", help="Folder of the records.", show_default="results/NAME", metavar="DIR"
    ),
]
Live = Annotated[
    bool, typer.Option("--live", help="The live records, of the study as it was frozen.")
]


def folder_of(out: Path | None, design: "Study") -> Path:
    """The folder of a study's records, results/NAME if none is given."""
    return out or Path("results") / design.name


@study.command("serve")
def serve_it(
    file: File,
    live: Live = False,
    out: Folder = None,
    host: Host = "127.0.0.1",
    port: Port = 8765,
    certificate: Certificate = None,
    key: Key = None,
    behind_proxy: BehindProxy = None,
    browser: Browser = True,
) -> None:
    """Serve a study: a pilot, or live as it was frozen. Ctrl-C ends it.

    Example: qbumpers study serve my-study.toml
    """
    check_installed()
    from qbumpers.play.addresses import Address
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.flow.running import opened, records_of, serve_study
    from qbumpers.study.flow.server import StudyHost

    address = Address(host, port, certificate, key, behind_proxy or "")
    address.check()
    design = load_study(file)
    setups = check_playable(design)
    _warn_of_identities(file, design)
    mode, folder = "live" if live else "pilot", folder_of(out, design)
    served = StudyHost(design, setups, opened(file, design, setups, folder, mode), mode)

    def announce(url: str) -> None:
        say(f"The study is at {url}; the records go into {records_of(folder, mode)}")
        say(f"The researcher's page is at {url}researcher; its token is {served.token}")
        say("Ctrl-C ends it.")

    try:
        serve_study(served, setups, address, browser=browser, announce=announce)
    except KeyboardInterrupt:
        OUTPUT.print("\nStopped; what happened is kept.")


@study.command("simulate")
def simulate_study(
    file: File,
    participants: Annotated[int, typer.Option(help="How many.", metavar="N", min=1)] = 30,
    browser: Annotated[
        bool, typer.Option("--browser", help="Through Chromium instead of the bare WebSocket.")
    ] = False,
    out: Folder = None,
) -> None:
    """Let simulated learners take part in a study, with drop-outs, reloads and slow ones.

    Example: qbumpers study simulate my-study.toml --participants 90
    """
    check_installed()
    from qbumpers.study.bots.browser import by_browser
    from qbumpers.study.bots.rehearsing import by_socket, rehearse, without_waiting
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.flow.running import opened, records_of

    design = load_study(file)
    setups = check_playable(design)
    folder = folder_of(out, design)
    engine = opened(file, design, setups, folder, "simulated")
    with OUTPUT.status(f"0 of {participants} participants") as status:
        done = 0

        def advance(_: object) -> None:
            nonlocal done
            done += 1
            status.update(f"{done} of {participants} participants")

        found = rehearse(
            without_waiting(design), setups, engine, participants,
            take_part=by_browser if browser else by_socket, at_once=1 if browser else 8,
            advance=advance,
        )  # fmt: skip
    for outcome, count in sorted(found.outcomes.items()):
        say(f"{outcome}: {counted(count, 'participant')}")
    say(f"{counted(found.reloads, 'reload')}; the records are in {records_of(folder, 'simulated')}")


@study.command("freeze")
def freeze_study(file: File) -> None:
    """Freeze a study for a preregistration: one JSON, a readable page, and a hash.

    Example: qbumpers study freeze my-study.toml
    """
    check_installed()
    from qbumpers.study.design.freezing import freeze, frozen_path
    from qbumpers.study.design.sources import check_playable, load_study

    design = load_study(file)
    digest = freeze(file, design, check_playable(design))
    say(f"{frozen_path(file)} and its page are written; SHA-256 {digest}")


@study.command("backup")
def back_up_study(
    file: File,
    copy: Annotated[Path, typer.Argument(help="Path of the copy.", metavar="COPY")],
    live: Live = False,
    out: Folder = None,
) -> None:
    """Copy the records of a study, which may be running.

    Example: qbumpers study backup my-study.toml monday.sqlite --live
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.flow.running import back_up, records_of

    folder = folder_of(out, load_study(file))
    back_up(records_of(folder, "live" if live else "pilot"), copy)
    say(f"{copy} is written")


@study.command("restore")
def restore_study(
    file: File,
    copy: Annotated[Path, typer.Argument(help="A backup.", metavar="COPY")],
    live: Live = False,
    out: Folder = None,
) -> None:
    """Put a backup into the place of records that are lost.

    Example: qbumpers study restore my-study.toml monday.sqlite --live
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.flow.running import records_of, restore

    records = records_of(folder_of(out, load_study(file)), "live" if live else "pilot")
    restore(copy, records)
    say(f"{records} is as {copy}")
