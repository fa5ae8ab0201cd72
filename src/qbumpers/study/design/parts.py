"""The parts of a study, in the order in which a participant goes through them."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from qbumpers.errors import RequestError
from qbumpers.experiments.design import TaskDesign
from qbumpers.experiments.models import Model
from qbumpers.study.design.instruments import INSTRUMENTS, Identifier, Item

Text = Annotated[str, Field(min_length=1)]
Count = Annotated[int, Field(ge=1, le=10_000)]

PHASES = ("practice", "pretest", "training", "posttest", "retention", "transfer")
"""What a block of episodes is for; the assistant helps in training alone."""


def named_task(given: Any) -> Any:
    """A task by its name alone is one without arguments."""
    return {"name": given} if isinstance(given, str) else given


Named = Annotated[TaskDesign, BeforeValidator(named_task)]


class Part(Model):
    """What all parts have.

    Attributes:
        id: names it in the data; its phase, instrument or kind if left out, with a number if there
            are several.
        title: heading of its page; the words of the study have one for each kind.
        text: of its page; an empty line begins a paragraph, "- " an item of a list. Needed if there
            is nothing else on the page.
    """

    id: Identifier = "part"
    title: str = ""
    text: str = ""


class _Page(Part):
    """A part that is nothing but a text."""

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if not self.text.strip():
            raise RequestError(f"part {self.id}: text is missing; it is all that its page shows")
        return self


class Consent(_Page):
    """Asks for consent; its version and the time are kept.

    Attributes:
        kind: "consent".
        version: of the text, for instance "2".
    """

    kind: Literal["consent"]
    version: Text


class Instructions(_Page):
    """A page to be read.

    Attributes:
        kind: "instructions".
    """

    kind: Literal["instructions"]


class DeviceCheck(Part):
    """Measures the device and the connection; who does not meet what is asked for is screened out.

    Attributes:
        kind: "device-check".
        keyboard: whether a key must be pressed, so that there is a keyboard.
        least_width: of the page, in pixels.
        least_refresh: of the screen, per second.
        most_latency: of the connection, median round trip, in milliseconds.
    """

    kind: Literal["device-check"]
    keyboard: bool = False
    least_width: Annotated[int, Field(ge=0)] = 0
    least_refresh: Annotated[float, Field(ge=0)] = 0
    most_latency: Annotated[float, Field(gt=0)] = 1000


class Question(Model):
    """A question of a comprehension check.

    Attributes:
        id: names it in the data.
        text: the question.
        options: to choose from.
        answer: the right one of them.
    """

    id: Identifier
    text: Text
    options: Annotated[list[Text], Field(min_length=2)]
    answer: str

    @model_validator(mode="after")
    def _answerable(self) -> "Question":
        if self.answer not in self.options:
            raise RequestError(
                f"question {self.id}: answer = {self.answer!r}; one of its options is needed: "
                f"{', '.join(map(repr, self.options))}"
            )
        return self


class Comprehension(Part):
    """Questions on the instructions; who fails is sent away with the outcome "failed".

    Attributes:
        kind: "comprehension".
        questions: all of which must be answered rightly at once.
        attempts: how many there are; after a wrong one, the instructions are shown again.
    """

    kind: Literal["comprehension"]
    questions: Annotated[list[Question], Field(min_length=1)]
    attempts: Annotated[int, Field(ge=1, le=10)] = 2


class Block(Part):
    """Episodes at a task.

    Attributes:
        kind: "block".
        phase: one of `PHASES`; the condition's assistant helps in "training" alone.
        episodes: how many; of training, assisted ones.
        probe_every: of training: an unassisted probe after so many assisted episodes; no probes if
            left out.
        task: another one than the study's, for instance another terrain or remapped keys.
        values: of that task, the path of a file; as for the study if left out.
        attribution: how many questions "was that you?" are asked in each assisted episode at most;
            after a reload in its middle, the count begins anew.
    """

    kind: Literal["block"]
    phase: Literal["practice", "pretest", "training", "posttest", "retention", "transfer"]
    episodes: Count
    probe_every: Count | None = None
    task: Named | None = None
    values: str | None = None
    attribution: Annotated[int, Field(ge=0, le=20)] = 0

    @model_validator(mode="after")
    def _fits_its_phase(self) -> "Block":
        for field in ("probe_every", "attribution"):
            if getattr(self, field) and self.phase != "training":
                raise RequestError(
                    f"block {self.id}: {field} is for phase = 'training', and this is "
                    f"{self.phase!r}"
                )
        if self.probe_every and self.episodes % self.probe_every:
            raise RequestError(
                f"block {self.id}: episodes = {self.episodes} must be a multiple of probe_every = "
                f"{self.probe_every}"
            )
        return self

    def plan(self) -> list[bool]:
        """Whether the assistant may help, of each episode in order."""
        if self.phase != "training":
            return [False] * self.episodes
        if self.probe_every is None:
            return [True] * self.episodes
        return [*[True] * self.probe_every, False] * (self.episodes // self.probe_every)


class Questionnaire(Part):
    """Items to be answered.

    Attributes:
        kind: "questionnaire".
        instrument: one of `INSTRUMENTS`; own items follow its own.
        items: own ones.
    """

    kind: Literal["questionnaire"]
    instrument: Literal["nasa-tlx", "perceived-control", "trust", "background"] | None = None
    items: list[Item] = Field(default_factory=list[Item])

    @model_validator(mode="after")
    def _asks_something(self) -> "Questionnaire":
        ids = [item.id for item in self.all_items()]
        if not ids:
            raise RequestError(
                f"questionnaire {self.id}: it asks nothing; give it an instrument "
                f"({', '.join(INSTRUMENTS)}) or items"
            )
        twice = sorted({name for name in ids if ids.count(name) > 1})
        if twice:
            raise RequestError(f"questionnaire {self.id}: item {twice[0]} occurs twice")
        return self

    def all_items(self) -> list[Item]:
        """The instrument's and own ones."""
        return [*(INSTRUMENTS[self.instrument] if self.instrument else ()), *self.items]


class Sitting(Part):
    """Ends a sitting: what follows is for another day, within a window, in the same condition.

    Attributes:
        kind: "sitting".
        after_days: from the end of this sitting to the beginning of the window.
        within_days: how long the window is.
        code: of recruitment, for having finished this sitting; the one for "complete" if left out.
    """

    kind: Literal["sitting"]
    after_days: Annotated[float, Field(ge=0)]
    within_days: Annotated[float, Field(gt=0)]
    code: str = ""


class Debriefing(_Page):
    """The last page: what the study was about.

    Attributes:
        kind: "debriefing".
    """

    kind: Literal["debriefing"]


AnyPart = Annotated[
    Consent | Instructions | DeviceCheck | Comprehension | Block | Questionnaire | Sitting
    | Debriefing,
    Field(discriminator="kind"),
]  # fmt: skip
"""Any part, by its kind."""

KINDS = (
    Consent, Instructions, DeviceCheck, Comprehension, Block, Questionnaire, Sitting, Debriefing,
)  # fmt: skip
"""The models of all kinds."""
