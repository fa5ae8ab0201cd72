"""`qbumpers compare`."""

from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import OUTPUT, interval, table, typeable
from qbumpers.cli.progress import TrialProgress
from qbumpers.cli.working import Imports, On, PrecisionOfCard, Workers, backend_for, card_for
from qbumpers.errors import counted

if TYPE_CHECKING:
    from rich.table import Table

    from qbumpers.comparison.scores import Tables

Tasks = Annotated[
    str | None,
    typer.Option(
        help="With a table of transitions, or 'all' for every one that is registered.",
        show_default="a few of different kinds",
        metavar="NAME,NAME,...",
    ),
]
Learners = Annotated[
    list[str] | None,
    typer.Option(
        "--learner",
        help="A kind of learner, with fields that differ from their defaults, for example "
        "q-learning/perception=observant. May be repeated.",
        show_default="three kinds",
        metavar="NAME[/FIELD=VALUE,...]",
    ),
]
Assistants = Annotated[
    str | None,
    typer.Option(
        help="Which to compare.", show_default="all of the package", metavar="NAME,NAME,..."
    ),
]
Trials = Annotated[int, typer.Option(help="Simulated learners per setting.", metavar="N", min=2)]
Episodes = Annotated[int, typer.Option(help="Of each trial.", metavar="N", min=1)]
Discount = Annotated[
    float | None,
    typer.Option(
        help="Of tasks that are Gymnasium environments, which state none.", metavar="GAMMA"
    ),
]
Out = Annotated[str, typer.Option(help="Folder for the results.", metavar="DIR")]


@application.command()
def compare(
    tasks: Tasks = None,
    learner: Learners = None,
    assistants: Assistants = None,
    trials: Trials = 50,
    episodes: Episodes = 100,
    discount: Discount = None,
    seed: Annotated[int, typer.Option(help="Of all random streams.", metavar="N", min=0)] = 0,
    imports: Imports = None,
    workers: Workers = None,
    on: On = None,
    precision: PrecisionOfCard = None,
    out: Out = "results/comparison",
) -> None:
    """Compare assistants on several tasks and learners, at equal amounts of help.

    Every assistant gets as many settings, scaled by the task. Writes comparison.html with figures
    and tables: performance against learning in each case, at equal shares of overridden steps, and
    scores over all cases with intervals. A comparison that was stopped continues where it was; one
    with more trials, tasks or assistants computes only what is new.

    Takes some minutes as it is.

    Example: qbumpers compare --tasks cliff-walking --trials 10 --out results/quick

    Example: qbumpers compare --tasks FrozenLake-v1 --discount 0.99 --assistants shield,undo

    Example: qbumpers compare --tasks all --trials 300 --out results/full
    """
    from qbumpers.comparison.cases import LEARNERS, TASKS, make_cases
    from qbumpers.comparison.running import run_cases

    with stoppable():
        card = card_for(workers, on, precision)
        cases = make_cases(
            TASKS if tasks is None else tasks.split(","),
            learner or LEARNERS,
            [] if assistants is None else assistants.split(","),
            trials=trials,
            episodes=episodes,
            discount=discount,
            seed=seed,
            imports=imports or (),
        )
        conditions = sum(len(case.settings) for case in cases)
        OUTPUT.print(
            f"[bold]comparison[/bold]: {counted(len(cases), 'case')}, "
            f"{counted(conditions, 'setting')} of assistants, {counted(trials, 'trial')} of "
            f"{counted(episodes, 'episode')} each, into {escape(out)}",
            soft_wrap=True,
        )
        with (
            backend_for(workers, on, card) as backend,
            TrialProgress("simulating", lambda done: None) as progress,
        ):
            run_cases(cases, out, backend, card, progress.show)
        _analyse(out)


def _analyse(folder: str) -> None:
    with OUTPUT.status("analysing") as status:
        from qbumpers.comparison import sentences
        from qbumpers.comparison.report import PAGE, write_comparison

        tables = write_comparison(folder, lambda part: status.update(f"writing {part}"))
    if tables.aggregates.height:
        OUTPUT.print(_aggregates(tables))
    for sentence in sentences.overall(tables):
        OUTPUT.print(f"- {escape(typeable(sentence))}", soft_wrap=True)
    OUTPUT.print(f"Report: [bold]{escape(folder)}/{PAGE}[/bold]", soft_wrap=True)


def _aggregates(tables: "Tables") -> "Table":
    listing = table("method", "cases", "covers", "mean rank", "exceeds the bumpers")
    for row in tables.aggregates.sort("iqm_mean", descending=True).iter_rows(named=True):
        numbers = [
            interval(row[f"{name}_mean"], row[f"{name}_low"], row[f"{name}_high"], digits)
            for name, digits in (("iqm", 2), ("rank", 1), ("improvement", 2))
        ]
        listing.add_row(row["method"], str(row["cases"]), *numbers)
    listing.caption = (
        "Share of each case's box that some setting covers, interquartile mean over cases; rank "
        "by it; and the probability that a run exceeds one of the bumpers. 95% intervals."
    )
    return listing
