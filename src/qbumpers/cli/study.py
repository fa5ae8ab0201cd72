"""Commands of `qbumpers study` for studies with participants."""

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
from qbumpers.errors import RequestError, counted

if TYPE_CHECKING:
    from qbumpers.study.design.models import Study

File = Annotated[Path, typer.Argument(help="The study file.", metavar="STUDY.toml")]


def _say(text: str) -> None:
    OUTPUT.print(escape(text), soft_wrap=True)


@study.command("new")
def new_study(file: File) -> None:
    """Write a study file to begin with, with comments.

    Example: qbumpers study new my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import write_new

    write_new(file)
    _say(f"{file} is written: change it, then: qbumpers study check {file}")


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
        _say(line)
    _warn_of_identities(file, design)
    _say("OK")


def _warn_of_identities(file: Path, design: "Study") -> None:
    if datetime.datetime.now(datetime.UTC).date() > design.keep_identities_until:
        _say(
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


def _folder(out: Path | None, design: "Study") -> Path:
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
    mode, folder = "live" if live else "pilot", _folder(out, design)
    served = StudyHost(design, setups, opened(file, design, setups, folder, mode), mode)

    def announce(url: str) -> None:
        _say(f"The study is at {url}; the records go into {records_of(folder, mode)}")
        _say(f"The researcher's page is at {url}researcher; its token is {served.token}")
        _say("Ctrl-C ends it.")

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
    folder = _folder(out, design)
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
        _say(f"{outcome}: {counted(count, 'participant')}")
    _say(
        f"{counted(found.reloads, 'reload')}; the records are in {records_of(folder, 'simulated')}"
    )


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
    _say(f"{frozen_path(file)} and its page are written; SHA-256 {digest}")


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

    folder = _folder(out, load_study(file))
    back_up(records_of(folder, "live" if live else "pilot"), copy)
    _say(f"{copy} is written")


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

    records = records_of(_folder(out, load_study(file)), "live" if live else "pilot")
    restore(copy, records)
    _say(f"{records} is as {copy}")


Mode = Annotated[
    str, typer.Option("--mode", help="Which records: pilot, live or simulated.", metavar="MODE")
]


def export_data(file: Path, to: Path, mode: str, folder: Path | None) -> None:
    """Export a study: for load, report and fit, and as a Psych-DS data set.

    Args:
        file: path of the study file.
        to: folder for the files.
        mode: which records.
        folder: of the records; results/NAME if None.
    """
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.export import DATASET, export_study

    design = load_study(file)
    engine = read_records(records_of(_folder(folder, design), mode))
    found = export_study(engine, design, check_playable(design), to)
    engine.dispose()
    _say(f"{counted(found.participants, 'participant')} in {to / DATASET}")
    _say(f"{counted(found.reported, 'complete one')} for: qbumpers report {to}")


@study.command("power")
def power_of_study(file: File, mode: Mode = "simulated", out: Folder = None) -> None:
    """Say how many participants the planned test needs, from those of a rehearsal.

    Example: qbumpers study power my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.power import power_of
    from qbumpers.study.outcomes.reading import read_participants

    design = load_study(file)
    engine = read_records(records_of(_folder(out, design), mode))
    found = power_of(design, read_participants(engine, design))
    first, second = found.analysis.arms
    _say(
        f"{found.analysis.measure}: {first} {found.means[0]:.1f} (n = {found.arms[0]}), {second} "
        f"{found.means[1]:.1f} (n = {found.arms[1]}); d = {found.effect:.2f}"
    )
    _say("per arm   power   95% interval   without an effect")
    plenty = next((place for place, row in enumerate(found.table) if row.power >= 0.99), None)
    for row in found.table[: None if plenty is None else plenty + 1]:
        _say(f"{row.size:7d}   {row.power:5.2f}   {row.low:.2f} to {row.high:.2f}   {row.null:.2f}")
    most = found.table[-1].size
    low, needed, high = (
        str(n or f"more than {most}") for n in (found.low, found.needed, found.high)
    )
    _say(f"For power {found.analysis.power}: {needed} per arm (95% interval {low} to {high}).")


@study.command("forget")
def forget_participant(
    file: File,
    participant: Annotated[
        str | None, typer.Argument(help="Identifier, or PROLIFIC_PID or class code.", metavar="ID")
    ] = None,
    identities: Annotated[
        bool, typer.Option("--identities", help="Delete all identities instead; data stay.")
    ] = False,
    mode: Mode = "live",
    out: Folder = None,
) -> None:
    """Delete everything of a participant, exports included, and leave a dated tombstone.

    Example: qbumpers study forget my-study.toml 4f1c0a9d2b7e6c85
    """
    check_installed()
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.flow.forgetting import delete_identities
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.deletion import forget

    if (participant is None) != identities:
        raise RequestError("forget: give the ID of a participant, or --identities")
    design = load_study(file)
    engine = read_records(records_of(_folder(out, design), mode))
    if participant is None:
        _say(f"identities deleted: {delete_identities(engine)}; what they did stays")
        return
    reached = forget(engine, design, check_playable(design), participant)
    _say("deleted; a dated tombstone says that somebody was")
    for folder in reached:
        _say(f"written anew without them: {folder}")


@study.command("reconcile")
def reconcile_study(
    file: File,
    table: Annotated[
        Path, typer.Argument(help="Submissions as Prolific exports them.", metavar="TABLE.csv")
    ],
    mode: Mode = "live",
    out: Folder = None,
) -> None:
    """Compare with Prolific's table: who completed there and not here, and the reverse.

    Exit status 1 if there is any.

    Example: qbumpers study reconcile my-study.toml prolific_export.csv
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.reading import read_participants
    from qbumpers.study.outcomes.recruitment import identities_in, reconcile

    design = load_study(file)
    engine = read_records(records_of(_folder(out, design), mode))
    everybody = read_participants(engine, design)
    found = reconcile(design, everybody, identities_in(engine), table)
    for each in found:
        _say(f"{each.identity}: there {each.there}; here {each.here}")
    if found:
        raise typer.Exit(1)
    _say("OK: both say the same")


@study.command("bonus")
def bonus_of_study(file: File, mode: Mode = "live", out: Folder = None) -> None:
    """Print the bonuses by the rule of the study, as Prolific takes them.

    Example: qbumpers study bonus my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.reading import read_participants
    from qbumpers.study.outcomes.recruitment import bonus_table, identities_in

    design = load_study(file)
    engine = read_records(records_of(_folder(out, design), mode))
    print(bonus_table(design, read_participants(engine, design), identities_in(engine)), end="")
