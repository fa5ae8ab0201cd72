"""What is wrong with the parts of a condition, found before any of it runs."""

import json
from typing import Any, cast

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.errors import RequestError, check_number, checked, in_short
from qbumpers.learners import (
    LearnerType,
    Motor,
    Perception,
    PowerLaw,
    learner_for_settings,
    learner_type,
)
from qbumpers.learners import perception as named_perception
from qbumpers.tasks import TabularTask, Task
from qbumpers.values import NetworkValues, QValues, check_width, solve
from qbumpers.values.exact import SOLVED_ROWS, solved_rows
from qbumpers.values.fitting import use_at
from qbumpers.values.others import all_further_values, further_values, numbered
from qbumpers.values.shipped import shipped_values
from qbumpers.values.tabular import as_values


def checked_values(
    task: Task, assistant: Assistant, values: QValues | np.ndarray | None
) -> tuple[Any, Any, float, tuple[str, ...]]:
    """Q* as a condition keeps it, the further rows, the discount, and the names of the rows.

    Args:
        task: what is to be learned.
        assistant: whose values they are.
        values: as `as_values` takes them; None for the exact solution of a task with a table, and
            for the expert that ships for one without. Rows of `SOLVED_ROWS` that values of a task
            with a table lack are solved, too.

    Raises:
        RequestError: if they do not fit the task, or an episode could start in a state that does
            not suit the assistant's options.
    """
    if not task.states:
        return _checked_network(task, assistant, values)
    source: Any = solve(task) if values is None else values
    source = as_values(source, use_at(task))
    table = _table(task, source, "")
    discount = float(getattr(source, "discount", task.discount))
    further = _all_further(task, assistant, source, discount)
    others = np.zeros((task.states, len(further), task.actions))
    for place, (name, row) in enumerate(further.items()):
        others[:, place] = _table(task, row, f" {name!r}")
    for state in np.flatnonzero(task.start):
        assistant.check_start(float(table[state].max()))
    return table, others, discount, tuple(further)


def _all_further(
    task: Task, assistant: Assistant, source: Any, discount: float
) -> dict[str, QValues]:
    """Further values by the names of their rows; solved if the given values hold none."""
    found: dict[str, QValues] = {}
    given = getattr(source, "others", {})
    for name in assistant.values:
        if name in SOLVED_ROWS and not {name, *numbered(name, 1)} & {*given}:
            found |= solved_rows(cast(TabularTask, task), name, discount)
        else:
            found |= further_values(source, name, assistant.name, task.actions)
    return found


def _table(task: Task, source: Any, name: str) -> np.ndarray:
    """Values of every state, float64 [S, A]; those of what the assistant sees of it."""
    seen = range(task.states) if task.seen is None else task.seen
    return np.stack(
        [
            check_width(source(int(number)), task.actions, f"{name} in state {state}".strip())
            for state, number in enumerate(seen)
        ]
    )


def _checked_network(
    task: Task, assistant: Assistant, values: QValues | np.ndarray | None
) -> tuple[Any, Any, float, tuple[str, ...]]:
    values = shipped_values(task) if values is None else as_values(values, use_at(task))
    if not isinstance(values, NetworkValues):
        raise RequestError(
            f"values = {in_short(values)}; the states of task {task.name} are vectors: give a "
            "network's values, for instance of load_values or train_expert"
        )
    # They have the shape of Q*, or there would be no such values.
    further = all_further_values(values, assistant.values, assistant.name, task.actions)
    return values, tuple(further.values()), values.discount, tuple(further)


def checked_learner(task: Task, settings: Any) -> Any:
    """Settings of a learner that suits a task; the paper's if `settings` is None.

    Raises:
        RequestError: if they are none, are out of range, or observe something else.
    """
    if settings is None:
        kind = learner_type(task.learners[0]).settings_type
        return kind(discount=task.discount)
    learner = learner_for_settings(type(settings))
    if (learner.observes == "states") != (task.states > 0):
        needed = "numbered states" if task.states else "vectors"
        raise RequestError(
            f"learner = {settings!r}; it observes {learner.observes}, and task {task.name} has "
            f"{needed}, as have the learners {', '.join(task.learners)}"
        )
    return checked(type(settings), plain(settings), "learner")


def checked_perception(learner: LearnerType, given: str | Perception | None) -> str | Perception:
    """What a learner believes happened: a perception with numbers in range, or the name of one.

    Args:
        learner: a kind of learner.
        given: as `Setup` has it; None for what this kind of learner has by itself.

    Raises:
        RequestError: if there is none of that name, a number is out of range, or the learner copies
            what was executed and would never see it.
    """
    perception = learner.perception if given is None else given
    if isinstance(perception, Perception):
        perception = found = checked(Perception, perception._asdict(), "perception")
    else:
        found = named_perception(perception)
    if learner.imitates and not (found.credits == "executed" and found.notices > 0):
        raise RequestError(
            f"perception = {in_short(given)}; learner {learner.name} copies what was executed, and "
            'would never see it: "observant" is needed, or another that notices overrides and then '
            'credits what was "executed"'
        )
    return perception


def checked_forgetting(task: Task, given: Any) -> float | PowerLaw:
    """A share that is forgotten, or a law, with numbers in range.

    Raises:
        RequestError: if it is neither, a number is out of range, or the task's learners have no
            tables.
    """
    if isinstance(given, PowerLaw):
        given = checked(PowerLaw, given._asdict(), "forgetting")
    else:
        check_number(given, "forgetting", "in [0, 1] or a PowerLaw")
        if not 0 <= given <= 1:
            raise RequestError(f"forgetting = {given!r}; it must lie in [0, 1]")
    if given and not task.states:
        raise RequestError(
            f"forgetting = {given!r}; at task {task.name} learners observe vectors, and only "
            "tables are forgotten"
        )
    return given


def checked_motor(motor: Any) -> Motor:
    """Motor noise with numbers in range.

    Raises:
        RequestError: if it is none, or a number is out of range.
    """
    if not isinstance(motor, Motor):
        raise RequestError(f"motor = {in_short(motor)}; a Motor is needed, as Motor(slip=0.1)")
    return checked(Motor, motor._asdict(), "motor")


def check_kept(where: str, settings: dict[str, Any]) -> None:
    """Check that settings can be written: they name results and seed random streams.

    Args:
        where: for messages, for instance "options of assistant guide".
        settings: values by name.

    Raises:
        RequestError: if one of them is nothing that a text can hold.
    """
    for field, value in settings.items():
        try:
            json.dumps(value)
        except (TypeError, ValueError) as error:
            raise RequestError(
                f"{where}: {field} = {value!r}; only numbers, texts, lists and tables of them, and "
                "Files of numbers, can be kept with results"
            ) from error


def plain(settings: Any) -> Any:
    """NamedTuples within NamedTuples as dictionaries."""
    if hasattr(settings, "_asdict"):
        return {field: plain(value) for field, value in settings._asdict().items()}
    return settings
