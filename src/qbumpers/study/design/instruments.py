"""Questionnaires that a study can name, and what an item of one is."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import Field, model_validator

from qbumpers.errors import RequestError
from qbumpers.experiments.models import Model

Identifier = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]*$", max_length=40)]
"""What names a part, a condition, a level or an item; it becomes the name of a column."""


class Item(Model):
    """One question.

    Attributes:
        id: names its column.
        text: the question.
        kind: "scale" (whole numbers from `least` to `most`), "choice" (one of `options`), "number"
            (any within `least` and `most`) or "text" (free).
        least: lowest number.
        most: highest number.
        step: between numbers of a scale.
        low: words at the lowest number.
        high: words at the highest.
        options: of a choice.
        required: whether it must be answered.
    """

    id: Identifier
    text: Annotated[str, Field(min_length=1)]
    kind: Literal["scale", "choice", "number", "text"] = "scale"
    least: float = 1
    most: float = 7
    step: Annotated[float, Field(gt=0)] = 1
    low: str = ""
    high: str = ""
    options: list[Annotated[str, Field(min_length=1)]] = Field(default_factory=list[str])
    required: bool = True

    @model_validator(mode="after")
    def _can_be_answered(self) -> "Item":
        if self.kind == "choice" and len(set(self.options)) < 2:
            raise RequestError(
                f"item {self.id}: options = {self.options!r}; a choice needs at least two different"
            )
        if self.kind != "choice" and self.options:
            raise RequestError(f"item {self.id}: options are for kind = 'choice'")
        if not self.least < self.most:
            raise RequestError(
                f"item {self.id}: least = {self.least!r} must be below most = {self.most!r}"
            )
        return self

    def problem_with(self, answer: object) -> str:
        """What is wrong with an answer, in words; empty if nothing is."""
        if answer is None or answer == "":
            return "an answer is needed" if self.required else ""
        if self.kind == "choice":
            return "" if answer in self.options else f"one of {', '.join(self.options)} is needed"
        if self.kind == "text":
            return "" if isinstance(answer, str) and len(answer) <= 5000 else "a text is needed"
        allowed = f"a number from {self.least:g} to {self.most:g} is needed"
        if not isinstance(answer, int | float) or isinstance(answer, bool):
            return allowed
        if not self.least <= answer <= self.most:
            return allowed
        if self.kind == "scale" and (answer - self.least) % self.step:
            return f"a step of {self.step:g} from {self.least:g} is needed"
        return ""


def _scale(name: str, text: str, low: str, high: str) -> Item:
    return Item(id=name, text=text, least=0, most=100, step=5, low=low, high=high)


def _agree(name: str, text: str) -> Item:
    return Item(id=name, text=text, low="strongly disagree", high="strongly agree")


INSTRUMENTS: Mapping[str, tuple[Item, ...]] = MappingProxyType({
    "nasa-tlx": (
        _scale("mental", "How mentally demanding was the task?", "very low", "very high"),
        _scale("physical", "How physically demanding was the task?", "very low", "very high"),
        _scale("temporal", "How hurried or rushed was the pace of the task?", "very low",
               "very high"),
        _scale("performance", "How successful were you in accomplishing what you were asked to do?",
               "perfect", "failure"),
        _scale("effort", "How hard did you have to work to accomplish your level of performance?",
               "very low", "very high"),
        _scale("frustration",
               "How insecure, discouraged, irritated, stressed and annoyed were you?",
               "very low", "very high"),
    ),
    "perceived-control": (
        _agree("in_control", "I was in control of what happened."),
        _agree("my_actions", "What happened followed from my own actions."),
        _agree("deprived", "Control was taken away from me."),
        _agree("could_tell", "I could tell what I did and what the assistant did."),
    ),
    "trust": (
        _agree("reliable", "The assistant was reliable."),
        _agree("trust", "I trusted the assistant."),
        _agree("understood", "I understood why the assistant stepped in."),
        _agree("wanted", "I would like to have the assistant again."),
    ),
    "background": (
        Item(id="age", text="How old are you?", kind="number", least=18, most=120, required=False),
        Item(id="gender", text="What is your gender?", kind="text", required=False),
        Item(id="games", text="How often do you play computer games?", kind="choice",
             options=["never", "less than monthly", "monthly", "weekly", "daily"]),
        Item(id="hand", text="With which hand did you play?", kind="choice",
             options=["left", "right", "both"]),
    ),
})  # fmt: skip
"""Items by the name of an instrument. `nasa-tlx` is the raw NASA Task Load Index (Hart 2006), whose
score is the mean of its six scales; the others are short sets of this package, not validated
instruments."""
