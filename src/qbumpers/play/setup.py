"""What is played: a task, the assistant's values of it, and the assistants that suit it."""

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.decisions import Model
from qbumpers.errors import RequestError, in_short
from qbumpers.experts.loading import load_network, load_table
from qbumpers.play.stepping import stepper_of
from qbumpers.session import Session
from qbumpers.tasks.display import Display
from qbumpers.tasks.registry import make_task
from qbumpers.tasks.task import Task
from qbumpers.values import solve
from qbumpers.values.offset import OffsetValues
from qbumpers.values.shipped import shipped_values


class Setup:
    """A task that can be played, with the values of whoever assists at it.

    Args:
        name: of the task, as `make_task` takes it.
        values: path of a values file; Q* is solved, or the shipped expert's, if None.
        step_limit: steps after which an episode ends at the latest; the task's own limit if None.
        **arguments: of `make_task`, JSON-like; None is left out.

    Attributes:
        task: what is played.
        display: how it is shown.
        limit: steps after which an episode ends.
        model: what a rule may know of it.
        values: gives Q* with further rows, by a tuple of their names; made when they are asked for.
        description: what it was made of, JSON-like, and the digests that its records hang on.

    Raises:
        RequestError: if there is no such task, it cannot be shown, or its values are not known.
    """

    def __init__(
        self,
        name: str,
        values: str | Path | None = None,
        step_limit: int | None = None,
        **arguments: Any,
    ) -> None:
        given = {field: value for field, value in arguments.items() if value is not None}
        self.task: Task = make_task(name, **given)
        self.display = _display_of(self.task)
        self.limit = min(step_limit or self.task.episode_limit, self.task.episode_limit)
        self.model = _model_of(self.task)
        self._source = None if values is None else str(values)
        self.values = functools.cache(self._values_with)
        self.description: dict[str, Any] = {
            "task": name,
            "arguments": given,
            "values": self._source,
            "digest": self.task.digest(),
            "revision": self.task.revision,
            "values digest": self.values(()).digest(),
        }
        if step_limit is not None:
            self.description["step limit"] = step_limit

    def session(self, assistant: Assistant) -> Session:
        """A session of an assistant at the task, before its first episode.

        Raises:
            RequestError: if the assistant does not suit the task, or there are no such values.
        """
        assistant.check_task(self.task.name, self.has)
        values: Any = self.values(tuple(assistant.values))
        return Session(
            assistant, values if self.task.seen is None else OffsetValues(values, 0), self.model
        )

    def described(self) -> str:
        """The description as JSON."""
        return json.dumps(self.description, sort_keys=True)

    def difference(self, description: Mapping[str, Any]) -> str:
        """What tells this setup from one of a record, in words; empty if nothing does."""
        for what, now in self.description.items():
            before = description.get(what)
            if before != now:
                return (
                    f"it was played with another {what} of task {description.get('task')}: "
                    f"{in_short(before)}, now {in_short(now)}"
                )
        return ""

    @functools.cached_property
    def has(self) -> Mapping[str, bool]:
        """What the task has of what rules may need."""
        return {
            "states": self.task.states > 0,
            "dynamics": self.model.dynamics is not None,
            "distance": self.task.has_distance,
            "undo": self.task.undoable,
            "no_op": self.task.no_op >= 0,
        }

    def seen(self, state: Any) -> Any:
        """What the assistant sees of a state."""
        return state if self.task.seen is None else int(self.task.seen[state])

    def make_stepper(self) -> Any:
        """The task to be stepped through: `reset(chance)`, `step(action)`, perhaps undo."""
        return stepper_of(self.task)

    def _values_with(self, others: Sequence[str]) -> Any:
        """Q* with further rows."""
        solved = "exact" in self.task.value_sources
        if self._source is not None:
            load = load_table if solved else load_network
            return load(self.task, self._source)
        return solve(self.task, others=others) if solved else _shipped(self.task)


def _shipped(task: Task) -> Any:
    try:
        return shipped_values(task)
    except RequestError as error:
        raise RequestError(f"{error}, with --values FILE") from error


def _display_of(task: Task) -> Display:
    display = task.display
    if display is None:
        raise RequestError(
            f"task {task.name}: it does not say how it is shown, so it cannot be played: give it "
            "make_display, see qbumpers.tasks.display"
        )
    return display


def _model_of(task: Task) -> Model:
    return Model(
        states=task.states,
        observation_size=task.observation_size,
        actions=task.actions,
        no_op=task.no_op,
        discount=task.discount,
        dynamics=task.dynamics() if task.states else None,
        distance=np.asarray(task.distance),
    )


def setup_of(description: Mapping[str, Any]) -> Setup:
    """The setup that a record describes, made again.

    Args:
        description: see `Setup.description`.

    Raises:
        RequestError: as `Setup`.
    """
    limit = description.get("step limit")
    return Setup(description["task"], description["values"], limit, **description["arguments"])
