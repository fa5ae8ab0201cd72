"""What an experiment is: data, in a TOML file or as the same model in Python."""

import itertools
import tomllib
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.errors import RequestError, from_validation, unknown_name
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
    """The simulated person.

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
        options: dict[str, Any] = self.model_extra or {}
        lists = [value if isinstance(value, list) else [value] for value in options.values()]
        for option, values in zip(options, lists, strict=True):
            if not values:
                raise RequestError(
                    f"assistant {self.name}: {option} = []; at least one value is needed"
                )
        return [
            make_assistant(self.name, **dict(zip(options, values, strict=True)))
            for values in itertools.product(*lists)
        ]


class NamedAssistant(NamedTuple):
    """An assistant of an experiment under its readable id.

    Attributes:
        condition: the id, for instance "stochastic-q-bumpers/alpha=0.7".
        assistant: the assistant.
    """

    condition: str
    assistant: Assistant


class Experiment(_Model):
    """An experiment: one task, one learner, and the assistants to compare.

    Attributes:
        name: of the experiment, and of its default output folder.
        reproduces: the published experiment to be compared with, for instance "cliff-walking".
        task: which task, as a table or just its name.
        values: Q* of the assistants: "exact", "q-learning", or the path of a values file.
        learner: the simulated person.
        assistants: what to compare; one condition for each combination of listed options.
        trials: people a condition.
        episodes: assisted episodes a trial, each followed by a greedy one without help.
        seed: of all random streams.
    """

    name: Annotated[str, Field(pattern=r"^\w[\w.-]*$")]
    reproduces: str | None = None
    task: TaskDesign
    values: str = "exact"
    learner: LearnerDesign = LearnerDesign()
    assistants: Annotated[list[AssistantDesign], Field(min_length=1)]
    trials: Annotated[int, Field(ge=1)] = 100
    episodes: Annotated[int, Field(ge=1)] = 100
    seed: Annotated[int, Field(ge=0)] = 0

    def named_assistants(self) -> list[NamedAssistant]:
        """The conditions, in the order of the file.

        Raises:
            RequestError: where an assistant or option is wrong, or a condition occurs twice.
        """
        assistants = [a for design in self.assistants for a in design.assistants()]
        names = [condition_id(assistant, assistants) for assistant in assistants]
        for name in names:
            if names.count(name) > 1:
                raise RequestError(f"condition {name} occurs {names.count(name)} times; keep one")
        return [NamedAssistant(n, a) for n, a in zip(names, assistants, strict=True)]


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


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def make_experiment(settings: dict[str, Any], where: str = "experiment") -> Experiment:
    """An experiment from plain data, checked.

    Args:
        settings: what a TOML file would hold.
        where: for messages, for instance the path of the file.

    Returns:
        The experiment.

    Raises:
        RequestError: naming each field that is wrong, its value and what is allowed.
    """
    task = settings.get("task")
    if isinstance(task, str):
        settings = {**settings, "task": {"name": task}}
    try:
        experiment = Experiment.model_validate(settings)
    except ValidationError as error:
        raise from_validation(error, where, _field_names()) from error
    if experiment.learner.perception not in PERCEPTIONS:
        raise unknown_name(
            f"{where}: learner.perception", experiment.learner.perception, PERCEPTIONS
        )
    if experiment.reproduces is not None and experiment.reproduces not in reproductions():
        raise unknown_name(f"{where}: reproduces", experiment.reproduces, reproductions())
    try:
        experiment.named_assistants()
    except RequestError as error:
        raise RequestError(f"{where}: {error}") from error
    return experiment


def _field_names() -> list[str]:
    models = (Experiment, TaskDesign, LearnerDesign, ScheduleDesign)
    return sorted({field for model in models for field in model.model_fields})


def load_experiment(path: str | Path) -> Experiment:
    """An experiment from a TOML file.

    Args:
        path: of the file.

    Returns:
        The experiment.

    Raises:
        RequestError: where the file cannot be read, is no TOML, or a field is wrong.
    """
    try:
        settings = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise RequestError(f"experiment file {path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RequestError(f"experiment file {path}: not valid TOML: {error}") from error
    settings.pop("run", None)  # what an output folder adds: version, platform, time
    return make_experiment(settings, f"experiment file {path}")


PROFILES = ("figures", "text")
"""Readings of the paper: what reproduces its numbers, and what its text literally says."""


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


def reproduction(name: str, profile: str = "figures", **changes: Any) -> Experiment:
    """A published experiment.

    Args:
        name: for instance "cliff-walking".
        profile: "figures" or "text", see `PROFILES`.
        **changes: of fields, for instance `trials=20`; None leaves a field as it is.

    Returns:
        The experiment.

    Raises:
        RequestError: where a name is unknown or a change is wrong.
    """
    if name not in reproductions():
        raise unknown_name("reproduction", name, reproductions())
    if profile not in PROFILES:
        raise unknown_name("profile", profile, PROFILES)
    file = resources.files("qbumpers.experiments") / "built_in" / f"{name}.{profile}.toml"
    settings = tomllib.loads(file.read_text(encoding="utf-8"))
    settings.update({field: value for field, value in changes.items() if value is not None})
    return make_experiment(settings, f"{name}, profile {profile}")
