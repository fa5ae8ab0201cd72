"""What a trial needs, checked before any of it runs."""

import hashlib
from collections.abc import Mapping
from typing import Any, NamedTuple, TypedDict, Unpack

import numpy as np

from qbumpers.assistants import Assistant, assistant_of
from qbumpers.borrowing import read_only
from qbumpers.decisions import Model
from qbumpers.errors import (
    RequestError,
    check_number,
    unknown_name,
    whole_number,
)
from qbumpers.learners import LearnerType, Motor, Perception, PowerLaw, learner_for_settings
from qbumpers.learners import perception as named_perception
from qbumpers.random_streams import episode_streams, trial_streams
from qbumpers.registration import as_numbers, files_from, files_in
from qbumpers.simulation.checking import (
    check_kept,
    checked_forgetting,
    checked_learner,
    checked_motor,
    checked_perception,
    checked_values,
    plain,
)
from qbumpers.simulation.outcomes import Outcomes
from qbumpers.simulation.packing import Own
from qbumpers.tasks import Task
from qbumpers.tasks.registry import Named, as_task
from qbumpers.values import NetworkValues, QValues

_FIRST_LEARNERS = ("q-learning", "double-dqn")  # what these seed does not name them


class Setup(TypedDict, total=False):
    """What `simulate` and `make_condition` take by name, beside task and assistant.

    Attributes:
        values: Q* of the assistant, as an array [S, A] or a function; if left out, the exact
            solution of a task with a table, else those of the expert that ships for the task.
            Values that state no discount are taken to have the task's.
        learner: settings of a registered learner, for instance `QLearner()`; the paper's, with the
            task's discount, if left out.
        perception: what the learner believes happened when it was overridden, a `Perception` or the
            name of one of `qbumpers.learners.PERCEPTIONS`; if left out "transition", or "observant"
            if the learner imitates.
        penalty: what an override feels like to one of the named perceptions that include
            disruption, in reward units; 1 if left out.
        motor: how the learner's hand errs; never if left out.
        forgetting: share of the way back to what it knew at first that the learner of a table goes
            between two episodes, in [0, 1], or a `qbumpers.learners.PowerLaw`; 0 if left out.
        episodes: of a trial, at least 1; 100 if left out.
        retention: further episodes in which the learner goes on without the assistant, each
            followed by a greedy one; 0 if left out.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.
        discount: of a task that is given as a Gymnasium environment or its name; others state one.
    """

    values: QValues | np.ndarray | None
    learner: Any
    perception: str | Perception
    penalty: float
    motor: Motor
    forgetting: float | PowerLaw
    episodes: int
    retention: int
    common_random_numbers: bool
    discount: float | None


class Condition(NamedTuple):
    """What a trial needs: everything but the seed and the number of the trial.

    Attributes:
        task: what is to be learned.
        values: Q* of the assistant; float64 [S, A] if the task has a table, else a network.
        others: the further rows of values that the assistant's rule named, float64 [S, K, A], or
            networks.
        discount: gamma of those values, in (0, 1].
        assistant: what helps in the first `episodes`.
        learner: settings of the simulated learner.
        perception: what it believes happened, or the name of that.
        penalty: of a named perception that includes disruption, in reward units.
        motor: how its hand errs.
        forgetting: share forgotten between two episodes, or the law by which it is.
        episodes: E, assisted episodes of a trial, each followed by a greedy unassisted one.
        retention: R, further episodes in which the learner goes on without the assistant.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.
        files: what is in the files that the learner's settings name, float64 [N, K] by name.
        row_names: names of the further rows.
    """

    task: Task
    values: Any
    others: Any
    discount: float
    assistant: Assistant
    learner: Any
    perception: str | Perception = "transition"
    penalty: float = 1.0
    motor: Motor = Motor()
    forgetting: float | PowerLaw = 0.0
    episodes: int = 100
    retention: int = 0
    common_random_numbers: bool = False
    files: Mapping[str, np.ndarray] = {}
    row_names: tuple[str, ...] = ()

    def __reduce__(self) -> Any:
        """Pickle with the user's own rules and learner, which are registered on unpickling."""
        # First of the arguments, so that they are there when the others, which name them, come.
        return _arrived, (Own(self.assistant.chain, [self.learner_type]), *self)

    @property
    def learner_type(self) -> LearnerType:
        """The registered kind of its learner."""
        return learner_for_settings(type(self.learner))

    def perceived(self) -> Perception:
        """What the learner believes happened."""
        if isinstance(self.perception, Perception):
            return self.perception
        found = named_perception(self.perception)
        return found._replace(penalty=self.penalty) if found.penalty else found

    def model(self) -> Model:
        """What a rule with memory may know of the task."""
        task = self.task
        dynamics = task.dynamics() if task.states else None
        return Model(
            task.states,
            task.observation_size,
            task.actions,
            task.no_op,
            self.discount,
            read_only(dynamics),
            read_only(task.distance),
        )

    def content(self) -> dict[str, Any]:
        """All that decides a trial's outcomes, as JSON-like data: it names stored results."""
        return {
            **self.learning(),
            "retention": self.retention,
            "common_random_numbers": self.common_random_numbers,
        }

    def learning(self) -> dict[str, Any]:
        """What decides the assisted episodes, as JSON-like data: it seeds the random streams.

        Streams, and with them published numbers, hang on every byte of it: what came later is in it
        only if it is used.
        """
        named = isinstance(self.perception, str)
        added = {
            "learner name": ""
            if self.learner_type.name in _FIRST_LEARNERS
            else self.learner_type.name,
            "motor": plain(self.motor) if self.motor != Motor() else None,
            "forgetting": plain(self.forgetting),
            "others": _digest(self.others) if self.assistant.values else "",
            "files": [*_file_digests(self.assistant), *map(_digest, self.files.values())],
        }
        return {
            "task": self.task.digest(),
            "values": _digest(self.values),
            "discount": self.discount,
            "assistant": self.assistant.name,
            "options": self.assistant.described(),
            "learner": {**plain(self.learner), "penalty": self.penalty},
            "perception": self.perception if named else plain(self.perception),
            "episodes": self.episodes,
            **{name: part for name, part in added.items() if part},
        }


def _arrived(own: None, *fields: Any) -> Condition:
    return Condition(*fields)


def _digest(values: Any) -> Any:
    if isinstance(values, tuple):
        return [each.digest() for each in values]
    if isinstance(values, NetworkValues):
        return values.digest()
    return hashlib.sha256(values.tobytes()).hexdigest()


def _file_digests(assistant: Assistant) -> list[str]:
    """What the files among an assistant's options hold."""
    own = [
        hashlib.sha256(value.tobytes()).hexdigest()
        for value in assistant.numbers
        if isinstance(value, np.ndarray)
    ]
    return own + (_file_digests(assistant.of) if assistant.of else [])


def make_condition(
    task: Task | Named, assistant: Assistant | str, **setup: Unpack[Setup]
) -> Condition:
    """Check everything that a simulation needs, before any of it runs.

    Args:
        task: what is to be learned: a task, or what `make_task` makes one of.
        assistant: an assistant, or the name of one that needs no options.
        **setup: see `Setup`.

    Returns:
        The condition.

    Raises:
        RequestError: if a name is unknown, a number is out of range, the values do not fit the
            task, the task lacks what the assistant needs, or an episode could start in a state that
            does not suit the assistant's options.
    """
    for name in setup:
        if name not in Setup.__annotations__:
            raise unknown_name("setting", name, Setup.__annotations__)
    task = as_task(task, setup.get("discount"))
    helper = assistant_of(assistant, "assistant")
    helper.check_task(task.name, had_by(task))
    table, others, gamma, rows = checked_values(task, helper, setup.get("values"))
    learner = checked_learner(task, setup.get("learner"))
    condition = Condition(
        task,
        table,
        others,
        gamma,
        helper,
        learner,
        checked_perception(learner_for_settings(type(learner)), setup.get("perception")),
        setup.get("penalty", 1.0),
        checked_motor(setup.get("motor", Motor())),
        checked_forgetting(task, setup.get("forgetting", 0.0)),
        whole_number(setup.get("episodes", 100), "episodes", "from 1 up"),
        whole_number(setup.get("retention", 0), "retention", "from 0 up"),
        setup.get("common_random_numbers", False),
    )
    _check_numbers(condition)
    check_kept(f"options of assistant {helper.name}", helper.described())
    check_kept(f"learner {condition.learner_type.name}", plain(condition.learner))
    files = files_in(condition.learner, as_numbers(condition.learner))
    return condition._replace(files=files, row_names=rows)


def _check_numbers(condition: Condition) -> None:
    check_number(condition.penalty, "penalty", "of reward units")
    if condition.episodes < 1:
        raise RequestError(f"episodes = {condition.episodes!r}; at least 1 is needed")
    if condition.retention < 0:
        raise RequestError(f"retention = {condition.retention!r}; 0 or more is needed")


def had_by(task: Task) -> dict[str, bool]:
    """Whether a task has it, for each of what a rule may need."""
    return {
        "states": task.states > 0,
        "dynamics": task.states > 0 and task.seen is None,  # rules count states as they are seen
        "distance": task.has_distance,
        "undo": task.undoable,
        "no_op": task.no_op >= 0,
    }


def compiled_learner(condition: Condition) -> tuple[Any, Perception, Motor | None]:
    """Settings, perception and motor noise as compiled loops take them."""
    motor = None if condition.motor == Motor() else condition.motor
    perception = as_numbers(condition.perceived())
    with files_from(condition.files):
        return as_numbers(condition.learner), perception, motor


def outcome_room(condition: Condition, trials: int) -> Outcomes:
    """Arrays [T, E] for the outcomes of so many trials, to be filled."""
    kinds = (np.float64, np.float64, np.int32, np.int32, np.int32, np.uint8, np.uint8)
    shape = (trials, condition.episodes + condition.retention)
    return Outcomes(*(np.zeros(shape, kind) for kind in kinds))


def streams(condition: Condition, trials: range, seed: int) -> np.ndarray:
    """Random streams of trials: uint64 [T, 1, 4, 4]; [T, E, 4, 4] to begin anew each episode."""
    if condition.common_random_numbers:
        # Each episode begins anew: episodes of other length before it change nothing.
        episodes = condition.episodes + condition.retention
        return episode_streams(seed, {"common_random_numbers": True}, trials, episodes)
    return trial_streams(seed, condition.learning(), trials)[:, None]
