"""`qbumpers reproduce`, `run` and `report`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape
from rich.table import Table

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import (
    OUTPUT,
    duration,
    expert_warnings_printed,
    interval,
    table,
    typeable,
)
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
from qbumpers.errors import RequestError, counted

if TYPE_CHECKING:
    import polars as pl

    from qbumpers.analysis.findings import LearnerFindings
    from qbumpers.experiments.design import Experiment
    from qbumpers.experiments.run import RunProgress
    from qbumpers.simulation import Card


Profile = Annotated[
    str,
    typer.Option(
        help="Setting of the experiment. 'figures': in which the paper's figure comes out. Others "
        "of cliff-walking: 'text', which takes the paper's text literally. Others of lunar-lander, "
        "to see what its result depends on: 'dueling', 'learning-rate-5e-4', 'long-exploration', "
        "'relu'.",
        metavar="figures|text|...",
    ),
]
Quick = Annotated[
    bool, typer.Option("--quick", help="A version of lunar-lander that takes a few minutes.")
]
Trials = Annotated[
    int | None,
    typer.Option(help="Simulated learners per condition.", show_default="the paper's", metavar="N"),
]
Episodes = Annotated[
    int | None, typer.Option(help="Of each trial.", show_default="the paper's", metavar="N")
]
Alphas = Annotated[
    str | None,
    typer.Option(
        help="Of every assistant that has an alpha, for example 0.5,0.8,1.",
        show_default="the paper's",
        metavar="A,A,...",
    ),
]
OwnTrials = Annotated[
    int | None,
    typer.Option(
        "--trials",
        help="Simulated learners per condition.",
        show_default="the file's",
        metavar="N",
        min=1,
    ),
]
OwnEpisodes = Annotated[
    int | None,
    typer.Option(
        "--episodes", help="Of each trial.", show_default="the file's", metavar="N", min=1
    ),
]
OwnSeed = Annotated[
    int | None,
    typer.Option(
        "--seed", help="Of all random streams.", show_default="the file's", metavar="N", min=0
    ),
]
Values = Annotated[
    str | None,
    typer.Option(
        help="Q values of the assistants: a file, for example another expert.",
        show_default="the profile's",
        metavar="PATH",
    ),
]


@application.command()
def reproduce(
    experiment: Annotated[
        str, typer.Argument(help="Which one: cliff-walking or lunar-lander.", metavar="EXPERIMENT")
    ],
    profile: Profile = "figures",
    quick: Quick = False,
    trials: Trials = None,
    episodes: Episodes = None,
    alphas: Alphas = None,
    values: Values = None,
    seed: Annotated[int, typer.Option(help="Of all random streams.", metavar="N")] = 0,
    workers: Workers = None,
    on: On = None,
    precision: PrecisionOfCard = None,
    out: Out = None,
) -> None:
    """Repeat an experiment of the paper and compare the results with its numbers.

    Writes tables, figures and report.html. A run that was stopped continues where it was, and one
    with more trials than before computes only those. Versions with other episodes, alphas or
    values have output folders of their own.

    Cliff Walking takes seconds. Lunar Lander takes hours at full size: begin with --quick.

    Example: qbumpers reproduce cliff-walking --trials 20 --out results/quick

    Example: qbumpers reproduce lunar-lander --quick

    Example: qbumpers reproduce lunar-lander --alphas 0.8,0.9,1 --trials 4 --episodes 1000
    """
    from qbumpers.reproduction.experiments import reproduction

    with stoppable():
        card = card_for(workers, on, precision)
        design = reproduction(
            experiment,
            profile,
            alphas=None if alphas is None else _numbers(alphas),
            quick=quick,
            trials=trials,
            episodes=episodes,
            values=values,
            seed=seed,
        )
        _run(design, workers, on, out, card)


def _numbers(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise RequestError(
            f"alphas = {text!r}; numbers from 0 to 1 with commas between them are needed, for "
            "example 0.5,0.8,1"
        ) from error


@application.command()
def run(
    experiment: Annotated[
        Path, typer.Argument(help="An experiment file.", metavar="EXPERIMENT.toml")
    ],
    trials: OwnTrials = None,
    episodes: OwnEpisodes = None,
    seed: OwnSeed = None,
    imports: Imports = None,
    workers: Workers = None,
    on: On = None,
    precision: PrecisionOfCard = None,
    out: Out = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Run it even if it has more than 10,000 cells of work.")
    ] = False,
) -> None:
    """Run an experiment of your own, described in a TOML file.

    Says what it will do and how long it will take, then writes tables, figures and report.html. A
    run that was stopped continues where it was; one with more trials or assistants than before
    computes only what is new.

    Example: qbumpers run frozen-lake.toml --out results/frozen-lake

    Example: qbumpers run frozen-lake.toml --trials 5 --episodes 20 --out results/quick
    """
    from qbumpers.experiments.sources import load_experiment

    with stoppable():
        card = card_for(workers, on, precision)
        given = {"trials": trials, "episodes": episodes, "seed": seed}
        changes = {field: number for field, number in given.items() if number is not None}
        design = load_experiment(experiment, large=yes, imports=imports or (), changes=changes)
        _run(design, workers, on, out, card)


@application.command()
def report(
    folder: Annotated[
        str,
        typer.Argument(help="Results of a finished run, or of one that goes on.", metavar="DIR"),
    ],
) -> None:
    """Write tables, figures and report.html of a run again.

    Of a run that is not finished, the report says what is missing.
    """
    with stoppable():
        _analyse(folder)


def _run(
    experiment: "Experiment",
    workers: int | None,
    on: str | None,
    out: str | None,
    card: "Card | None",
) -> None:
    from qbumpers.experiments.plan import make_plan
    from qbumpers.experiments.run import run_experiment

    with expert_warnings_printed():
        plan = make_plan(experiment, card=card)
    folder = out or f"results/{experiment.name}"
    more = f" and {experiment.retention} without the assistant" if experiment.retention else ""
    OUTPUT.print(
        f"[bold]{experiment.name}[/bold]: {counted(len(plan.named), 'condition')}, "
        f"{counted(experiment.trials, 'trial')} of {counted(experiment.episodes, 'episode')}"
        f"{more}, into {escape(folder)}",
        soft_wrap=True,
    )
    with (
        backend_for(workers, on, card) as backend,
        TrialProgress("simulating", _announce) as progress,
    ):
        run_experiment(plan, folder, backend=backend, report=progress.show)
    _analyse(folder)


def _announce(done: "RunProgress") -> None:
    if done.trials == done.of:
        OUTPUT.print(
            "All trials are there already." if done.of > 1 else "The trial is there already."
        )
        return
    verb = "is" if done.trials == 1 else "are"
    there = f"{done.trials:,} {verb} there already, " if done.trials else ""
    missing = f"{done.of - done.trials:,} to run"
    expected = f"{duration(done.expected)} by a short calibration"
    OUTPUT.print(f"{counted(done.of, 'trial')}: {there}{missing}, {expected}")


def _analyse(folder: str) -> None:
    with OUTPUT.status("analysing") as status:
        from qbumpers.analysis.report import REPORT
        from qbumpers.experiments.store import files_to_read
        from qbumpers.files import local_copy
        from qbumpers.reproduction.printed import PUBLISHED
        from qbumpers.reproduction.report import write_report

        with local_copy(folder, files_to_read(folder)) as place:
            findings = write_report(place, advance=lambda part: status.update(f"writing {part}"))
    for about in findings.learners:
        OUTPUT.print(_summary_table(about))
    if PUBLISHED in findings.additions.tables:
        OUTPUT.print(_published_table(findings.additions.tables[PUBLISHED]))
    for heading, sentences in (
        *findings.headlines,
        ("What to try next", findings.suggestions),
        ("Keep in mind", findings.cautions),
    ):
        if heading and sentences:
            OUTPUT.print(f"{escape(heading)}:", soft_wrap=True)
        for sentence in sentences:
            OUTPUT.print(f"- {escape(typeable(sentence))}", soft_wrap=True)
    OUTPUT.print(f"Report: [bold]{escape(folder)}/{REPORT}[/bold]", soft_wrap=True)


def _summary_table(about: "LearnerFindings") -> Table:
    """Returns and overrides of the conditions of one kind of learner."""
    own, summary = about.label, about.summary
    listing = table("condition", "assisted", "unassisted", "overrides")
    for column in listing.columns:
        column.no_wrap = column.header != "condition"  # the narrow give way last
    if own:
        listing.title, listing.title_justify = f"Learners with {own}", "left"
    for row in summary.iter_rows(named=True):
        cells = [
            interval(row[f"{m}_mean"], row[f"{m}_low"], row[f"{m}_high"], about.decimals)
            for m in ("assisted", "unassisted")
        ]
        condition = row["condition"].removesuffix(f"@{own}")
        listing.add_row(condition, *cells, f"{row['overrides_mean']:.2f}")
    what = "Mean assisted and unassisted returns per episode, and overrides per episode"
    single = summary["trials"].max() == 1
    listing.caption = (
        f"{what}; one trial per condition has no interval."
        if single
        else f"{what}, with 95% intervals over trials."
    )
    return listing


def _published_table(comparisons: "pl.DataFrame") -> Table:
    listing = table("number in the paper", "paper", "measured", "agrees")
    for row in comparisons.iter_rows(named=True):
        digits = 2 if abs(row["published"]) < 1 else 1
        verdict = {True: "yes", False: "[red]no[/red]", None: "-"}[row["agrees"]]
        mean, low, high = (row[f"measured_{part}"] for part in ("mean", "low", "high"))
        measured = interval(mean, low, high, digits)
        listing.add_row(row["what"], typeable(row["printed"]), measured, verdict)
    return listing
