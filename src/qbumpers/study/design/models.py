"""What a study is: data, in a TOML file or as the same models in Python."""

import datetime
import itertools
import string
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, SerializeAsAny, model_validator

from qbumpers.errors import RequestError, unknown_name
from qbumpers.experiments.learner_designs import LearnerDesign, by_name, design_class
from qbumpers.experiments.models import Model
from qbumpers.imports import import_modules
from qbumpers.study.design.conditions import Condition, Factor, Level, crossed, orders_of
from qbumpers.study.design.parts import (
    AnyPart,
    Block,
    Consent,
    Debriefing,
    Named,
    Part,
    Sitting,
    Text,
)
from qbumpers.study.design.words import WORDS

Share = Annotated[float, Field(ge=0, le=1)]

OUTCOMES = ("complete", "screened_out", "failed", "no_consent")
"""Outcomes for which recruitment can have a code."""

PROLIFIC = "https://app.prolific.com/submissions/complete?cc={code}"


class Recruitment(Model):
    """How participants come, and with which code they leave.

    Attributes:
        by: an "open" link; a "class" list, of which each has a code of their own; or "prolific",
            which adds PROLIFIC_PID, STUDY_ID and SESSION_ID to the link.
        codes: shown at the end, by outcome.
        return_link: to where the last page leads, with {code} in it; Prolific's if left out there.
        class_list: codes of a class, each one participant's.
    """

    by: Literal["open", "class", "prolific"] = "open"
    codes: dict[Literal["complete", "screened_out", "failed", "no_consent"], Text] = Field(
        default_factory=dict[Any, str]
    )
    return_link: str = ""
    class_list: list[Annotated[str, Field(min_length=4, max_length=100)]] = Field(
        default_factory=list[str]
    )

    @model_validator(mode="after")
    def _whole(self) -> "Recruitment":
        if (self.by == "class") != bool(self.class_list):
            raise RequestError(
                f"recruitment.by = {self.by!r} with {len(self.class_list)} codes in class_list; "
                'give by = "class" and the list, or neither'
            )
        for code in self.class_list:
            if self.class_list.count(code) > 1:
                raise RequestError(f"recruitment.class_list: {code!r} occurs twice")
        missing = [outcome for outcome in OUTCOMES if outcome not in self.codes]
        if self.by == "prolific" and missing:
            raise RequestError(
                f"recruitment.codes: {', '.join(missing)} missing; Prolific needs one per outcome"
            )
        codes = list(self.codes.values())
        if len(set(codes)) < len(codes):
            raise RequestError(f"recruitment.codes: {codes!r}; each outcome needs another code")
        return self

    def link(self, code: str) -> str:
        """To where the last page leads; empty for nowhere."""
        pattern = self.return_link or (PROLIFIC if self.by == "prolific" else "")
        return pattern.replace("{code}", code) if code or "{code}" not in pattern else ""


class Returning(Model):
    """What becomes of who comes back before the end, by a reload or another day.

    Attributes:
        policy: "resume" goes on, "restart" begins the sitting again, "block" refuses. A connection
            that is lost and comes back is no coming back: the same page always goes on.
        within_hours: who was away longer is refused.
    """

    policy: Literal["resume", "restart", "block"] = "resume"
    within_hours: Annotated[float, Field(gt=0)] = 24


class Analysis(Model):
    """The planned test: Welch's t test of two conditions, on one number per participant.

    Attributes:
        measure: mean score of the unassisted episodes of a phase: "posttest", "retention",
            "transfer", or of the "probes" in training; "gain" is posttest minus pretest.
        first: name of a condition, or of a level, which is all conditions that have it.
        second: name of another one.
        level: of significance, two-sided.
        power: that is aimed at.
        plan: further words, for the preregistration.
    """

    measure: Literal["posttest", "retention", "transfer", "probes", "gain"]
    first: str
    second: str
    level: Annotated[float, Field(gt=0, lt=0.5)] = 0.05
    power: Annotated[float, Field(gt=0.5, lt=1)] = 0.8
    plan: str = ""

    @property
    def arms(self) -> tuple[str, str]:
        """Names of what is compared."""
        return self.first, self.second


class Bonus(Model):
    """A bonus by a rule that is fixed before.

    Attributes:
        phase: whose unassisted episodes count.
        per_point: of the mean score above `above`, in the currency.
        above: score from which on it is paid.
        most: highest bonus of a participant.
        currency: for instance "GBP".
    """

    phase: Literal["pretest", "posttest", "retention", "transfer"] = "posttest"
    per_point: Annotated[float, Field(gt=0)]
    above: float
    most: Annotated[float, Field(gt=0)]
    currency: str = "GBP"


class Rehearsal(Model):
    """Who takes part in a rehearsal: simulated learners, and what they do as people do.

    Attributes:
        learners: they take turns; as in an experiment file.
        drop_out: share who leave for good somewhere.
        reload: share who reload the page once in a while.
        slow: share who are ten times as slow.
    """

    learners: Annotated[
        list[Annotated[SerializeAsAny[LearnerDesign], BeforeValidator(by_name)]],
        Field(min_length=1),
    ] = Field(default_factory=lambda: [design_class("q-learning")(name="q-learning")])
    drop_out: Share = 0.05
    reload: Share = 0.1
    slow: Share = 0.05


class Study(Model):
    """A study with participants, from consent to completion.

    Attributes:
        name: of its files and folders.
        title: on every page.
        language: of its words, for instance "en".
        contact: whom to ask, on every page.
        keep_identities_until: the date from which on identities are to be deleted.
        seed: decides the draws of the assignment.
        task: what is played, as a table or just its name.
        values: Q* of the assistants, the path of a file; solved, or the shipped expert's, if left
            out.
        step_limit: steps after which an episode ends at the latest; the task's own if left out.
        recruitment: how participants come.
        returning: what becomes of who comes back.
        stale_after_minutes: who has not been heard of for so long no longer counts as taking part.
        conditions: levels of the factor "condition".
        factors: further ones, crossed with it.
        counterbalance: lists of ids of parts, whose order varies over participants.
        parts: in order.
        words: in place of those of `qbumpers.study.design.words`.
        analysis: the planned test.
        bonus: the rule of the bonus.
        rehearsal: who takes part in a rehearsal.
        imports: modules that are imported first: they register what the study names.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]*$", max_length=60)]
    title: Text
    language: Annotated[str, Field(pattern=r"^[a-zA-Z-]{2,20}$")] = "en"
    contact: Text
    keep_identities_until: datetime.date
    seed: Annotated[int, Field(ge=0)] = 0
    task: Named
    values: str | None = None
    step_limit: Annotated[int, Field(ge=1)] | None = None
    recruitment: Recruitment = Recruitment()
    returning: Returning = Returning()
    stale_after_minutes: Annotated[float, Field(gt=0)] = 60
    conditions: Annotated[list[Level], Field(min_length=1)]
    factors: list[Factor] = Field(default_factory=list[Factor])
    counterbalance: list[Annotated[list[str], Field(min_length=2)]] = Field(
        default_factory=list[list[str]]
    )
    parts: Annotated[list[AnyPart], Field(min_length=1)]
    words: dict[str, str] = Field(default_factory=dict[str, str])
    analysis: Analysis | None = None
    bonus: Bonus | None = None
    rehearsal: Rehearsal = Field(default_factory=Rehearsal)
    imports: list[str] = Field(default_factory=list[str])

    @model_validator(mode="before")
    @classmethod
    def _imported_and_named(cls, settings: Any) -> Any:
        """What the file imports is there when names are looked up; every part has an id."""
        if not isinstance(settings, dict):
            return settings
        fields: dict[str, Any] = {**settings}
        if isinstance(fields.get("imports"), list):
            import_modules(fields["imports"], "imports")
        given = fields.get("parts")
        parts: list[Any] = [*given] if isinstance(given, list) else []
        if parts and all(isinstance(part, dict) for part in parts):
            fields["parts"] = _with_ids(parts)
        return fields

    @model_validator(mode="after")
    def _consistent(self) -> "Study":
        _check_parts(self.parts)
        for key, text in self.words.items():
            _check_words(key, text)
        self.all_conditions()
        self._check_counterbalanced()
        phases = {part.phase for part in self.parts if isinstance(part, Block)}
        if self.analysis is not None:
            first, second = (self.conditions_of(name) for name in self.analysis.arms)
            if set(first) & set(second):
                raise RequestError(
                    f"analysis: first = {self.analysis.first!r} and second = "
                    f"{self.analysis.second!r} have conditions in common"
                )
            self._check_measured(self.analysis.measure, phases)
        if self.bonus is not None and self.bonus.phase not in phases:
            raise unknown_name("phase of bonus", self.bonus.phase, sorted(phases))
        return self

    def _check_measured(self, measure: str, phases: set[str]) -> None:
        needed = {"gain": {"pretest", "posttest"}, "probes": {"training"}}.get(measure, {measure})
        if not needed <= phases:
            raise RequestError(
                f"analysis.measure = {measure!r}; it needs blocks of phase "
                f"{' and '.join(sorted(needed))}"
            )
        probing = any(isinstance(part, Block) and part.probe_every for part in self.parts)
        if measure == "probes" and not probing:
            raise RequestError("analysis.measure = 'probes'; no block has probe_every")

    def _check_counterbalanced(self) -> None:
        ids = [part.id for part in self.parts]
        for group in self.counterbalance:
            for name in group:
                if name not in ids:
                    raise unknown_name("part of counterbalance", name, ids)
            places = [ids.index(name) for name in group]
            between = self.parts[min(places) : max(places) + 1]
            if any(isinstance(part, Sitting | Consent | Debriefing) for part in between):
                raise RequestError(
                    f"counterbalance = {group!r}; its parts must lie in one sitting, between "
                    "consent and debriefing"
                )
        together = list(itertools.chain(*self.counterbalance))
        for name in together:
            if together.count(name) > 1:
                raise RequestError(f"counterbalance: part {name} occurs twice")

    def all_conditions(self) -> list[Condition]:
        """Every combination of levels."""
        return crossed([_as_factor(self.conditions), *self.factors])

    def conditions_of(self, name: str) -> list[str]:
        """Names of the conditions that a name means: one, or all that have a level of that name.

        Raises:
            RequestError: if there are none.
        """
        conditions = self.all_conditions()
        found = [c.name for c in conditions if name == c.name or name in c.levels.values()]
        if not found:
            levels = [level for c in conditions for level in c.levels.values()]
            known = dict.fromkeys([*(c.name for c in conditions), *levels])
            raise unknown_name("condition of analysis", name, known)
        return found

    def orders(self) -> list[list[str]]:
        """Ids of all parts in every order of what is counterbalanced."""
        ids = [part.id for part in self.parts]
        found: list[list[str]] = []
        for chosen in itertools.product(*(orders_of(len(group)) for group in self.counterbalance)):
            order = list(ids)
            for group, places in zip(self.counterbalance, chosen, strict=True):
                where = sorted(ids.index(name) for name in group)
                for place, which in zip(where, places, strict=True):
                    order[place] = group[which]
            found.append(order)
        return found

    def part(self, name: str) -> AnyPart:
        """The part of that id."""
        return next(part for part in self.parts if part.id == name)

    def word(self, key: str) -> str:
        """A word of the page."""
        return self.words.get(key, WORDS[key])


def _as_factor(levels: list[Level]) -> Factor:
    return Factor.model_construct(name="condition", levels=levels)


def _with_ids(parts: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Parts of which each has an id: its phase or kind, with a number if there are several."""
    bases = [str(part.get("phase") or part.get("instrument") or part.get("kind")) for part in parts]
    named: list[dict[str, Any]] = []
    for place, (part, base) in enumerate(zip(parts, bases, strict=True)):
        number = bases[: place + 1].count(base)
        named.append({"id": base if bases.count(base) == 1 else f"{base}-{number}", **part})
    return named


def _check_parts(parts: Sequence[Part]) -> None:
    if not isinstance(parts[0], Consent) or not isinstance(parts[-1], Debriefing):
        kinds = (parts[0].id, parts[-1].id)
        raise RequestError(
            f"parts: the first is {kinds[0]} and the last {kinds[1]}; a study begins with "
            'kind = "consent" and ends with kind = "debriefing"'
        )
    for kind in (Consent, Debriefing):
        if sum(isinstance(part, kind) for part in parts) > 1:
            raise RequestError(f"parts: {kind.__name__.lower()} occurs twice")
    ids = [part.id for part in parts]
    for name in ids:
        if ids.count(name) > 1:
            raise RequestError(f"parts: id {name!r} occurs twice")
    for part, following in itertools.pairwise(parts):
        if isinstance(part, Sitting) and isinstance(following, Sitting | Debriefing):
            raise RequestError(f"parts: nothing happens after {part.id} in that sitting")
    if not any(isinstance(part, Block) for part in parts):
        raise RequestError('parts: no block; give at least one part with kind = "block"')


def _check_words(key: str, text: str) -> None:
    if key not in WORDS:
        raise unknown_name("key of words", key, WORDS)
    known = _filled_in(WORDS[key])
    try:
        unknown = _filled_in(text) - known
    except ValueError as error:
        raise RequestError(f"words.{key} = {text!r}: {error}") from error
    if unknown:
        allowed = ", ".join(f"{{{name}}}" for name in sorted(known)) or "none"
        raise RequestError(
            f"words.{key} = {text!r}: {{{min(unknown)}}} is not filled in; allowed: {allowed}"
        )


def _filled_in(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}
