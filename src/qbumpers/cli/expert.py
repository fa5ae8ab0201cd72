"""`qbumpers expert`."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import ERRORS, OUTPUT, table
from qbumpers.errors import RequestError

if TYPE_CHECKING:
    import polars as pl

    from qbumpers.experts import Recipe
    from qbumpers.experts.checking import MeanWithError
    from qbumpers.experts.choosing import Judgement
    from qbumpers.tasks import TabularTask, Task
    from qbumpers.tasks.vector import VectorTask
    from qbumpers.values import NetworkValues, TabularValues


@application.command()
def expert(
    task: Annotated[
        str, typer.Argument(help="Name of a task, or of a Gymnasium environment.", metavar="TASK")
    ],
    check: Annotated[
        Path | None, typer.Option(help="Only check the values in this file.", metavar="FILE")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Draw what the check finds into this folder.", metavar="DIR")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Where the values go.", show_default="TASK.npz", metavar="FILE"),
    ] = None,
    corrected: Annotated[
        Path | None,
        typer.Option(
            help="Also correct the values by what they achieve where learners go, into this file.",
            metavar="FILE",
        ),
    ] = None,
    discount: Annotated[
        float | None,
        typer.Option(help="Of a Gymnasium environment, which states none.", metavar="NUMBER"),
    ] = None,
    seeds: Annotated[
        int, typer.Option(help="Experts to train, with seeds 0, 1, ...", metavar="N", min=1)
    ] = 10,
    steps: Annotated[int, typer.Option(help="Of training each.", metavar="N", min=1)] = 400_000,
    activation: Annotated[str, typer.Option(help="Of hidden units.", metavar="tanh|relu")] = "tanh",
    hidden: Annotated[
        str, typer.Option(help="Units of each hidden layer.", metavar="N,N,...")
    ] = "64,64",
    learning_rate: Annotated[float, typer.Option(help="Of Adam.", metavar="NUMBER")] = 5e-4,
    random_start: Annotated[
        int,
        typer.Option(
            "--random-start",
            "--opening",
            help="Random actions before each episode of training.",
            metavar="N",
        ),
    ] = 50,
) -> None:
    """Train or solve the action values of an assistant, and check them.

    A task with a transition table is solved exactly. Any other is learned by Double DQN, by the
    paper's recipe as it stands, with several seeds. The best is kept: the one with the most
    successes in 100 episodes with 2% random actions; among equals, with 10% random actions; among
    equals, after 50 random actions at the beginning. Where the task tells no success, mean returns
    decide instead. Training that was stopped goes on with the seeds that are missing.

    Example: qbumpers expert lunar-lander --out expert.npz
    """
    from qbumpers.tasks import TabularTask, make_task

    made = make_task(task, discount=discount)
    if figures is not None and check is None:
        raise RequestError(f"--figures {figures}: they are of a check; give --check FILE too")
    path = out or Path(f"{task.replace('/', '-')}.npz")
    with stoppable():
        if isinstance(made, TabularTask):
            if corrected is not None:
                raise RequestError(f"--corrected {corrected}: the values of a table are exact")
            _expert_of_table(made, check, figures, path)
            return
        if check is not None:
            _check(made, check, figures)
        else:
            recipe = _recipe(made, steps, activation, hidden, learning_rate, random_start)
            _train(made, recipe, list(range(seeds)), path)
        if corrected is not None:
            _correct(made, check or path, corrected)


def _recipe(
    task: "VectorTask", steps: int, activation: str, hidden: str, rate: float, random_start: int
) -> "Recipe":
    from qbumpers.errors import checked
    from qbumpers.experts import Recipe

    try:
        sizes = tuple(int(size) for size in hidden.split(",") if size)
    except ValueError as error:
        raise RequestError(
            f"--hidden {hidden}: whole numbers with commas between them are needed"
        ) from error
    learner = {
        **Recipe().learner._asdict(),
        "network": {"hidden": sizes, "activation": activation},
        "learning_rate": rate,
        "discount": task.discount,
    }
    return Recipe(checked(type(Recipe().learner), learner, "expert"), steps, random_start)


def _train(task: "VectorTask", recipe: "Recipe", seeds: list[int], path: Path) -> None:
    from qbumpers.experts.choosing import best, judge, train_several, with_provenance

    work = path.with_name(f"{path.name}.work")
    with _steps_bar() as bar:
        shown = bar.add_task("training", total=recipe.steps * len(seeds))

        def report(seed: int, steps: int) -> None:
            done = seeds.index(seed) * recipe.steps + steps
            bar.update(shown, completed=done, description=f"steps, seed {seed}")

        trained = train_several(task, recipe, seeds, work, report)
    with OUTPUT.status("judging"):
        judgements = [judge(task, values) for values in trained]
    chosen = best(judgements)
    kept = with_provenance(task, trained[chosen], judgements[chosen], seeds)
    kept.save(path)
    OUTPUT.print(_judgements(task, seeds, judgements))
    warn_of_bad_values(task, kept)
    OUTPUT.print(
        f"Kept seed {seeds[chosen]} in [bold]{escape(str(path))}[/bold]; all of them are in "
        f"{escape(str(work))}",
        soft_wrap=True,
    )


def _steps_bar() -> Progress:
    count = TextColumn("{task.completed:,.0f} of {task.total:,.0f}")
    columns = (TextColumn("{task.description}"), BarColumn(), count, TimeRemainingColumn())
    return Progress(*columns, console=OUTPUT)


def warn_of_bad_values(task: "Task", values: "TabularValues | NetworkValues") -> None:
    """Say so where a network's values are no better than random play."""
    from qbumpers.experts import ExpertWarning, check_expert
    from qbumpers.tasks import TabularTask

    if isinstance(task, TabularTask):
        return

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ExpertWarning)
        check_expert(task, values)
    for warning in caught:
        ERRORS.print(f"warning: {escape(str(warning.message))}", soft_wrap=True)


def _judgements(task: "VectorTask", names: list[Any], judgements: "list[Judgement]") -> Table:
    kind = "success" if task.has_success else "return"
    listing = table(
        "seed", f"{kind}, 2% random", "10% random", "after 50 random", "greedy return",
        "V of start", "achieved", "Q at crashes",
    )  # fmt: skip
    digits = 2 if task.has_success else 1
    for name, found in zip(names, judgements, strict=True):
        merits = (_number(merit, digits) for merit in found.merits)
        crash = "-" if found.crash_value is None else _number(found.crash_value, 1)
        rest = (found.greedy_return, found.start_value, found.start_return)
        listing.add_row(str(name), *merits, *(_number(number, 1) for number in rest), crash)
    listing.caption = (
        "V of start is what the values claim, achieved what greedy episodes return, both "
        "discounted. Q at crashes is claimed for the very action that crashed."
    )
    return listing


def _number(found: "MeanWithError", digits: int) -> str:
    return f"{found.mean:.{digits}f}"


def _check(task: "VectorTask", path: Path, figures: Path | None) -> None:
    from qbumpers.experts.choosing import judge
    from qbumpers.experts.quality import check_values, summarise

    values = _network_of(task, path)
    OUTPUT.print(f"[bold]{escape(str(path))}[/bold]: {escape(values.method)}", soft_wrap=True)
    with OUTPUT.status("judging"):
        judgement = judge(task, values)
    OUTPUT.print(_judgements(task, ["-"], [judgement]))
    warn_of_bad_values(task, values)
    with OUTPUT.status("going where learners go"):
        claims = check_values(task, values, discount=values.discount)
    found = summarise(claims)
    OUTPUT.print(
        f"- Off the greedy path values differ from what is achieved by {_signed(found.bias)} on "
        f"average, by {_with_error(found.absolute)} in size; {found.overestimated:.0%} are too "
        "high.",
        soft_wrap=True,
    )
    if found.crash_value is not None and found.crash_return is not None:
        OUTPUT.print(
            f"- One step before crashes they claim {_with_error(found.crash_value)}; the crash "
            f"brings {found.crash_return.mean:.1f}.",
            soft_wrap=True,
        )
    if figures is not None:
        _draw(claims, path, figures)


def _correct(task: "VectorTask", path: Path, out: Path) -> None:
    from qbumpers.experts import correcting

    values = _network_of(task, path)
    with _steps_bar() as bar:
        shown = bar.add_task("trying actions where learners go", total=correcting.BRANCHES)
        found = correcting.correct_values(
            task,
            values,
            branches=correcting.BRANCHES,
            report=lambda done: bar.update(shown, completed=done),
        )
    found.values.save(out)
    OUTPUT.print(
        f"- In states held out the error was {_with_error(found.before.absolute)} in size, now "
        f"{_with_error(found.after.absolute)}; its mean was {_signed(found.before.bias)}, now "
        f"{_signed(found.after.bias)}.\nCorrected values: [bold]{escape(str(out))}[/bold]",
        soft_wrap=True,
    )


def _network_of(task: "VectorTask", path: Path) -> "NetworkValues":
    from qbumpers.values import NetworkValues, load_values

    values = load_values(path)
    if not isinstance(values, NetworkValues):
        raise RequestError(f"values file {path}: a table; task {task.name} needs a network")
    found, needed = (values.inputs, values.actions), (task.observation_size, task.actions)
    if values.task != task.name or found != needed:
        raise RequestError(
            f"values file {path}: of task {values.task}, {found[0]} inputs and {found[1]} actions; "
            f"task {task.name} has {needed[0]} and {needed[1]}"
        )
    return values


def _signed(found: "MeanWithError") -> str:
    return f"{found.mean:+.1f} \N{PLUS-MINUS SIGN} {1.96 * found.error:.1f}"


def _with_error(found: "MeanWithError") -> str:
    return _signed(found).removeprefix("+")


def _draw(claims: "pl.DataFrame", path: Path, folder: Path) -> None:
    from qbumpers.analysis.figures.quality import quality_figure
    from qbumpers.analysis.figures.style import save

    drawn = save(quality_figure([(path.stem, claims)]), folder, f"{path.stem}-quality")
    OUTPUT.print(f"Figure: [bold]{escape(str(drawn))}[/bold]", soft_wrap=True)


def _expert_of_table(
    task: "TabularTask", check: Path | None, figures: Path | None, path: Path
) -> None:
    import numpy as np

    from qbumpers.experts.quality import check_table
    from qbumpers.values import TabularValues, load_values, solve

    if figures is not None:
        raise RequestError(f"--figures {figures}: a table needs none, it is compared exactly")
    values = solve(task) if check is None else load_values(check)
    if not isinstance(values, TabularValues) or values.table.shape != (task.states, task.actions):
        kind = (
            f"a table {list(values.table.shape)}"
            if isinstance(values, TabularValues)
            else "a network"
        )
        raise RequestError(
            f"values file {check}: {kind}; task {task.name} needs a table "
            f"[{task.states}, {task.actions}]"
        )
    found = check_table(task, values, discount=values.discount)
    errors = (found["value"] - found["exact"]).to_numpy()
    start = [float(np.max(values(state))) for state in np.flatnonzero(task.start)]
    OUTPUT.print(f"{escape(task.name)}: {escape(values.method)}", soft_wrap=True)
    OUTPUT.print(
        f"V of the start {', '.join(f'{value:g}' for value in start)}; over {found.height} states "
        f"and actions the error is at most {np.abs(errors).max():.2g}, its mean "
        f"{errors.mean():.2g}",
        soft_wrap=True,
    )
    if check is None:
        values.save(path)
        OUTPUT.print(f"Values: [bold]{escape(str(path))}[/bold]", soft_wrap=True)
