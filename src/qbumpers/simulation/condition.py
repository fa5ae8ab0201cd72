"""What a trial needs, checked before any of it runs."""

import hashlib
from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.errors import RequestError, checked
from qbumpers.learners import QLearner
from qbumpers.learners import perception as named_perception
from qbumpers.tasks import TabularTask
from qbumpers.values import QValues, check_width, solve


class Condition(NamedTuple):
    """What a trial needs: everything but the seed and the number of the trial.

    Attributes:
        task: the task.
        values: float64 [S, A], Q* of the assistant.
        discount: of those values.
        assistant: the assistant.
        learner: the simulated person.
        perception: name of what they believe happened.
        episodes: E, assisted episodes of a trial, each followed by a greedy one without help.
        retention: R, further episodes in which the learner goes on without the assistant.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition.
    """

    task: TabularTask
    values: np.ndarray
    discount: float
    assistant: Assistant
    learner: QLearner
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
            "values": hashlib.sha256(self.values.tobytes()).hexdigest(),
            "discount": self.discount,
            "assistant": self.assistant.name,
            "options": self.assistant.options._asdict(),
            "learner": {
                **self.learner._asdict(),
                "epsilon": self.learner.epsilon._asdict(),
                "learning_rate": self.learner.learning_rate._asdict(),
            },
            "perception": self.perception,
            "episodes": self.episodes,
        }


def make_condition(
    task: TabularTask,
    assistant: Assistant | str,
    *,
    values: QValues | None = None,
    learner: QLearner | None = None,
    perception: str = "transition",
    episodes: int = 100,
    retention: int = 0,
    common_random_numbers: bool = False,
) -> Condition:
    """Check everything that a simulation needs, before any of it runs.

    Args:
        task: the task.
        assistant: an assistant, or the name of one that needs no options.
        values: Q* of the assistant; the exact solution where None. Values that state no discount
            are taken to have the task's.
        learner: the simulated person; where None, the paper's, with the task's discount.
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
    source = solve(task) if values is None else values
    table = np.stack(
        [
            check_width(source(state), task.actions, f"in state {state}")
            for state in range(task.states)
        ]
    )
    for state in np.flatnonzero(task.start):
        assistant.check_start(float(table[state].max()))
    return Condition(
        task=task,
        values=table,
        discount=float(getattr(source, "discount", task.discount)),
        assistant=assistant,
        learner=_checked_learner(learner or QLearner(discount=task.discount)),
        perception=perception,
        episodes=episodes,
        retention=retention,
        common_random_numbers=common_random_numbers,
    )


def _checked_learner(learner: QLearner) -> QLearner:
    schedules = {name: getattr(learner, name)._asdict() for name in ("epsilon", "learning_rate")}
    return checked(QLearner, {**learner._asdict(), **schedules}, "learner")
