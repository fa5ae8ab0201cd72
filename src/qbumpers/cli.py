"""The command line. Exit status: 0 done, 1 it failed, 2 the request was wrong."""

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

import qbumpers
from qbumpers.errors import RequestError, unknown_name

_OUTPUT, _ERRORS = Console(highlight=False), Console(stderr=True, highlight=False)

application = typer.Typer(
    name="qbumpers",
    help="Assistance that lets people learn: simulate it, compare it, reproduce the paper.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Workers = Annotated[
    int | None, typer.Option(help="Threads to use.", show_default="all cores", metavar="N", min=1)
]
Out = Annotated[
    Path | None,
    typer.Option(help="Folder for the results.", show_default="results/NAME", metavar="DIR"),
]


@application.command()
def reproduce(
    experiment: Annotated[
        str, typer.Argument(help="Which one: cliff-walking.", metavar="EXPERIMENT")
    ],
    profile: Annotated[
        str,
        typer.Option(
            help="Reading of the paper: 'figures' gives its published numbers, 'text' takes its "
            "text literally.",
            metavar="figures|text",
        ),
    ] = "figures",
    trials: Annotated[
        int | None,
        typer.Option(help="Simulated people a condition.", show_default="the paper's", metavar="N"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of all random streams.", metavar="N")] = 0,
    workers: Workers = None,
    out: Out = None,
) -> None:
    """Repeat an experiment of the paper and hold the results against its numbers.

    Writes tables, figures and report.html. A run that was stopped continues where it was.

    Example: qbumpers reproduce cliff-walking --trials 20 --out results/quick
    """
    from qbumpers.experiments.design import reproduction

    with _stoppable():
        _run(reproduction(experiment, profile, trials=trials, seed=seed), workers, out)


@application.command()
def run(
    experiment: Annotated[
        Path, typer.Argument(help="An experiment file.", metavar="EXPERIMENT.toml")
    ],
    workers: Workers = None,
    out: Out = None,
) -> None:
    """Run an experiment of your own, described in a TOML file.

    Writes tables, figures and report.html. A run that was stopped continues where it was.

    Example: qbumpers run frozen-lake.toml --out results/frozen-lake
    """
    from qbumpers.experiments.design import load_experiment

    with _stoppable():
        _run(load_experiment(experiment), workers, out)


@application.command()
def report(
    folder: Annotated[Path, typer.Argument(help="Results of a finished run.", metavar="DIR")],
) -> None:
    """Write tables, figures and report.html of a finished run again."""
    with _stoppable():
        _analyse(folder)


@application.command("list")
def list_names(
    what: Annotated[
        str, typer.Argument(help="What to list.", metavar="assistants|tasks|learners")
    ] = "assistants",
) -> None:
    """List what experiments can name."""
    listings = {"assistants": _list_assistants, "tasks": _list_tasks, "learners": _list_learners}
    if what not in listings:
        raise unknown_name("list", what, listings)
    _OUTPUT.print(listings[what]())


def _list_assistants() -> Table:
    from qbumpers.assistants import assistants

    table = _table("assistant", "options (with defaults)", "what it does")
    for name, rule in assistants().items():
        defaults: dict[str, Any] = rule.options_type._field_defaults  # type: ignore[attr-defined]
        fields: tuple[str, ...] = rule.options_type._fields  # type: ignore[attr-defined]
        options = [f"{f} = {str(defaults[f]).lower()}" if f in defaults else f for f in fields]
        table.add_row(name, ", ".join(options), _first_line(rule.decide))
    return table


def _list_tasks() -> Table:
    from qbumpers.tasks.registry import tabular_environments, task_names

    table = _table("task", "what it is")
    for name in task_names():
        table.add_row(name, "a task of this package")
    for name in tabular_environments():
        table.add_row(name, "a Gymnasium environment with a transition table; give a discount")
    return table


def _list_learners() -> Table:
    from qbumpers.learners import PERCEPTIONS

    table = _table("learner", "perception", "credits when overridden", "penalised")
    for name, perception in PERCEPTIONS.items():
        credited = "its own action" if perception.credits_proposed else "the executed action"
        if not perception.learns_when_overridden:
            credited = "nothing"
        table.add_row("q-learning", name, credited, "yes" if perception.penalised else "no")
    return table


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", caption_justify="left")
    for column in columns:
        table.add_column(column, overflow="fold", no_wrap=column == columns[0])
    return table


def _first_line(function: Any) -> str:
    return (function.__doc__ or "").strip().split("\n")[0]


def _run(experiment: Any, workers: int | None, out: Path | None) -> None:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from qbumpers.experiments.run import Progress as Done
    from qbumpers.experiments.run import make_plan, run_experiment

    plan = make_plan(experiment)
    folder = out or Path("results") / experiment.name
    _OUTPUT.print(
        f"[bold]{experiment.name}[/bold]: {len(plan.conditions)} conditions, {experiment.trials} "
        f"trials of {experiment.episodes} episodes, into {escape(str(folder))}"
    )
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:,.0f} of {task.total:,.0f} trials"),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    bar = Progress(*columns, console=_OUTPUT)
    total = len(plan.conditions) * experiment.trials
    task = bar.add_task("simulating", total=total, rate="compiling")
    begun = time.monotonic()

    def show(done: Done) -> None:
        bar.start()
        seconds = max(time.monotonic() - begun, 1e-3)
        rate = f"{done.steps / seconds / 1e6:.1f} million steps a second"
        bar.update(task, completed=done.trials, rate=rate if done.steps else "compiling")

    try:
        run_experiment(plan, folder, workers=workers, report=show)
    finally:
        bar.stop()
    _analyse(folder)


def _analyse(folder: Path) -> None:
    with _OUTPUT.status("analysing") as status:
        from qbumpers.analysis.report import REPORT, write_report

        findings = write_report(folder, advance=lambda part: status.update(f"writing {part}"))
    _OUTPUT.print(_summary_table(findings.summary))
    if findings.comparisons:
        _OUTPUT.print(_published_table(findings.comparisons))
    for matched, regret in findings.regrets.items():
        _OUTPUT.print(f"At matched {matched}, {_regret(regret.reduction)}.")
    _OUTPUT.print(f"Report: [bold]{escape(str(folder / REPORT))}[/bold]", soft_wrap=True)


def _summary_table(summary: Any) -> Table:
    table = _table("condition", "with the assistant", "without it", "overrides")
    for row in summary.iter_rows(named=True):
        cells = [
            _interval(row[f"{measure}_mean"], row[f"{measure}_low"], row[f"{measure}_high"])
            for measure in ("assisted", "unassisted")
        ]
        table.add_row(row["condition"], *cells, f"{row['overrides_mean']:.2f}")
    table.caption = "Mean returns and overrides an episode, with 95% intervals over trials."
    return table


def _published_table(comparisons: Any) -> Table:
    table = _table("number in the paper", "paper", "measured", "agrees")
    for row in comparisons:
        digits = 2 if abs(row.published) < 1 else 1
        verdict = {True: "yes", False: "[red]no[/red]", None: "-"}[row.agrees]
        mean, low, high = row.measured
        measured = _interval(mean, low, high, digits)
        table.add_row(row.what, f"{row.published:.{digits}f}", measured, verdict)
    return table


def _regret(reduction: Any) -> str:
    if not math.isfinite(reduction.mean):
        return "no setting of the method reaches the level of the baseline"
    if not math.isfinite(reduction.low):
        return f"regret is {100 * reduction.mean:.0f}% lower (too few trials for an interval)"
    low, high = 100 * reduction.low, 100 * reduction.high
    return f"regret is {100 * reduction.mean:.0f}% lower (95% interval {low:.0f}% to {high:.0f}%)"


def _interval(mean: float, low: float | None, high: float | None, digits: int = 1) -> str:
    if low is not None and high is not None and 0 < high - low < 0.2:
        digits = max(digits, 3)  # returns of size 1, for instance
    if low is None or high is None or not math.isfinite(low):
        return f"{mean:.{digits}f}"
    return f"{mean:.{digits}f} \N{PLUS-MINUS SIGN} {(high - low) / 2:.{digits}f}"


@application.callback(invoke_without_command=True)
def _main_options(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    traceback: Annotated[
        bool, typer.Option("--traceback", help="Show where an unexpected error came from.")
    ] = False,
) -> None:
    if version:
        _OUTPUT.print(f"qbumpers {qbumpers.__version__}")
        raise typer.Exit


def main() -> None:
    """Run the command line and exit with its status."""
    try:
        application()
    except RequestError as error:
        _stop(2, "error", str(error))
    except OSError as error:
        _stop(1, "failed", f"{error}; what is finished is kept")
    except Exception as error:
        if "--traceback" in sys.argv:
            raise
        reason = f"{type(error).__name__}: {error}"
        _stop(1, "failed", f"{reason} (unexpected; 'qbumpers --traceback ...' shows where)")


@contextlib.contextmanager
def _stoppable() -> Iterator[None]:
    """End on Ctrl-C with a message; Typer by itself would end without one."""
    try:
        yield
    except KeyboardInterrupt:
        _stop(1, "stopped", "what is finished is kept; the same command goes on from there")


def _stop(status: int, kind: str, message: str) -> None:
    _ERRORS.print(Text.assemble((f"{kind}: ", "bold red"), message), soft_wrap=True)
    sys.exit(status)
