"""Simulated people of an experiment, as data: one model for each way of learning."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from qbumpers.learners import DoubleDQN, QLearner, Schedule
from qbumpers.networks import Network
from qbumpers.tasks import TabularTask, Task

Discount = Annotated[float, Field(gt=0, le=1)]
Count = Annotated[int, Field(ge=1)]
Units = Annotated[int, Field(ge=1, le=4096)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Model(BaseModel):
    """Data whose fields are all known, of exactly their kind, and never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class ScheduleDesign(Model):
    """A number that changes linearly over the first `fraction` of the episodes, then stays."""

    start: Annotated[float, Field(ge=0, le=1)] = 1.0
    end: Annotated[float, Field(ge=0, le=1)] = 0.02
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.9

    def schedule(self) -> Schedule:
        """The schedule of this design."""
        return Schedule(self.start, self.end, self.fraction)


class QLearnerDesign(Model):
    """A person who learns a table. In a file, a field given as a list is swept over.

    Attributes:
        name: "q-learning".
        perception: what they believe happened when they were overridden.
        discount: of their values; the task's where left out.
        epsilon: schedule of exploration.
        learning_rate: schedule of the step size.
        initial_value: of every action, in reward units.
        penalty: what an override feels like to a learner who perceives disruption, in reward units.
    """

    name: Literal["q-learning"] = "q-learning"
    perception: str = "transition"
    discount: Discount | None = None
    epsilon: ScheduleDesign = ScheduleDesign()
    learning_rate: ScheduleDesign = ScheduleDesign()
    initial_value: Finite = 0.0
    penalty: Finite = 1.0

    def learner(self, task_discount: float) -> QLearner:
        """The learner of this design, at a task of that discount."""
        return QLearner(
            discount=task_discount if self.discount is None else self.discount,
            epsilon=self.epsilon.schedule(),
            learning_rate=self.learning_rate.schedule(),
            initial_value=self.initial_value,
            penalty=self.penalty,
        )


class NetworkDesign(Model):
    """The shape of a network.

    Attributes:
        hidden: units of each hidden layer.
        activation: of hidden units.
        dueling: units of each of the two streams of a dueling network; 0 for a plain one.
    """

    hidden: list[Units] = [64, 64]
    activation: Literal["tanh", "relu"] = "tanh"
    dueling: Annotated[int, Field(ge=0, le=4096)] = 0


class DoubleDQNDesign(Model):
    """A person who learns a network. In a file, a field given as a list is swept over.

    Attributes:
        name: "double-dqn".
        perception: what they believe happened when they were overridden.
        discount: of their values; the task's where left out.
        network: its shape.
        epsilon: schedule of exploration.
        learning_rate: of Adam.
        batch_size: transitions of an update.
        replay_size: transitions that are remembered.
        learning_starts: steps before the first update; from then on there is one a step.
        target_every: steps after which the target network is renewed.
        clip: which norm of the gradient is clipped: of all parameters, of each variable, or none.
        gradient_limit: of that norm.
        penalty: what an override feels like to a learner who perceives disruption, in reward units.
    """

    name: Literal["double-dqn"] = "double-dqn"
    perception: str = "transition"
    discount: Discount | None = None
    network: NetworkDesign = NetworkDesign()
    epsilon: ScheduleDesign = ScheduleDesign(fraction=0.1)
    learning_rate: Annotated[float, Field(gt=0, le=1)] = 1e-3
    batch_size: Count = 32
    replay_size: Count = 50_000
    learning_starts: Count = 1_000
    target_every: Count = 1_500
    clip: Literal["global", "variable", "none"] = "global"
    gradient_limit: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 10.0
    penalty: Finite = 1.0

    def learner(self, task_discount: float) -> DoubleDQN:
        """The learner of this design, at a task of that discount."""
        settings = self.model_dump(exclude={"name", "perception"})
        shape = self.network
        return DoubleDQN(
            **settings
            | {
                "discount": task_discount if self.discount is None else self.discount,
                "network": Network(tuple(shape.hidden), shape.activation, shape.dueling),
                "epsilon": self.epsilon.schedule(),
            }
        )


LEARNERS = {"q-learning": QLearnerDesign, "double-dqn": DoubleDQNDesign}
"""Ways of learning by name."""


class _Named(BaseModel):
    model_config = ConfigDict(strict=True)

    name: Literal["q-learning", "double-dqn"] = "q-learning"


def _by_name(settings: Any) -> Any:
    """A learner by its name, so that messages are about fields of its own kind alone."""
    if isinstance(settings, QLearnerDesign | DoubleDQNDesign):
        return settings
    if not isinstance(settings, dict):
        return QLearnerDesign.model_validate(settings)
    return LEARNERS[_Named.model_validate(settings).name].model_validate(settings)


LearnerDesign = Annotated[QLearnerDesign | DoubleDQNDesign, BeforeValidator(_by_name)]
"""A simulated person, of the kind that its `name` says."""


def suitable_learner(task: Task) -> str:
    """Name of the way in which people can learn a task."""
    return "q-learning" if isinstance(task, TabularTask) else "double-dqn"


def apart(learner: LearnerDesign, among: Sequence[LearnerDesign], mark: str) -> str:
    """What tells a learner from others of its kind, after a mark; nothing where it is alone.

    Args:
        learner: one of them.
        among: the learners of an experiment.
        mark: put before what is told.

    Returns:
        For instance "@perception=observant".
    """
    if len(among) == 1:
        return ""
    fields = learner.model_dump()
    others = [other.model_dump() for other in among]
    shown = [
        f"{field}={written(value)}"
        for field, value in fields.items()
        if any(other[field] != value for other in others)
    ]
    return mark + ",".join(shown)


def written(value: Any) -> str:
    """A value as ids have it: short and exact."""
    if isinstance(value, dict):  # a schedule or a network
        return "..".join(written(part) for part in value.values())
    if isinstance(value, list):
        return "-".join(written(part) for part in value)
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)
