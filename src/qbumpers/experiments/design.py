"""What an experiment is: data, in a TOML file or as the same model in Python."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    SerializeAsAny,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.errors import RequestError, unknown_name
from qbumpers.experiments.cells import MANY_CELLS, trials_a_cell
from qbumpers.experiments.learner_designs import (
    RECORDED,
    LearnerDesign,
    apart,
    by_name,
    written,
)
from qbumpers.experiments.models import Model
from qbumpers.experiments.sweeps import combinations, options_listed, swept, tables_listed
from qbumpers.imports import import_modules
from qbumpers.learners import learners
from qbumpers.tasks import Task, make_task

REPRODUCTIONS = ("cliff-walking", "lunar-lander")
"""What `reproduces` may name: published experiments, those of `qbumpers.reproduction`."""


PARTICIPANT = "participant"
"""In the place of a learner's name: a person, who is not simulated."""


class TaskDesign(Model):
    """Which task: a registered one by name, or a Gymnasium environment.

    Attributes:
        name: for instance "cliff-walking", "FrozenLake-v1", or "my_tasks:Maze-v0" after the module
            that registers it.
        discount: gamma, in (0, 1], for a Gymnasium environment, which states none.
        episode_limit: of a Gymnasium environment, in steps; its own if left out.
        arguments: of the task, for instance `{ seed = 0 }` of "lunar-lander", or of a Gymnasium
            environment, for instance `{ is_slippery = true }`.
    """

    name: str
    discount: Annotated[float, Field(gt=0, le=1)] | None = None
    episode_limit: Annotated[int, Field(ge=1)] | None = None
    arguments: dict[str, Any] = Field(default_factory=dict)

    def task(self) -> Task:
        """The task of this design; RequestError if there is none."""
        return make_task(
            self.name,
            discount=self.discount,
            episode_limit=self.episode_limit,
            **self.arguments,
        )


class AssistantDesign(Model):
    """An assistant by name, with its options; an option given as a list is swept over."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)

    name: str

    def assistants(self) -> list[Assistant]:
        """One assistant for each combination of listed options, the last option fastest."""
        listed = options_listed(self.name, self.model_extra or {})
        combinations = swept(listed, f"assistant {self.name}")
        return [make_assistant(self.name, **options) for options in combinations]

    def count(self) -> int:
        """How many assistants there are, counted without making them."""
        return combinations(options_listed(self.name, self.model_extra or {}))


class NamedCondition(NamedTuple):
    """A condition of an experiment: one assistant with one set of options, and one learner.

    Attributes:
        condition: its readable id, for instance "stochastic-q-bumpers/alpha=0.7"; with
            "@perception=observant" at its end if the experiment has several learners.
        assistant: rule and options.
        learner: who meets the assistant.
        learner_id: the learner's readable id, for instance "q-learning".
    """

    condition: str
    assistant: Assistant
    learner: LearnerDesign
    learner_id: str


class Experiment(Model):
    """An experiment: one task, the assistants to compare, and the learners who learn with them.

    Attributes:
        name: of the experiment, and of its default output folder.
        reproduces: the published experiment to be compared with, for instance "cliff-walking".
        task: which task, as a table or just its name.
        values: Q* of the assistants: "exact" or "q-learning" for a task with a table, "expert" for
            the expert that ships for a task, or the path of a values file. If left out, exact
            for a task with a table, else the expert's.
        learners: the simulated learners; every assistant meets each of them. If left out, the
            paper's, of the kind that suits the task.
        assistants: what to compare; one for each combination of listed options.
        trials: simulated learners per condition.
        episodes: assisted episodes per trial, each followed by a greedy unassisted one.
        retention: further episodes in which learners go on without the assistant.
        criterion: unassisted return that counts as having learned, in reward units.
        common_random_numbers: whether trials of equal number draw equal numbers in every condition,
            so that conditions can be compared trial by trial.
        seed: from which, with the content of each condition, all random streams come.
        imports: modules that are imported first: they register what the experiment names.
    """

    name: Annotated[str, Field(pattern=r"^\w[\w.-]*$")]
    reproduces: str | None = None
    task: TaskDesign
    values: str
    learners: Annotated[
        list[Annotated[SerializeAsAny[LearnerDesign], BeforeValidator(by_name)]],
        Field(min_length=1),
    ]
    assistants: Annotated[list[AssistantDesign], Field(min_length=1)]
    trials: Annotated[int, Field(ge=1)] = 100
    episodes: Annotated[int, Field(ge=1)] = 100
    retention: Annotated[int, Field(ge=0)] = 0
    criterion: Annotated[float, Field(allow_inf_nan=False)] | None = None
    common_random_numbers: bool = False
    seed: Annotated[int, Field(ge=0)] = 0
    imports: list[str] = Field(default_factory=list)

    @model_validator(mode="before")
    @classmethod
    def _spelt_out(cls, settings: Any, info: ValidationInfo) -> Any:
        """What is left out or written shortly, in full; so are the settings of a finished run."""
        if not isinstance(settings, dict) or info.context == RECORDED:
            return settings
        if isinstance(settings.get("imports"), list):
            import_modules(settings["imports"], "imports")
        settings = {"learners": [{}], **settings}
        if isinstance(settings.get("task"), str):
            settings["task"] = {"name": settings["task"]}
        if isinstance(settings["learners"], list):
            settings["learners"] = _all_learners(settings["learners"], settings.get("task"))
            names = [one.get("name") for one in settings["learners"] if isinstance(one, dict)]
            deep = any(learner_observes(name) == "vectors" for name in names)
            settings.setdefault("values", "expert" if deep else "exact")
        return settings

    @model_validator(mode="after")
    def _known_names(self, info: ValidationInfo) -> "Experiment":
        for learner in [] if info.context == RECORDED else self.learners:
            if learner.observes != self.learners[0].observes:
                raise RequestError(
                    f"learners.name = {learner.name!r}; it observes {learner.observes}, and "
                    f"{self.learners[0].name!r}, the first one, {self.learners[0].observes}: the "
                    "learners of one experiment observe alike"
                )
        if self.reproduces is not None and self.reproduces not in REPRODUCTIONS:
            raise unknown_name("reproduces", self.reproduces, REPRODUCTIONS)
        return self

    @property
    def of_participants(self) -> bool:
        """Whether people learned, not simulated learners: nothing of it can be run again."""
        return self.learners[0].name == PARTICIPANT

    @property
    def tabular(self) -> bool:
        """Whether its learners learn from numbered states."""
        return self.learners[0].observes == "states"

    def trials_a_cell(self) -> int:
        """How many trials a whole cell has: a deep learner's trial is long enough by itself."""
        return trials_a_cell(self.episodes + self.retention) if self.tabular else 1

    def condition_count(self) -> int:
        """How many conditions there are, counted without making them."""
        return len(self.learners) * sum(assistant.count() for assistant in self.assistants)

    def conditions(self) -> list[NamedCondition]:
        """The conditions, learner by learner, in the order of the file.

        Raises:
            RequestError: if an assistant or option is wrong, or a condition occurs twice.
        """
        made = [a for design in self.assistants for a in design.assistants()]
        names = [condition_id(assistant, made) for assistant in made]
        everyone = []
        for learner in self.learners:
            addition = apart(learner, self.learners, "@")
            alike = [other for other in self.learners if other.name == learner.name]
            learner_id = learner.name + apart(learner, alike, "/")
            everyone += [
                NamedCondition(name + addition, assistant, learner, learner_id)
                for name, assistant in zip(names, made, strict=True)
            ]
        for name, times in Counter(named.condition for named in everyone).items():
            if times > 1:
                raise RequestError(f"condition {name} occurs {times} times; keep one")
        return everyone


def _all_learners(given: list[Any], task: Any) -> list[Any]:
    """Learners by name, with listed fields swept over."""
    given = [tables_listed(each) if isinstance(each, dict) else each for each in given]
    tables = [each for each in given if isinstance(each, dict)]
    many = sum(map(combinations, tables))
    if many > MANY_CELLS:
        raise RequestError(f"learners: {many:,} of them; at most {MANY_CELLS:,} are taken")
    if not all("name" in each for each in tables):
        name = _learner_name(task)
        given = [{"name": name, **each} if isinstance(each, dict) else each for each in given]
    return [
        each
        for learner in given
        for each in (swept(learner, "learner") if isinstance(learner, dict) else [learner])
    ]


def learner_observes(name: Any) -> str:
    """What a kind of learner observes; "states" if there is none of the name."""
    return learners()[name].observes if str(name) in learners() else "states"


def _learner_name(task: Any) -> str:
    """Name of the learner that suits a task, given as plain data."""
    try:
        design = TaskDesign.model_validate(task)
        if "estimated" in design.arguments:  # not estimated twice: it takes a while
            return "q-learning"
        return design.task().learners[0]
    except (ValidationError, RequestError):
        return "q-learning"  # the error comes where the task is needed


def condition_id(assistant: Assistant, among: Sequence[Assistant]) -> str:
    """A readable id: the name, with options that vary among its kind or have no default.

    None counts as no default, and is not shown.

    Args:
        assistant: whose id is wanted.
        among: the assistants of all conditions, to see which options vary.

    Returns:
        For instance "local-q-thresholding/alpha=0.0195".
    """
    options = assistant.options._asdict()
    defaults = assistant.rule.options_type._field_defaults  # type: ignore[attr-defined]
    others = [a.options._asdict() for a in among if a.name == assistant.name]
    shown = [
        f"{option}={written(value)}"
        for option, value in options.items()
        if value is not None
        and (defaults.get(option) is None or any(other[option] != value for other in others))
    ]
    return "/".join([assistant.name, ",".join(shown)]) if shown else assistant.name
