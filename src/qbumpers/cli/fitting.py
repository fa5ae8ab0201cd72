"""`qbumpers fit`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import rich.progress
import typer
from rich.markup import escape
from rich.table import Table

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import OUTPUT, print_warning, table
from qbumpers.cli.working import Imports
from qbumpers.errors import RequestError, counted

if TYPE_CHECKING:
    from qbumpers.fitting import Fitted

_LARGE_ERROR = 1.0  # of a log-likelihood; twice that tells two models apart


Steps = Annotated[
    str,
    typer.Argument(
        help="Recorded steps: a Parquet file, or a Minari dataset by its name or folder.",
        metavar="STEPS",
    ),
]
Learners = Annotated[
    str | None,
    typer.Option(
        help="Learners to compare.", show_default="all of tables", metavar="NAME,NAME,..."
    ),
]
Perceptions = Annotated[
    str | None,
    typer.Option(
        help="Perceptions to compare.",
        show_default="transition,observant,interruption",
        metavar="NAME,NAME,...",
    ),
]
Participants = Annotated[
    int | None,
    typer.Option(help="Only the first ones.", show_default="all", metavar="N", min=1),
]
Free = Annotated[
    str | None,
    typer.Option(
        help="Further parameters to estimate, for example lapse,discount.",
        metavar="NAME,NAME,...",
    ),
]
Fixed = Annotated[
    str | None,
    typer.Option(
        help="Parameters that are known, for example discount=0.99.", metavar="NAME=NUMBER,..."
    ),
]
Training = Annotated[
    int | None,
    typer.Option(
        help="Episodes over which schedules are counted.",
        show_default="those recorded",
        metavar="N",
        min=1,
    ),
]
Folds = Annotated[
    int, typer.Option(help="Every so many episodes are held out together.", metavar="N", min=2)
]
Particles = Annotated[
    int, typer.Option(help="Simulated learners, if something is hidden.", metavar="N", min=1)
]
Seed = Annotated[int, typer.Option(help="Of starting points and particles.", metavar="N", min=0)]
Out = Annotated[Path | None, typer.Option(help="Folder for tables as CSV.", metavar="DIR")]


@application.command()
def fit(
    steps: Steps,
    learners: Learners = None,
    perceptions: Perceptions = None,
    participants: Participants = None,
    free: Free = None,
    fixed: Fixed = None,
    training: Training = None,
    folds: Folds = 2,
    particles: Particles = 100,
    seed: Seed = 0,
    imports: Imports = None,
    out: Out = None,
) -> None:
    """Find the learner that explains recorded choices best.

    Fits every learner to every participant, and compares them by what they give to proposals that
    were held out.

    Example: qbumpers fit steps.parquet --learners q-learning,softmax-q-learning --out fitted
    """
    from qbumpers.experiments.steps import load_steps
    from qbumpers.fitting import fit as fit_learners
    from qbumpers.fitting.compare import CHANCE
    from qbumpers.imports import import_modules

    with stoppable():
        import_modules(imports or (), "--import")
        if out is not None:
            _check_out(out)
        everybody = load_steps(steps)
        people = dict([*everybody.items()][:participants])
        total = sum(len(each.episode) for each in people.values())
        OUTPUT.print(f"{counted(len(people), 'participant')}, {counted(total, 'step')}")
        with rich.progress.Progress(console=OUTPUT, transient=True) as bar:
            task = bar.add_task("fitting", total=None)
            found = fit_learners(
                people,
                learners=_names(learners),
                perceptions=_names(perceptions),
                free=_names(free) or (),
                fixed=_numbers(fixed),
                training=training,
                folds=folds,
                particles=particles,
                seed=seed,
                report=lambda done: bar.update(task, completed=done.done, total=done.of),
            )
        OUTPUT.print(_models(found))
        if found.models["learner"][0] != CHANCE:
            _print_estimates(found)
        OUTPUT.print(_verdict(found), soft_wrap=True)
        _warn_of_error(found)
        if out is not None:
            _write(found, out)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [part.strip() for part in text.split(",")]


def _numbers(text: str | None) -> dict[str, float]:
    found: dict[str, float] = {}
    for part in _names(text) or ():
        name, _, number = part.partition("=")
        try:
            found[name] = float(number)
        except ValueError as error:
            raise RequestError(
                f"fixed = {part!r}; names with numbers are needed, for example discount=0.99"
            ) from error
    return found


def _models(found: "Fitted") -> Table:
    listing = table("model", "held out", "each", "behind", "95%", "best for", "BIC")
    for column in listing.columns:
        column.no_wrap = column.header != "model"
    for row in found.models.iter_rows(named=True):
        known = row["low"] is not None
        listing.add_row(
            row["model"],
            f"{row['held_out']:.1f}",
            f"{row['probability']:.3f}",
            f"{row['behind']:.1f}",
            f"{row['low']:.1f} to {row['high']:.1f}" if known else "-",
            str(row["best_for"]),
            f"{row['bic']:.0f}",
        )
    return listing


def _print_estimates(found: "Fitted") -> None:
    """Of the best model: intervals of the only participant, or means and ranges over several."""
    import polars as pl

    own = found.parameters.filter(pl.col("model") == found.best)
    if own["participant"].n_unique() == 1:
        heading, listing = "with 95% intervals", table("parameter", "estimate", "from", "to")
        rows = own.select("parameter", "estimate", "low", "high")
    else:
        heading, listing = "means over participants", table("parameter", "mean", "from", "to")
        rows = own.group_by("parameter", maintain_order=True).agg(
            pl.col("estimate").mean().alias("mean"),
            pl.col("estimate").min().alias("low"),
            pl.col("estimate").max().alias("high"),
        )
    for name, *numbers in rows.iter_rows():
        listing.add_row(name, *(f"{number:.3f}" for number in numbers))
    OUTPUT.print(f"\nEstimates of [bold]{found.best}[/bold], {heading}:")
    OUTPUT.print(listing)


def _check_out(folder: Path) -> None:
    """Refuse what is no folder before anything is fitted."""
    for place in (folder, *folder.parents):
        if place.exists() and not place.is_dir():
            raise RequestError(f"--out {folder}: {place} is a file; a folder is needed")


def _verdict(found: "Fitted") -> str:
    """What can be said of the best model against the others."""
    from qbumpers.fitting.compare import FEWEST

    if found.models["learner"][0] == "chance":
        return "No learner explains the choices better than chance."
    if found.scores["participant"].n_unique() < FEWEST:
        return f"That the best model is the best for others too would take {FEWEST} participants."
    alike = [
        row["model"]
        for row in found.models.iter_rows(named=True)
        if row["model"] != found.best and row["high"] is not None and row["high"] >= 0
    ]
    if alike:
        return f"{found.best} is not told apart from: {'; '.join(alike)}."
    return f"{found.best} explains these participants significantly better than the others."


def _warn_of_error(found: "Fitted") -> None:
    """Say so if the particle filter is too coarse for what it is used for."""
    rows = found.scores.sort("error", descending=True).iter_rows(named=True)
    worst = next(rows)
    if worst["error"] > _LARGE_ERROR:
        print_warning(
            f"something is hidden from {worst['model']}: the log-likelihood of participant "
            f"{worst['participant']} has an error of {worst['error']:.1f}, which is too much for a "
            "comparison; give more --particles"
        )


def _write(found: "Fitted", folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, frame in found._asdict().items():
        frame.write_csv(folder / f"{name}.csv")
    OUTPUT.print(f"Tables: [bold]{escape(str(folder))}[/bold]", soft_wrap=True)
