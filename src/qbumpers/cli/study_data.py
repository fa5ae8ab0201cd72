"""Commands of `qbumpers study` for what participants did."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from qbumpers.cli.play import check_installed, options_in, study
from qbumpers.cli.study import File, Folder, folder_of, say
from qbumpers.errors import RequestError, counted

if TYPE_CHECKING:
    from sqlalchemy import Engine

    from qbumpers.study.design.models import Study
    from qbumpers.study.outcomes.weighting import Weighted

Mode = Annotated[
    str, typer.Option("--mode", help="Which records: pilot, live or simulated.", metavar="MODE")
]


def _records(design: "Study", out: Path | None, mode: str) -> "Engine":
    """The records of a study that was served or simulated."""
    from qbumpers.study.flow.running import records_of
    from qbumpers.study.flow.tables import read_records

    return read_records(records_of(folder_of(out, design), mode))


def export_data(file: Path, to: Path, mode: str, folder: Path | None) -> None:
    """Export a study: for load, report and fit, and as a Psych-DS data set.

    Args:
        file: of the study.
        to: folder for the files.
        mode: which records.
        folder: of the records; results/NAME if None.
    """
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.outcomes.export import DATASET, export_study

    design = load_study(file)
    engine = _records(design, folder, mode)
    found = export_study(engine, design, check_playable(design), to)
    engine.dispose()
    say(f"{counted(found.participants, 'participant')} in {to / DATASET}")
    say(f"{counted(found.reported, 'complete one')} for: qbumpers report {to}")


@study.command("power")
def power_of_study(file: File, mode: Mode = "simulated", out: Folder = None) -> None:
    """Say how many participants the planned test needs, from those of a rehearsal.

    Example: qbumpers study power my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.outcomes.power import power_of
    from qbumpers.study.outcomes.reading import read_participants

    design = load_study(file)
    engine = _records(design, out, mode)
    found = power_of(design, read_participants(engine, design))
    first, second = found.analysis.arms
    say(
        f"{found.analysis.measure}: {first} {found.means[0]:.1f} (n = {found.arms[0]}), {second} "
        f"{found.means[1]:.1f} (n = {found.arms[1]}); d = {found.effect:.2f}"
    )
    say("per arm   power   95% interval   without an effect")
    plenty = next((place for place, row in enumerate(found.table) if row.power >= 0.99), None)
    for row in found.table[: None if plenty is None else plenty + 1]:
        say(f"{row.size:7d}   {row.power:5.2f}   {row.low:.2f} to {row.high:.2f}   {row.null:.2f}")
    most = found.table[-1].size
    low, needed, high = (
        str(n or f"more than {most}") for n in (found.low, found.needed, found.high)
    )
    say(f"For power {found.analysis.power}: {needed} per arm (95% interval {low} to {high}).")


@study.command(
    "estimate", context_settings={"allow_extra_args": True, "ignore_unknown_options": True}
)
def estimate_study(
    context: typer.Context,
    file: File,
    condition: Annotated[
        str, typer.Option(help="Whose assisted episodes are weighted.", metavar="NAME")
    ],
    mode: Mode = "live",
    out: Folder = None,
) -> None:
    """Estimate what assisted episodes would have come to under another setting of their rule.

    By importance weighting of the logged propensities (off-policy evaluation). Any further option
    is one of the condition's assistant, as 'qbumpers list' shows them.

    Example: qbumpers study estimate my-study.toml --condition bumpers --alpha 0.45
    """
    check_installed()
    from qbumpers.study.design.sources import check_playable, load_study
    from qbumpers.study.outcomes.reading import read_participants
    from qbumpers.study.outcomes.weighting import compare_settings

    changes = dict(options_in(context.args))
    design = load_study(file)
    setups = check_playable(design)
    engine = _records(design, out, mode)
    everybody = read_participants(engine, design)
    given = ", ".join(f"{option} = {number}" for option, number in changes.items())
    for found in compare_settings(design, setups, everybody, condition, changes):
        logged = found.logged
        say(
            f"{found.block}: {counted(logged.episodes, 'assisted episode')} of "
            f"{counted(logged.participants, 'participant')} in {condition}"
        )
        say(f"mean score as logged: {_interval(logged)}")
        say(f"with {given}: {_interval(found.other)}")
        say(f"effective sample size: {found.other.effective:.1f} episodes")


def _interval(found: "Weighted") -> str:
    return f"{found.mean:.1f} (95% interval {found.low:.1f} to {found.high:.1f})"


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
    from qbumpers.study.outcomes.deletion import forget

    if (participant is None) != identities:
        raise RequestError("forget: give the ID of a participant, or --identities")
    design = load_study(file)
    engine = _records(design, out, mode)
    if participant is None:
        say(f"identities deleted: {delete_identities(engine)}; what they did stays")
        return
    reached = forget(engine, design, check_playable(design), participant)
    say("deleted; a dated tombstone says that somebody was")
    for folder in reached:
        say(f"written anew without them: {folder}")


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
    from qbumpers.study.outcomes.reading import read_participants
    from qbumpers.study.outcomes.recruitment import identities_in, reconcile

    design = load_study(file)
    engine = _records(design, out, mode)
    everybody = read_participants(engine, design)
    found = reconcile(design, everybody, identities_in(engine), table)
    for each in found:
        say(f"{each.identity}: there {each.there}; here {each.here}")
    if found:
        raise typer.Exit(1)
    say("OK: both say the same")


@study.command("bonus")
def bonus_of_study(file: File, mode: Mode = "live", out: Folder = None) -> None:
    """Print the bonuses by the rule of the study, as Prolific takes them.

    Example: qbumpers study bonus my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import load_study
    from qbumpers.study.outcomes.reading import read_participants
    from qbumpers.study.outcomes.recruitment import bonus_table, identities_in

    design = load_study(file)
    engine = _records(design, out, mode)
    print(bonus_table(design, read_participants(engine, design), identities_in(engine)), end="")
