"""Whether values fit what they are put to: what is known of both is compared, before any step."""

from typing import Any, NamedTuple

import gymnasium
from gymnasium import spaces

from qbumpers.errors import RequestError, counted, in_short
from qbumpers.tasks.construction import description_of
from qbumpers.tasks.identity import (
    environment_digest,
    has_table,
    task_inside,
)
from qbumpers.tasks.observing import way_to_vectors
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Task
from qbumpers.tasks.wrapping import altering_wrappers

MEANT = "if it is meant, say so by dataclasses.replace(values, made_for='')"


class Use(NamedTuple):
    """What values are put to.

    Attributes:
        name: for messages, for instance "task cliff-walking".
        rows: numbers of states that a table needs a row of; 0 if states are not numbered.
        inputs: numbers of an observation that is a vector; 0 if it is none.
        actions: A.
        identity: as tasks have it; empty if it is not known.
        discount: of values that state none, in (0, 1]; None if it is not known.
        advice: how the observation becomes a vector if it is none, for messages.
    """

    name: str
    rows: int
    inputs: int
    actions: int
    identity: str = ""
    discount: float | None = None
    advice: str = ""

    def needs(self) -> str:
        """What kind of values, in words."""
        if self.rows:
            return f"a table [{self.rows}, {self.actions}]"
        if self.inputs:
            inputs, actions = counted(self.inputs, "input"), counted(self.actions, "action")
            return f"a network of {inputs} and {actions}"
        return "a function of observations that are neither numbers of states nor vectors"


def use_at(task: Task) -> Use:
    """What values of a task are put to."""
    rows = task.states if task.seen is None else int(max(task.seen)) + 1
    name = f"task {task.name}"
    return Use(
        name, rows, task.observation_size, task.actions, task.identity(), float(task.discount)
    )


def use_in(environment: Any, name: str, states: int, inputs: int, stated: Any) -> Use:
    """What values are put to in an environment as the caller has it.

    Args:
        environment: with any wrappers.
        name: of it, for messages.
        states: number of its states; 0 if they are not numbered.
        inputs: numbers of its observation; 0 if it is no vector.
        stated: values that say what they were made for; of others nothing more is asked.

    Raises:
        RequestError: naming a wrapper whose effect on what they were made for is not known.
    """
    use = Use(
        f"environment {name}", states, inputs, int(environment.action_space.n),
        advice=way_to_vectors(environment.observation_space),
    )  # fmt: skip
    if not getattr(stated, "made_for", ""):
        return use
    return use._replace(identity=_identity_of(environment, name, stated.task))


def _identity_of(environment: Any, name: str, made_for: str) -> str:
    """Of the task that an environment is; empty if it cannot be known."""
    task = task_inside(environment)
    if task is None and has_table(environment):
        table = description_of(environment, episode_limit=1).table
        return TabularTask.from_table(**table, discount=1.0).identity()
    spec = environment.spec
    if task is None and (spec is None or spec.id != made_for):
        return ""
    registered = gymnasium.registry[spec.id].additional_wrappers if spec else ()
    # A task may have these two besides; what is observed through them is compared.
    known = {*(each.name for each in registered), "FlattenObservation", "FilterObservation"}
    for layer in altering_wrappers(environment):
        kind = type(layer).__name__
        if kind not in known:
            raise RequestError(
                f"environment {name}: the values were made without wrapper {kind}; put it around "
                f"shared control or leave it out, or, {MEANT}"
            )
    if task is not None:
        return task.identity()
    # A table of such an environment was estimated, and no two estimates are alike.
    numbered = isinstance(environment.observation_space, spaces.Discrete)
    return "" if numbered else environment_digest(environment)


def check_fit(values: Any, use: Use) -> None:
    """Compare what values say of themselves with what they are put to.

    Args:
        values: of any kind; a function says nothing of itself.
        use: what they are put to.

    Raises:
        RequestError: if the kind, a size, or what they were made for differs.
    """
    if not callable(values):
        raise RequestError(
            f"values = {in_short(values)}; {use.needs()} is needed for {use.name}: TabularValues "
            "makes it of an array, load_values of a file; any function will do that gives one "
            "value per action"
        )
    fit = getattr(values, "check_fit", None)
    if fit is not None:
        fit(use)


def check_made_for(values: Any, use: Use) -> None:
    """RequestError if values state what they were made for, and it is something else."""
    if values.made_for and use.identity and values.made_for != use.identity:
        raise RequestError(
            f"values of {values.task}: they were made for a task that differs from {use.name} in "
            f"what its actions do, bring or end; make them anew, or, {MEANT}"
        )
