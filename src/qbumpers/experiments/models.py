"""Pydantic models of data in files; models of settings are made from their NamedTuples.

So bounds and defaults are stated once, where the settings are, and a learner of one's own can be
written in a file like those of the package.
"""

import functools
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model


class Model(BaseModel):
    """Data whose fields are all known, of exactly their kind, and never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


@functools.cache
def model_of(kind: type) -> type[Model]:
    """The model of a NamedTuple class of settings.

    Args:
        kind: the class; fields may be NamedTuples in their turn, and tuples, which are lists in
            files.

    Returns:
        A model with the same fields, bounds and defaults.
    """
    return create_model(f"{kind.__name__}Design", __base__=Model, **model_fields_of(kind))


def model_fields_of(kind: type) -> dict[str, Any]:
    """Fields of the model of a NamedTuple class: type and default by name."""
    hints = get_type_hints(kind, include_extras=True)
    defaults: dict[str, Any] = kind._field_defaults  # type: ignore[attr-defined]
    return {
        field: (
            _hint_of(hints[field]),
            _plain(defaults[field], hints[field]) if field in defaults else ...,
        )
        for field in kind._fields  # type: ignore[attr-defined]
    }


def _hint_of(hint: Any) -> Any:
    """The type of a field in a file."""
    if get_origin(hint) is Annotated:
        plain, *bounds = get_args(hint)
        if plain is float and not any(_allows_infinity(bound) for bound in bounds):
            bounds = [*bounds, Field(allow_inf_nan=False)]
        return Annotated[(_hint_of(plain), *bounds)]
    if get_origin(hint) is tuple:
        return list[_hint_of(get_args(hint)[0])]  # type: ignore[misc]
    return model_of(hint) if hasattr(hint, "_fields") else hint


def _allows_infinity(bound: Any) -> bool:
    return any(getattr(each, "allow_inf_nan", None) for each in getattr(bound, "metadata", []))


def _plain(value: Any, hint: Any) -> Any:
    """A default as the model has it."""
    if hasattr(value, "_fields"):
        hints = get_type_hints(type(value), include_extras=True)
        fields = {f: _plain(v, hints[f]) for f, v in value._asdict().items()}
        return model_of(hint)(**fields)
    return list(value) if isinstance(value, tuple) else value


def settings_of(kind: type, fields: dict[str, Any]) -> Any:
    """The NamedTuple of a model's fields.

    Args:
        kind: the NamedTuple class to be made.
        fields: plain data, as `model_dump` gives them.
    """
    hints = get_type_hints(kind)
    return kind(**{field: _value_of(hints[field], value) for field, value in fields.items()})


def _value_of(hint: Any, value: Any) -> Any:
    if hasattr(hint, "_fields") and isinstance(value, dict):
        return settings_of(hint, value)
    return tuple(value) if isinstance(value, list) else value
