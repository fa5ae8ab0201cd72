"""`qbumpers expert`."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import rich.progress
import typer
from rich.markup import escape
from rich.table import Table

from qbumpers.cli.application import application, stoppable
from qbumpers.cli.console import OUTPUT, expert_warnings_printed, table
from qbumpers.cli.working import Imports
from qbumpers.errors import RequestError
from qbumpers.imports import import_modules, module_and_name

if TYPE_CHECKING:
    import polars as pl

    from qbumpers.experts import Recipe
    from qbumpers.experts.checking import MeanWithError
    from qbumpers.experts.choosing import Judgement
    from qbumpers.tasks import Task


Check = Annotated[
    Path | None, typer.Option(help="Only check the values in this file.", metavar="FILE")
]
Convert = Annotated[
    Path | None,
    typer.Option(
        help="Convert this DQN of Stable-Baselines3 in place of training.", metavar="MODEL.zip"
    ),
]
Statistics = Annotated[
    Path | None,
    typer.Option(help="The file of VecNormalize that goes with --convert.", metavar="FILE.pkl"),
]
Figures = Annotated[
    Path | None, typer.Option(help="Draw what the check finds into this folder.", metavar="DIR")
]
Out = Annotated[
    Path | None, typer.Option(help="Where the values go.", show_default="TASK.npz", metavar="FILE")
]
Corrected = Annotated[
    Path | None,
    typer.Option(
        help="Also correct the values by what they achieve where learners go, into this file.",
        metavar="FILE",
    ),
]
Discount = Annotated[
    float | None, typer.Option(help="Of a Gymnasium environment, which has none.", metavar="NUMBER")
]
EpisodeLimit = Annotated[
    int | None,
    typer.Option(
        help="Steps per episode of a Gymnasium environment.", show_default="its own", metavar="N",
        min=1,
    ),
]  # fmt: skip
Observe = Annotated[
    str | None,
    typer.Option(
        help="Keys of a Dict observation that are kept; all if left out.", metavar="KEY,KEY,..."
    ),
]
Estimated = Annotated[
    int | None,
    typer.Option(
        help="Estimate a table from so many steps, if states are numbered.",
        metavar="N",
        min=1,
    ),
]
Seeds = Annotated[
    int, typer.Option(help="Experts to train, with seeds 0, 1, ...", metavar="N", min=1)
]
Steps = Annotated[
    int | None,
    typer.Option(
        help="Of training each.", metavar="N", min=1,
        show_default="200,000; 400,000 of the lunar lander",
    ),
]  # fmt: skip
Activation = Annotated[
    str | None, typer.Option(help="Of hidden units.", metavar="tanh|relu", show_default="tanh")
]
Hidden = Annotated[
    str | None,
    typer.Option(help="Units of each hidden layer.", metavar="N,N,...", show_default="64,64"),
]
LearningRate = Annotated[
    float | None,
    typer.Option(
        help="Of Adam.", metavar="NUMBER", show_default="0.00025; 0.0005 of the lunar lander"
    ),
]
RandomStart = Annotated[
    int | None,
    typer.Option(
        "--random-start",
        "--opening",
        help="Random actions before each episode of training.",
        metavar="N",
        show_default="0; 50 of the lunar lander",
    ),
]


@application.command()
def expert(
    task: Annotated[
        str, typer.Argument(help="Name of a task, or of a Gymnasium environment.", metavar="TASK")
    ],
    check: Check = None,
    convert: Convert = None,
    statistics: Statistics = None,
    figures: Figures = None,
    out: Out = None,
    corrected: Corrected = None,
    discount: Discount = None,
    episode_limit: EpisodeLimit = None,
    imports: Imports = None,
    observe: Observe = None,
    estimated: Estimated = None,
    seeds: Seeds = 10,
    steps: Steps = None,
    activation: Activation = None,
    hidden: Hidden = None,
    learning_rate: LearningRate = None,
    random_start: RandomStart = None,
) -> None:
    """Train or solve the action values of an assistant, and check them.

    A task with a transition table is solved exactly, an estimated one too. Any other is learned
    by Double DQN with several seeds: the lunar lander by the paper's recipe as it stands, others
    by a general one, and what Gymnasium counts as solved is checked. The best is kept: the
    one with the most successes in 100 episodes with 2% random actions; among equals, with 10%
    random actions; among equals, after 50 random actions at the beginning. If the task has no
    success, mean returns decide instead. Training that was stopped goes on with the seeds that
    are missing.

    A model that Stable-Baselines3 saved is converted in place of training. If it saw normalised
    observations, give the statistics too: its own file does not hold them. Such files can hold
    code that runs when they are read: open none from strangers.

    Example: qbumpers expert lunar-lander --out expert.npz
    """
    from qbumpers.experts.selecting import make_recipe
    from qbumpers.tasks import make_task

    import_modules(imports or (), "--import")
    keys = None if observe is None else [key for key in observe.split(",") if key]
    made = make_task(
        task, discount=discount, episode_limit=episode_limit, observe=keys, estimated=estimated
    )
    if figures is not None and check is None:
        raise RequestError(f"--figures {figures}: they are of a check; give --check FILE too")
    _check_conversion(made, check, convert, statistics)
    path = out or Path(f"{module_and_name(task)[1].replace('/', '-')}.npz")
    for option, place in {"--out": out, "--corrected": corrected}.items():
        if place is not None:
            _check_place(option, place)
    if figures is not None:
        _check_place("--figures", figures / "any")
    with stoppable():
        if made.states:
            if corrected is not None:
                raise RequestError(f"--corrected {corrected}: the values of a table are exact")
            _solve_or_check(made, check, figures, path)
            return
        if check is not None:
            _check(made, check, figures)
        elif convert is not None:
            _convert(made, convert, statistics, path)
        else:
            recipe = make_recipe(
                made,
                steps=steps,
                hidden=None if hidden is None else _hidden(hidden),
                activation=activation,
                learning_rate=learning_rate,
                random_start=random_start,
            )
            _train(made, recipe, list(range(seeds)), path)
        if corrected is not None:
            _correct(made, check or path, corrected)


def _check_conversion(
    task: Any, check: Path | None, convert: Path | None, statistics: Path | None
) -> None:
    if convert is None and statistics is not None:
        raise RequestError(
            f"--statistics {statistics}: they are of a model; give --convert FILE too"
        )
    if convert is not None and check is not None:
        raise RequestError(
            f"--convert {convert}: --check only looks at values; give one of the two"
        )
    if convert is not None and task.states:
        raise RequestError(
            f"--convert {convert}: task {task.name} has a table, it is solved exactly"
        )


def _convert(task: "Task", model: Path, statistics: Path | None, path: Path) -> None:
    from qbumpers.experts import check_expert, from_stable_baselines

    with expert_warnings_printed():
        values = from_stable_baselines(model, task, statistics)
        values.save(path)
        found = check_expert(task, values)
    OUTPUT.print(
        f"{escape(values.method)}: mean return {found.expert.mean:.1f}, of random actions "
        f"{found.random.mean:.1f}\nValues: [bold]{escape(str(path))}[/bold]",
        soft_wrap=True,
    )


def _check_place(option: str, path: Path) -> None:
    """Refuse a place where no file can be, before hours of work for it."""
    if path.is_dir():
        raise RequestError(f"{option} {path}: it is a folder; a file is needed")
    for folder in path.parents:
        if folder.exists() and not folder.is_dir():
            raise RequestError(f"{option}: {folder} is a file; a folder is needed")


def _hidden(text: str) -> list[int]:
    try:
        return [int(size) for size in text.split(",") if size]
    except ValueError as error:
        raise RequestError(
            f"--hidden {text}: whole numbers with commas between them are needed"
        ) from error


def _train(task: "Task", recipe: "Recipe", seeds: list[int], path: Path) -> None:
    from qbumpers.experts import check_expert
    from qbumpers.experts.checking import check_threshold
    from qbumpers.experts.choosing import check_claim
    from qbumpers.experts.selecting import train_best

    with _steps_bar() as bar:
        shown = bar.add_task("training", total=recipe.steps * len(seeds))

        def report(seed: int, steps: int) -> None:
            done = seeds.index(seed) * recipe.steps + steps
            bar.update(shown, completed=done, description=f"steps, seed {seed}")

        found = train_best(task, recipe, seeds, path, report)
        bar.update(shown, completed=recipe.steps * len(seeds))
    OUTPUT.print(_judgements(task, seeds, found.judgements))
    with expert_warnings_printed():
        check_expert(task, found.values)
        check_claim(task, found.judgements[found.best])
        solved = check_threshold(task, found.values)
    if solved is not None and solved.reached:
        OUTPUT.print(
            f"Greedy episodes return {solved.returned.mean:.1f}; the environment counts as solved "
            f"from {solved.threshold:g} on.",
            soft_wrap=True,
        )
    OUTPUT.print(
        f"Kept seed {seeds[found.best]} in [bold]{escape(str(path))}[/bold]; all of them are in "
        f"{escape(str(found.folder))}",
        soft_wrap=True,
    )


def _steps_bar() -> rich.progress.Progress:
    columns = (
        rich.progress.TextColumn("{task.description}"),
        rich.progress.BarColumn(),
        rich.progress.TextColumn("{task.completed:,.0f} of {task.total:,.0f}"),
        rich.progress.TimeRemainingColumn(),
    )
    return rich.progress.Progress(*columns, console=OUTPUT)


def _judgements(task: "Task", names: Sequence[Any], judgements: "Sequence[Judgement]") -> Table:
    kind = "success" if "success" in task.events else "return"
    listing = table(
        "seed", f"{kind}, 2% random", "10% random", "after 50 random", "greedy return",
        "V of start", "achieved", "Q at crashes",
    )  # fmt: skip
    digits = 2 if "success" in task.events else 1
    for name, found in zip(names, judgements, strict=True):
        merits = (_number(merit, digits) for merit in found.merits)
        crash = "-" if found.crash_value is None else _number(found.crash_value, 1)
        rest = (found.greedy_return, found.start_value, found.start_return)
        listing.add_row(str(name), *merits, *(_number(number, 1) for number in rest), crash)
    listing.caption = (
        "V of start is what the values predict, achieved what greedy episodes return, both "
        "discounted. Q at crashes is predicted for the very action that crashed."
    )
    return listing


def _number(found: "MeanWithError", digits: int) -> str:
    return f"{found.mean:.{digits}f}"


def _check(task: "Task", path: Path, figures: Path | None) -> None:
    from qbumpers.experts import check_expert
    from qbumpers.experts.choosing import check_claim, judge
    from qbumpers.experts.loading import load_network
    from qbumpers.experts.quality import check_values, summarise

    values = load_network(task, path)
    OUTPUT.print(f"[bold]{escape(str(path))}[/bold]: {escape(values.method)}", soft_wrap=True)
    with OUTPUT.status("judging"):
        judgement = judge(task, values)
    OUTPUT.print(_judgements(task, ["-"], [judgement]))
    with expert_warnings_printed():
        check_expert(task, values)
        check_claim(task, judgement)
    with OUTPUT.status("going where learners go"):
        checks = check_values(task, values, discount=values.discount)
    found = summarise(checks)
    OUTPUT.print(
        f"- Off the greedy path values differ from what is achieved by {_signed(found.bias)} on "
        f"average, by {_with_error(found.absolute)} in size; {found.overestimated:.0%} are too "
        "high.",
        soft_wrap=True,
    )
    if found.crash_value is not None and found.crash_return is not None:
        OUTPUT.print(
            f"- One step before crashes they predict {_with_error(found.crash_value)}; the crash "
            f"brings {found.crash_return.mean:.1f}.",
            soft_wrap=True,
        )
    if figures is not None:
        _draw(checks, path, figures)


def _correct(task: "Task", path: Path, out: Path) -> None:
    from qbumpers.experts import correcting
    from qbumpers.experts.loading import load_network

    values = load_network(task, path)
    with _steps_bar() as bar:
        shown = bar.add_task("trying actions where learners go", total=correcting.BRANCHES)
        found = correcting.correct_values(
            task,
            values,
            branches=correcting.BRANCHES,
            report=lambda done: bar.update(shown, completed=done),
        )
        bar.update(shown, completed=correcting.BRANCHES)
    found.values.save(out)
    OUTPUT.print(
        f"- In states held out the error was {_with_error(found.before.absolute)} in size, now "
        f"{_with_error(found.after.absolute)}; its mean was {_signed(found.before.bias)}, now "
        f"{_signed(found.after.bias)}.\nCorrected values: [bold]{escape(str(out))}[/bold]",
        soft_wrap=True,
    )


def _signed(found: "MeanWithError") -> str:
    return f"{found.mean:+.1f} \N{PLUS-MINUS SIGN} {1.96 * found.error:.1f}"


def _with_error(found: "MeanWithError") -> str:
    return _signed(found).removeprefix("+")


def _draw(checks: "pl.DataFrame", path: Path, folder: Path) -> None:
    from qbumpers.analysis.figures.quality import quality_figure
    from qbumpers.analysis.figures.style import save

    drawn = save(quality_figure([(path.stem, checks)]), folder, f"{path.stem}-quality")
    OUTPUT.print(f"Figure: [bold]{escape(str(drawn))}[/bold]", soft_wrap=True)


def _solve_or_check(task: "Task", check: Path | None, figures: Path | None, path: Path) -> None:
    from qbumpers.experts.loading import load_table
    from qbumpers.experts.tables import check_exactness
    from qbumpers.values import solve, start_interval

    if figures is not None:
        raise RequestError(f"--figures {figures}: a table needs none, it is compared exactly")
    values = solve(task) if check is None else load_table(task, check)
    found = check_exactness(task, values)
    OUTPUT.print(f"{escape(task.name)}: {escape(values.method)}", soft_wrap=True)
    OUTPUT.print(
        f"V of the start {', '.join(f'{value:g}' for value in found.start_values)}; over "
        f"{found.pairs} states and actions the error is at most {found.largest_error:.2g}, its "
        f"mean {found.mean_error:.2g}",
        soft_wrap=True,
    )
    if task.estimate is not None:
        start = start_interval(task)
        OUTPUT.print(
            f"The table was {task.estimate.words()}. V* of the start: {start.value:.3g}, 95% "
            f"interval {start.low:.3g} to {start.high:.3g}",
            soft_wrap=True,
        )
    if check is None:
        values.save(path)
        OUTPUT.print(f"Values: [bold]{escape(str(path))}[/bold]", soft_wrap=True)
