"""What an experiment is: data, in a TOML file or as the same model in Python."""

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, model_validator

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.errors import RequestError, unknown_name
from qbumpers.experiments.cells import MANY_CELLS, trials_a_cell
from qbumpers.learners import PERCEPTIONS, QLearner, Schedule

Value = bool | int | float | str


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class TaskDesign(_Model):
    """Which task: a registered one by name, or a Gymnasium environment with a transition table.

    Attributes:
        name: for instance "cliff-walking" or "FrozenLake-v1".
        discount: of a Gymnasium environment, in (0, 1].
        episode_limit: of a Gymnasium environment, in steps; its own where left out.
        arguments: of a Gymnasium environment, for instance `{ is_slippery = true }`.
    """

    name: str
    discount: Annotated[float, Field(gt=0, le=1)] | None = None
    episode_limit: Annotated[int, Field(ge=1)] | None = None
    arguments: dict[str, Any] = {}


class ScheduleDesign(_Model):
    """A number that changes linearly over the first `fraction` of the episodes, then stays."""

    start: Annotated[float, Field(ge=0, le=1)] = 1.0
    end: Annotated[float, Field(ge=0, le=1)] = 0.02
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.9


class LearnerDesign(_Model):
    """A simulated person. In a file, a field given as a list is swept over.

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
    discount: Annotated[float, Field(gt=0, le=1)] | None = None
    epsilon: ScheduleDesign = ScheduleDesign()
    learning_rate: ScheduleDesign = ScheduleDesign()
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    penalty: Annotated[float, Field(allow_inf_nan=False)] = 1.0

    def learner(self, task_discount: float) -> QLearner:
        """The learner of this design, at a task of that discount."""
        return QLearner(
            discount=task_discount if self.discount is None else self.discount,
            epsilon=Schedule(**self.epsilon.model_dump()),
            learning_rate=Schedule(**self.learning_rate.model_dump()),
            initial_value=self.initial_value,
            penalty=self.penalty,
        )


class AssistantDesign(_Model):
    """An assistant by name, with its options; an option given as a list is swept over."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)

    name: str

    def assistants(self) -> list[Assistant]:
        """One assistant for each combination of listed options, the last option fastest."""
        combinations = swept(self.model_extra or {}, f"assistant {self.name}")
        return [make_assistant(self.name, **options) for options in combinations]


class NamedCondition(NamedTuple):
    """A condition of an experiment: one assistant with one set of options, and one learner.

    Attributes:
        condition: its readable id, for instance "stochastic-q-bumpers/alpha=0.7"; with
            "@perception=observant" at its end where the experiment has several learners.
        assistant: the assistant.
        learner: the simulated person.
        learner_id: the learner's readable id, for instance "q-learning".
    """

    condition: str
    assistant: Assistant
    learner: LearnerDesign
    learner_id: str


class Experiment(_Model):
    """An experiment: one task, the assistants to compare, and the people who learn with them.

    Attributes:
        name: of the experiment, and of its default output folder.
        reproduces: the published experiment to be compared with, for instance "cliff-walking".
        task: which task, as a table or just its name.
        values: Q* of the assistants: "exact", "q-learning", or the path of a values file.
        learners: the simulated people; every assistant meets each of them.
        assistants: what to compare; one for each combination of listed options.
        trials: people a condition.
        episodes: assisted episodes a trial, each followed by a greedy one without help.
        retention: further episodes in which people go on without the assistant.
        criterion: return without help that counts as having learned, in reward units.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition,
            so that conditions can be compared trial by trial.
        seed: of all random streams.
    """

    name: Annotated[str, Field(pattern=r"^\w[\w.-]*$")]
    reproduces: str | None = None
    task: TaskDesign
    values: str = "exact"
    learners: Annotated[list[LearnerDesign], Field(min_length=1)] = [LearnerDesign()]
    assistants: Annotated[list[AssistantDesign], Field(min_length=1)]
    trials: Annotated[int, Field(ge=1)] = 100
    episodes: Annotated[int, Field(ge=1)] = 100
    retention: Annotated[int, Field(ge=0)] = 0
    criterion: Annotated[float, Field(allow_inf_nan=False)] | None = None
    common_random_numbers: bool = False
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="before")
    @classmethod
    def _spelt_out(cls, settings: Any) -> Any:
        """A task given by its name, and learners with listed fields, in full."""
        if not isinstance(settings, dict):
            return settings
        settings = dict(settings)
        if isinstance(settings.get("task"), str):
            settings["task"] = {"name": settings["task"]}
        learners = settings.get("learners")
        if isinstance(learners, list):
            many = sum(combinations(each) for each in learners if isinstance(each, dict))
            if many > MANY_CELLS:
                raise RequestError(f"learners: {many:,} of them; at most {MANY_CELLS:,} are taken")
            settings["learners"] = [
                each
                for learner in learners
                for each in (swept(learner, "learner") if isinstance(learner, dict) else [learner])
            ]
        return settings

    @model_validator(mode="after")
    def _known_names(self) -> "Experiment":
        for learner in self.learners:
            if learner.perception not in PERCEPTIONS:
                raise unknown_name("learners.perception", learner.perception, PERCEPTIONS)
        if self.reproduces is not None and self.reproduces not in reproductions():
            raise unknown_name("reproduces", self.reproduces, reproductions())
        return self

    def trials_a_cell(self) -> int:
        """How many trials a whole cell has."""
        return trials_a_cell(self.episodes + self.retention)

    def condition_count(self) -> int:
        """How many conditions there are, counted without making them."""
        options = [assistant.model_extra or {} for assistant in self.assistants]
        return len(self.learners) * sum(map(combinations, options))

    def conditions(self) -> list[NamedCondition]:
        """The conditions, learner by learner, in the order of the file.

        Raises:
            RequestError: where an assistant or option is wrong, or a condition occurs twice.
        """
        assistants = [a for design in self.assistants for a in design.assistants()]
        names = [condition_id(assistant, assistants) for assistant in assistants]
        everyone = []
        for learner in self.learners:
            apart, learner_id = (_apart(learner, self.learners, mark) for mark in "@/")
            everyone += [
                NamedCondition(name + apart, assistant, learner, learner.name + learner_id)
                for name, assistant in zip(names, assistants, strict=True)
            ]
        for name, times in Counter(named.condition for named in everyone).items():
            if times > 1:
                raise RequestError(f"condition {name} occurs {times} times; keep one")
        return everyone


def combinations(options: Mapping[str, Any]) -> int:
    """How many combinations `swept` makes."""
    return math.prod(len(value) for value in options.values() if isinstance(value, list))


def swept(options: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """Every combination of listed options.

    Args:
        options: by name; lists are swept over.
        where: for messages, for instance "assistant stochastic-q-bumpers".

    Returns:
        Options by name, the last listed one changing fastest.

    Raises:
        RequestError: where a list is empty.
    """
    for option, values in options.items():
        if values == []:
            raise RequestError(f"{where}: {option} = []; at least one value is needed")
    lists = [value if isinstance(value, list) else [value] for value in options.values()]
    return [dict(zip(options, values, strict=True)) for values in itertools.product(*lists)]


def condition_id(assistant: Assistant, among: Sequence[Assistant]) -> str:
    """A readable id: the name, with options that have no default or vary among its kind.

    Args:
        assistant: of the condition.
        among: the assistants of all conditions.

    Returns:
        For instance "local-q-thresholding/alpha=0.0195".
    """
    options = assistant.options._asdict()
    defaults = assistant.rule.options_type._field_defaults  # type: ignore[attr-defined]
    others = [a.options._asdict() for a in among if a.name == assistant.name]
    shown = [
        f"{option}={_written(value)}"
        for option, value in options.items()
        if option not in defaults or any(other[option] != value for other in others)
    ]
    return "/".join([assistant.name, ",".join(shown)]) if shown else assistant.name


def _apart(learner: LearnerDesign, among: Sequence[LearnerDesign], mark: str) -> str:
    """What tells a learner from the others, after a mark; nothing where it is alone."""
    if len(among) == 1:
        return ""
    fields = learner.model_dump()
    others = [other.model_dump() for other in among]
    shown = [
        f"{field}={_written(value)}"
        for field, value in fields.items()
        if any(other[field] != value for other in others)
    ]
    return mark + ",".join(shown)


def _written(value: Any) -> str:
    if isinstance(value, dict):  # a schedule
        return "..".join(_written(part) for part in value.values())
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def reproductions() -> list[str]:
    """Names of the published experiments that can be repeated."""
    files = resources.files("qbumpers.experiments") / "built_in"
    return sorted(
        {
            file.name.removesuffix(".figures.toml")
            for file in files.iterdir()
            if file.name.endswith(".figures.toml")
        }
    )
