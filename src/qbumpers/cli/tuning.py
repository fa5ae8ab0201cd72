"""`qbumpers tune`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import OUTPUT, expert_warnings_printed, interval, table
from qbumpers.cli.progress import TrialProgress
from qbumpers.cli.working import (
    Imports,
    On,
    Out,
    PrecisionOfCard,
    Workers,
    backend_for,
    card_for,
)
from qbumpers.errors import counted

if TYPE_CHECKING:
    from qbumpers.tuning import Contender, Tuning


@application.command()
def tune(
    experiment: Annotated[
        Path, typer.Argument(help="An experiment file.", metavar="EXPERIMENT.toml")
    ],
    floor: Annotated[
        float,
        typer.Option(help="Mean return that the assistant must stay above.", metavar="RETURN"),
    ],
    confidence: Annotated[
        float, typer.Option(help="That the choice is above the floor.", metavar="SHARE")
    ] = 0.95,
    imports: Imports = None,
    workers: Workers = None,
    on: On = None,
    precision: PrecisionOfCard = None,
    out: Out = None,
) -> None:
    """Find the assistant that teaches best among those that perform above a floor.

    Races the conditions of an experiment against each other: what is clearly no choice stops
    early. The winner is measured anew, so that its numbers do not flatter it. Trials are kept;
    'qbumpers run' with the same file and folder uses them.

    Example: qbumpers tune experiment.toml --floor 50 --out results/tuning
    """
    from qbumpers import tuning
    from qbumpers.experiments.plan import make_plan
    from qbumpers.experiments.sources import load_experiment

    with stoppable():
        card = card_for(workers, on, precision)
        with expert_warnings_printed():
            plan = make_plan(load_experiment(experiment, imports=imports or ()), card=card)
        folder = out or f"results/{plan.experiment.name}"
        verb = "races" if len(plan.named) == 1 else "race"
        OUTPUT.print(
            f"[bold]{plan.experiment.name}[/bold]: {counted(len(plan.named), 'condition')} {verb}, "
            f"up to {counted(plan.experiment.trials, 'trial')} of "
            f"{counted(plan.experiment.episodes, 'episode')} each, into {escape(folder)}",
            soft_wrap=True,
        )
        with (
            backend_for(workers, on, card) as backend,
            TrialProgress("racing", _silent) as progress,
        ):
            found = tuning.tune(
                plan, folder, floor, confidence=confidence, backend=backend, report=progress.show
            )
        OUTPUT.print(_contenders(found))
        OUTPUT.print(_cost(found))
        if found.choice is None:
            OUTPUT.print(_no_choice(found), soft_wrap=True)
            raise typer.Exit(1)
        OUTPUT.print(_choice(found.choice, floor, confidence), soft_wrap=True)


def _silent(_: object) -> None:
    """A race cannot tell beforehand how long it will take."""


def _contenders(found: "Tuning") -> Table:
    listing = table("condition", "trials", "assisted", "unassisted", "verdict")
    for column in listing.columns:
        column.no_wrap = column.header != "condition"
    for each in sorted(found.contenders, key=lambda one: one is not found.choice):
        numbers = (interval(*each.assisted), interval(*each.unassisted))
        listing.add_row(each.condition, str(each.trials), *numbers, each.verdict)
    return listing


def _cost(found: "Tuning") -> str:
    share = found.trials / found.grid_trials
    return (
        f"{counted(found.trials, 'trial')}, {share:.0%} of the full grid's {found.grid_trials:,}."
    )


def _no_choice(found: "Tuning") -> str:
    nearest = found.nearest
    return (
        f"[bold]No choice[/bold]: no condition is significantly above {found.floor:g}. The "
        f"nearest is {nearest.condition}, {interval(*nearest.assisted)} assisted."
    )


def _choice(choice: "Contender", floor: float, confidence: float) -> str:
    return (
        f"[bold]Choice: {choice.condition}[/bold] returns {interval(*choice.assisted)} "
        f"assisted, above {floor:g} with {confidence:.0%} confidence, and "
        f"{interval(*choice.unassisted)} unassisted."
    )
