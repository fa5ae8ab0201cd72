"""The cases of a comparison, each a task with a learner, as ordinary experiments."""

import functools
import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from qbumpers.comparison.methods import ANCHORS, METHODS, check_names, unsuited
from qbumpers.comparison.scales import Scales, best_return
from qbumpers.errors import RequestError
from qbumpers.experiments.design import Experiment, TaskDesign
from qbumpers.experiments.sources import make_experiment
from qbumpers.tasks import TabularTask
from qbumpers.tasks.registry import task_names

TASKS = (
    "cliff-walking", "larger-cliff", "windy-gridworld", "frozen-lake", "random-mdp", "inventory",
    "hidden-goal",
)  # fmt: skip
"""Tasks that are compared if none are named."""

EVERY = "all"
"""Stands for every registered task with a table of transitions that needs no arguments."""

LEARNERS = ("q-learning", "q-learning/perception=observant", "softmax-q-learning")
"""Learners that are compared if none are named."""

ANCHOR_TRIALS = 1000
"""Trials of each anchor, from which reference points come."""

TRIALS, EPISODES = 50, 100


class Setting(NamedTuple):
    """One setting of a method in a case.

    Attributes:
        method: name of the assistant.
        number: from 0, much help, on.
        condition: its id in the experiment.
    """

    method: str
    number: int
    condition: str


class Case(NamedTuple):
    """A task with a learner.

    Attributes:
        task: its name.
        learner: a kind with what differs from its defaults, for example
            "q-learning/perception=observant".
        anchors: the experiment that reference points come from.
        methods: the experiment with every setting of every method.
        settings: of the conditions of `methods`, in their order.
        best: the largest mean return that any policy has, in reward units.
        spread: of Q*, in reward units.
        left_out: why the task cannot carry a method, by its name.
    """

    task: str
    learner: str
    anchors: Experiment
    methods: Experiment
    settings: Sequence[Setting]
    best: float
    spread: float
    left_out: Mapping[str, str]

    @property
    def folder(self) -> str:
        """Where its experiments lie within the output folder."""
        return "/".join(re.sub(r"[^\w.-]+", "-", name) for name in (self.task, self.learner))


def make_cases(
    tasks: Sequence[str] = TASKS,
    learners: Sequence[str] = LEARNERS,
    assistants: Sequence[str] = (),
    *,
    trials: int = TRIALS,
    episodes: int = EPISODES,
    discount: float | None = None,
    seed: int = 0,
    imports: Sequence[str] = (),
) -> list[Case]:
    """The cases of a comparison: every task with every learner.

    Args:
        tasks: names, of tasks with a table of transitions; `EVERY` alone for every registered one
            that needs no arguments.
        learners: kinds of learners of numbered states, each with fields that differ from their
            defaults, for example "q-learning/perception=observant,forgetting=0.1".
        assistants: names of `METHODS`; all if empty.
        trials: simulated learners per setting.
        episodes: of each trial.
        discount: of tasks that are Gymnasium environments, which state none.
        seed: of all random streams.
        imports: modules that register what is named.

    Returns:
        The cases, task by task.

    Raises:
        RequestError: if a name is unknown, occurs twice or does not suit, or a number is out of
            range.
    """
    check_names(assistants)
    for field, names in (("tasks", tasks), ("learners", learners), ("assistants", assistants)):
        for name in names:
            if names.count(name) > 1:
                raise RequestError(f"{field}: {name} occurs {names.count(name)} times; keep one")
    common = {"trials": trials, "episodes": episodes, "seed": seed, "imports": [*imports]}
    return [
        _case(task, scales, learner, [*assistants] or [*METHODS], common)
        for task, scales in _scaled(tasks, episodes, discount).items()
        for learner in learners
    ]


def _scaled(
    tasks: Sequence[str], episodes: int, discount: float | None
) -> dict["_NamedTask", Scales]:
    """The scales of each task."""
    found: dict[_NamedTask, Scales] = {}
    every = [*tasks] == [EVERY]
    for name in task_names() if every else tasks:
        design = _NamedTask(name, None if name in task_names() else discount)
        try:
            task = TaskDesign(name=name, discount=design.discount).task()
        except RequestError:
            if not every:
                raise
            continue  # it needs arguments, or what is not installed
        if isinstance(task, TabularTask):
            found[design] = Scales(task, episodes)
        elif not every:
            raise RequestError(
                f"tasks = {name!r}; its observations are vectors, and tasks with a table of "
                "transitions are compared"
            )
    return found


class _NamedTask(NamedTuple):
    name: str
    discount: float | None


def _case(
    task: _NamedTask, scales: Scales, learner: str, assistants: Sequence[str], common: Any
) -> Case:
    reasons = {name: unsuited(name, scales) for name in assistants}
    settings = {
        name: METHODS[name].settings(scales) for name, reason in reasons.items() if not reason
    }
    if not settings:
        raise RequestError(
            f"assistants: task {task.name} can carry none of {', '.join(assistants)}"
        )
    settings_of_run = {
        "name": re.sub(r"[^\w.-]+", "-", task.name),
        "task": {field: value for field, value in task._asdict().items() if value is not None},
        "learners": [learner_table(learner)],
        "values": "exact",
        **common,
    }
    make = functools.partial(make_experiment, where=f"{task.name} with {learner}", large=True)
    compared = [{"name": name, **options} for name, each in settings.items() for options in each]
    methods = make({**settings_of_run, "assistants": compared})
    anchors = [{"name": name} for name in ANCHORS]
    numbered = [(name, place) for name, each in settings.items() for place in range(len(each))]
    return Case(
        task=task.name,
        learner=learner,
        anchors=make({**settings_of_run, "assistants": anchors, "trials": ANCHOR_TRIALS}),
        methods=methods,
        settings=[
            Setting(name, place, each.condition)
            for (name, place), each in zip(numbered, methods.conditions(), strict=True)
        ],
        best=best_return(scales.task),
        spread=scales.spread,
        left_out={name: reason for name, reason in reasons.items() if reason},
    )


def learner_table(text: str) -> dict[str, Any]:
    """A learner as a file has it, from its name and fields.

    Args:
        text: for example "q-learning/perception=observant,forgetting=0.1"; values are TOML, or
            words.

    Raises:
        RequestError: if a field has no value.
    """
    name, _, rest = text.partition("/")
    fields = [part.partition("=") for part in rest.split(",")] if rest else []
    if not all(field and value for field, _, value in fields):
        raise RequestError(
            f"learners = {text!r}; a name is needed, or a name with fields, for example "
            "q-learning/perception=observant"
        )
    return {"name": name, **{field: _value(value) for field, _, value in fields}}


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def command(cases: Sequence[Case]) -> str:
    """The command that repeats a comparison."""
    first = cases[0].methods
    compared = dict.fromkeys(
        name for case in cases for name in (*case.left_out, *(s.method for s in case.settings))
    )
    discounts = {case.methods.task.discount for case in cases} - {None}
    parts = [
        f"--tasks {','.join(dict.fromkeys(case.task for case in cases))}",
        *(f"--learner {name}" for name in dict.fromkeys(case.learner for case in cases)),
        *([f"--assistants {','.join(compared)}"] if set(compared) != set(METHODS) else []),
        f"--trials {first.trials} --episodes {first.episodes} --seed {first.seed}",
        *(f"--discount {discount:g}" for discount in discounts),
        *(f"--import {module}" for module in first.imports),
    ]
    return " ".join(["qbumpers compare", *parts])
