"""What a trial needs, checked before any of it runs."""

import hashlib
from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.errors import RequestError, checked
from qbumpers.learners import DoubleDQN, QLearner
from qbumpers.learners import perception as named_perception
from qbumpers.random_streams import episode_streams, trial_streams
from qbumpers.simulation.outcomes import Outcomes
from qbumpers.tasks import TabularTask, Task
from qbumpers.values import NetworkValues, QValues, check_width, solve


class Condition(NamedTuple):
    """What a trial needs: everything but the seed and the number of the trial.

    Attributes:
        task: the task.
        values: Q* of the assistant; float64 [S, A] of a tabular task, else a network.
        discount: of those values.
        assistant: the assistant.
        learner: the simulated person.
        perception: name of what they believe happened.
        episodes: E, assisted episodes of a trial, each followed by a greedy one without help.
        retention: R, further episodes in which the learner goes on without the assistant.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.
    """

    task: Task
    values: Any
    discount: float
    assistant: Assistant
    learner: QLearner | DoubleDQN
    perception: str
    episodes: int
    retention: int = 0
    common_random_numbers: bool = False

    def content(self) -> dict[str, Any]:
        """All that decides a trial's outcomes, as JSON-like data: it names stored results."""
        return {
            **self.learning(),
            "retention": self.retention,
            "common_random_numbers": self.common_random_numbers,
        }

    def learning(self) -> dict[str, Any]:
        """What decides the assisted episodes, as JSON-like data: it seeds the random streams."""
        return {
            "task": self.task.digest(),
            "values": _digest(self.values),
            "discount": self.discount,
            "assistant": self.assistant.name,
            "options": self.assistant.options._asdict(),
            "learner": _plain(self.learner),
            "perception": self.perception,
            "episodes": self.episodes,
        }


def _digest(values: Any) -> str:
    if isinstance(values, NetworkValues):
        return values.digest()
    return hashlib.sha256(values.tobytes()).hexdigest()


def _plain(settings: Any) -> Any:
    """NamedTuples within NamedTuples as dictionaries."""
    if hasattr(settings, "_asdict"):
        return {field: _plain(value) for field, value in settings._asdict().items()}
    return settings


def make_condition(
    task: Task,
    assistant: Assistant | str,
    *,
    values: QValues | None = None,
    learner: QLearner | DoubleDQN | None = None,
    perception: str = "transition",
    episodes: int = 100,
    retention: int = 0,
    common_random_numbers: bool = False,
) -> Condition:
    """Check everything that a simulation needs, before any of it runs.

    Args:
        task: the task.
        assistant: an assistant, or the name of one that needs no options.
        values: Q* of the assistant; where None, the exact solution of a tabular task. Values that
            state no discount are taken to have the task's.
        learner: the simulated person; where None, the paper's, with the task's discount: a
            `QLearner` at a tabular task, else a `DoubleDQN`.
        perception: name of a learner model, see `qbumpers.learners.PERCEPTIONS`.
        episodes: of a trial, at least 1.
        retention: further episodes without the assistant, not negative.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.

    Returns:
        The condition.

    Raises:
        RequestError: where a name is unknown, a number is out of range, the values do not fit the
            task, or an episode could start where the assistant's options do not suit it.
    """
    if episodes < 1:
        raise RequestError(f"episodes = {episodes!r}; at least 1 is needed")
    if retention < 0:
        raise RequestError(f"retention = {retention!r}; 0 or more is needed")
    if isinstance(assistant, str):
        assistant = make_assistant(assistant)
    named_perception(perception)
    kept, discount = _checked_values(task, assistant, values)
    return Condition(
        task=task,
        values=kept,
        discount=discount,
        assistant=assistant,
        learner=_checked_learner(task, learner),
        perception=perception,
        episodes=episodes,
        retention=retention,
        common_random_numbers=common_random_numbers,
    )


def _checked_values(task: Task, assistant: Assistant, values: QValues | None) -> tuple[Any, float]:
    """Q* as a condition keeps it, and its discount."""
    if isinstance(task, TabularTask):
        source = solve(task) if values is None else values
        table = np.stack(
            [
                check_width(source(state), task.actions, f"in state {state}")
                for state in range(task.states)
            ]
        )
        for state in np.flatnonzero(task.start):
            assistant.check_start(float(table[state].max()))
        return table, float(getattr(source, "discount", task.discount))
    if not isinstance(values, NetworkValues):
        raise RequestError(
            f"values = {values!r}; task {task.name} cannot be solved exactly: give a network's "
            "values, for instance of load_values or train_expert"
        )
    found = (values.inputs, values.actions)
    if found != (task.observation_size, task.actions):
        raise RequestError(
            f"values of {values.task}: a network of {found[0]} inputs and {found[1]} actions; task "
            f"{task.name} needs {task.observation_size} and {task.actions}"
        )
    return values, values.discount


def _checked_learner(task: Task, learner: QLearner | DoubleDQN | None) -> QLearner | DoubleDQN:
    kind = QLearner if isinstance(task, TabularTask) else DoubleDQN
    learner = kind(discount=task.discount) if learner is None else learner
    if not isinstance(learner, kind):
        raise RequestError(
            f"learner = {learner!r}; at task {task.name} people learn by a {kind.__name__}"
        )
    return checked(kind, _plain(learner), "learner")


def outcome_room(condition: Condition, trials: int) -> Outcomes:
    """Room for the outcomes of so many trials."""
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
