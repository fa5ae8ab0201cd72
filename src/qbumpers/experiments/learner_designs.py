"""Simulated learners of an experiment, as data: one model per registered kind of learner."""

import functools
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    create_model,
)

from qbumpers.assistants import Assistant
from qbumpers.errors import RequestError, unknown_name
from qbumpers.experiments.models import Model, model_fields_of, model_of, settings_of
from qbumpers.learners import (
    PERCEPTIONS,
    Motor,
    Perception,
    PowerLaw,
    learner_type,
    learners,
)

RECORDED = "recorded"
"""Context in which settings are read that ran before: what they name need not be there any more."""

_PerceptionDesign: Any = model_of(Perception)
_MotorDesign: Any = model_of(Motor)
_PowerLawDesign: Any = model_of(PowerLaw)
_Share: Any = TypeAdapter(Annotated[float, Field(ge=0, le=1)], config=ConfigDict(strict=True))


def _known_perception(given: Any) -> Any:
    if isinstance(given, str) and given not in PERCEPTIONS:
        raise unknown_name("learners.perception", given, PERCEPTIONS)
    if not isinstance(given, str | dict | _PerceptionDesign):
        raise RequestError(
            f"learners.perception = {given!r}; a name or a table with "
            f"{', '.join(Perception._fields)} is needed"
        )
    return given if isinstance(given, str) else _PerceptionDesign.model_validate(given)


def _known_motor(given: Any) -> Any:
    return None if given is None else _MotorDesign.model_validate(given)


def _known_forgetting(given: Any) -> Any:
    if isinstance(given, dict | _PowerLawDesign):
        return _PowerLawDesign.model_validate(given)
    if not isinstance(given, float | int):
        raise RequestError(
            f"learners.forgetting = {given!r}; a share in [0, 1] or a table with decay is needed"
        )
    return _Share.validate_python(given)


class LearnerDesign(Model):
    """A simulated learner. In a file, a field given as a list is swept over.

    The settings of its kind are fields too, for instance `epsilon` of "q-learning"; `discount` is
    the task's if it is left out.

    Attributes:
        name: a registered kind of learner.
        perception: what it believes happened when it was overridden, the name of a perception or a
            table with `notices`, `credits` and `penalty`; what its kind has by itself if left out.
        penalty: what an override feels like under a named perception that includes disruption, in
            reward units.
        motor: how its hand errs, a table with `slip` and `lag`.
        forgetting: share of what it learned that a learner of a table forgets between episodes, or
            a table with `decay`, the exponent of a power law of the time since the last practice.
    """

    name: str
    perception: Annotated[Any, BeforeValidator(_known_perception)] = "transition"
    penalty: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    motor: Annotated[Any, BeforeValidator(_known_motor)] = None
    forgetting: Annotated[Any, BeforeValidator(_known_forgetting)] = 0.0

    def setup(self, task_discount: float) -> dict[str, Any]:
        """What `make_condition` needs to know of the learner, at a task of that discount."""
        motor = self.motor.model_dump() if self.motor else {}
        return {
            "learner": self.learner(task_discount),
            "perception": self._perceived(),
            "penalty": self.penalty,
            "motor": Motor(**motor),
            "forgetting": self._forgotten(),
        }

    def _perceived(self) -> str | Perception:
        given = self.perception
        return given if isinstance(given, str) else Perception(**given.model_dump())

    def _forgotten(self) -> float | PowerLaw:
        given = self.forgetting
        return given if isinstance(given, float) else PowerLaw(**given.model_dump())

    def learner(self, task_discount: float) -> Any:
        """The settings of its kind, at a task of that discount."""
        kind = learner_type(self.name).settings_type
        fields = self.model_dump(exclude=set(LearnerDesign.model_fields))
        if fields.get("discount", 0) is None:
            fields["discount"] = task_discount
        return settings_of(kind, fields)

    def described(self) -> dict[str, Any]:
        """Every field in the order in which ids show them."""
        fields = {**self.model_dump(), "perception": self._perceived()}
        fields["forgetting"] = self._forgotten()
        fields["motor"] = fields["motor"] or Motor()._asdict()
        last = {name: fields.pop(name) for name in ("penalty", "motor", "forgetting")}
        return {**fields, **last}

    @property
    def observes(self) -> str:
        """Whether it learns from "states" by number or from "vectors"."""
        return learner_type(self.name).observes


@functools.cache
def _design_of(kind: type, name: str) -> type[LearnerDesign]:
    fields = model_fields_of(kind)
    if "discount" in fields:
        fields["discount"] = (fields["discount"][0] | None, None)
    fields["name"] = (Literal[name], name)
    perception = LearnerDesign.model_fields["perception"]
    fields["perception"] = (Annotated[Any, *perception.metadata], learner_type(name).perception)
    return create_model(f"{kind.__name__}Design", __base__=LearnerDesign, **fields)


def design_class(name: str) -> type[LearnerDesign]:
    """The model of a registered kind of learner.

    Raises:
        RequestError: if there is none of that name.
    """
    if str(name) not in learners():
        raise unknown_name("learners.name", name, learners())
    return _design_of(learner_type(name).settings_type, name)


class RecordedLearner(LearnerDesign):
    """A learner of a run whose kind is not registered here, or has other settings by now."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)

    @property
    def observes(self) -> str:
        """Nothing that is known here."""
        return ""


def by_name(settings: Any, info: ValidationInfo) -> Any:
    """A learner by its name, so that messages are about fields of its own kind alone."""
    if isinstance(settings, LearnerDesign):
        return settings
    if info.context == RECORDED and isinstance(settings, dict):
        try:
            return design_class(settings["name"]).model_validate(settings)
        except (KeyError, RequestError, ValidationError):
            return RecordedLearner.model_validate(settings)
    if not isinstance(settings, dict):
        return LearnerDesign.model_validate(settings)
    return design_class(settings.get("name", "q-learning")).model_validate(settings)


def field_names() -> list[str]:
    """Every field that some kind of learner has, to suggest one for an unknown field."""
    names = {field for name in learners() for field in design_class(name).model_fields}
    for name in learners():
        kind = learner_type(name).settings_type
        for default in kind._field_defaults.values():  # type: ignore[attr-defined]
            names |= set(getattr(default, "_fields", ()))
    return sorted(names | {*Motor._fields, *Perception._fields, *PowerLaw._fields})


def apart(learner: LearnerDesign, among: Sequence[LearnerDesign], mark: str) -> str:
    """What tells a learner from the others, after a mark; nothing if it is alone.

    Args:
        learner: one of them.
        among: all learners of the experiment, itself included.
        mark: what is put before it.

    Returns:
        For instance "@perception=observant".
    """
    if len(among) == 1:
        return ""
    fields = learner.described()
    others = [other.described() for other in among]
    shown = [
        f"{field}={written(value)}"
        for field, value in fields.items()
        if any(field in other and other[field] != value for other in others)
    ]
    return mark + ",".join(shown)


def written(value: Any) -> str:
    """A value as ids have it: short and exact."""
    if isinstance(value, Assistant):
        return _inline_table(value)
    if isinstance(value, Perception):
        return _table_of_perception(value)
    if isinstance(value, PowerLaw):
        return f"{{decay={written(value.decay)}}}"
    if isinstance(value, dict):  # settings within settings
        return "..".join(written(part) for part in value.values())
    if isinstance(value, list | tuple):
        return "-".join(written(part) for part in value)
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def _inline_table(assistant: Assistant) -> str:
    """An assistant that another one is over, as a file has it; defaults are left out."""
    defaults: dict[str, Any] = assistant.rule.options_type._field_defaults  # type: ignore[attr-defined]
    shown = {f: v for f, v in assistant.options._asdict().items() if defaults.get(f) != v}
    parts = [f'"{assistant.name}"', *(f"{f}={written(v)}" for f, v in shown.items())]
    return "{name=" + ",".join(parts) + "}"


def _table_of_perception(perception: Perception) -> str:
    """A perception as a file has it: `notices`, and what is not the default."""
    defaults = Perception._field_defaults
    shown = [
        f"{field}={written(value)}"
        for field, value in perception._asdict().items()
        if field == "notices" or value != defaults[field]
    ]
    return "{" + ",".join(shown) + "}"
