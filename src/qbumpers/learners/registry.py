"""Learners by name: registering one, and checking the settings of one."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from qbumpers.borrowing import read_only
from qbumpers.compilation import CompilationError, is_compiled, is_of_package, result_type, type_of
from qbumpers.errors import RequestError, checked, unknown_name
from qbumpers.learners.interface import Shape, Transition
from qbumpers.registration import (
    check_arguments,
    checked_class,
    compiled_or_plain,
    fresh_class,
    is_written_here,
    original_class,
    sample,
)

Observes = Literal["states", "vectors"]


@dataclass(frozen=True)
class LearnerType:
    """A kind of learner as registered; `register_learner` says what its functions are.

    Attributes:
        name: how users name it.
        settings_type: the NamedTuple of its settings; it also selects it in compiled code.
        observes: "states" by number, or "vectors".
        compiled: whether Numba could compile all of it.
        built_in: whether it belongs to this package, whose compiled code is kept on disk.
        revision: raised when the numbers that it gives change although its code does not show it.
        imitates: whether it copies what was executed.
    """

    name: str
    settings_type: type
    start: Callable[..., Any]
    choose: Callable[..., int]
    prefer: Callable[..., int]
    policy: Callable[..., None]
    learn: Callable[..., None]
    begin: Callable[..., Any] | None
    observes: Observes
    compiled: bool
    built_in: bool
    revision: int = 1
    imitates: bool = False

    @property
    def perception(self) -> str:
        """Name of the perception that it has unless another one is asked for."""
        return "observant" if self.imitates else "transition"

    @property
    def parts(self) -> tuple[Any, ...]:
        """What it was registered with: its functions, None for those it lacks, and its settings."""
        functions = (self.start, self.choose, self.prefer, self.policy, self.learn, self.begin)
        return (*functions, original_class(self.settings_type))


_ARGUMENTS = {
    "start": ("settings", "shape", "stream"),
    "choose": ("settings", "memory", "state", "rates", "stream"),
    "prefer": ("settings", "memory", "state", "tie"),
    "policy": ("settings", "memory", "state", "rates", "out"),
    "learn": ("settings", "memory", "transition", "rates", "stream"),
    "begin": ("settings", "memory", "episode", "episodes"),
}
_FUNCTIONS = tuple(_ARGUMENTS)

_learners: dict[str, LearnerType] = {}
_learners_by_settings: dict[type, LearnerType] = {}


def register_learner(
    name: str,
    settings_type: type,
    *,
    start: Callable[..., Any],
    choose: Callable[..., int],
    prefer: Callable[..., int],
    policy: Callable[..., None],
    learn: Callable[..., None],
    begin: Callable[..., Any] | None = None,
    observes: Observes = "states",
    revision: int = 1,
    imitates: bool = False,
) -> type:
    """Register a learner under a name; it then works in every simulator, in files and in `list`.

    Args:
        name: how users will name it.
        settings_type: a NamedTuple class of numbers, tuples, `Literal` texts, `Schedule`s and other
            NamedTuples of them, every field with a default. Bounds written as
            `Annotated[float, Field(ge=0, le=1)]` are checked before anything runs. A field
            `discount` is the task's if it is left out.
        start: `(settings, shape, stream) -> memory`, before the first episode; `shape` is a
            `qbumpers.learners.interface.Shape`, `stream` uint64 [4] draws what is left to chance.
            The memory is a NamedTuple of arrays, which change in place, and numbers. Of a learner
            of vectors, `start` and `begin` are called from Python.
        choose: `(settings, memory, state, rates, stream) -> action`, in training.
        prefer: `(settings, memory, state, tie) -> action`, in an unassisted probe; `tie` in [0, 1)
            chooses among equals.
        policy: `(settings, memory, state, rates, out)`, writes the probabilities of `choose` into
            `out`, float64 [A].
        learn: `(settings, memory, transition, rates, stream)`, changes the memory after a step from
            which it learns; `transition` is a `qbumpers.learners.interface.Transition`.
        begin: `(settings, memory, episode, episodes) -> rates`, the numbers of an episode, for
            instance a `qbumpers.learners.interface.Rates`; 0 if there is none.
        observes: "states" by number, or "vectors", float32 [D].
        revision: to be raised when the learner gives other numbers for a reason that its code does
            not show; finished trials are then simulated again.
        imitates: whether it copies what was executed, and so has to see that. Its perception is
            then "observant" unless another one is asked for, and one that never shows it the
            executed action is refused.

    Returns:
        The class of its settings, with which `simulate` takes it: call it with fields by name.

    Raises:
        RequestError: if `settings_type` is no NamedTuple class, a field has no default, or a
            function takes other arguments.
    """
    checked_class(settings_type, f"settings_type of {name!r}")
    missing = set(settings_type._fields) - set(settings_type._field_defaults)  # type: ignore[attr-defined]
    if missing:
        raise RequestError(f"learner {name!r}: {', '.join(sorted(missing))} must have a default")
    if observes not in get_args(Observes):
        raise unknown_name(f"observes of learner {name!r}:", observes, get_args(Observes))
    functions = (start, choose, prefer, policy, learn, begin)
    for (which, arguments), function in zip(_ARGUMENTS.items(), functions, strict=True):
        if not (which == "begin" and function is None):
            check_arguments(function, arguments, f"learner {name!r}: {which}")
    built_in = all(map(is_of_package, (choose, prefer, policy, learn)))
    built_in = built_in and all(map(is_written_here, (settings_type, start, begin)))
    learner = LearnerType(
        name, settings_type, *functions, observes, is_compiled(choose), built_in, revision, imitates
    )
    if not built_in:
        learner = _of_user(learner)
    _learners[name] = learner
    _learners_by_settings[learner.settings_type] = learner
    return learner.settings_type


def _of_user(learner: LearnerType) -> LearnerType:
    """A learner from outside the package: with settings of its own class, compiled if possible."""
    settings_type = fresh_class(learner.settings_type, learner.name, _remade)
    functions, compiles_for = compiled_or_plain(
        f"learner {learner.name!r}",
        tuple(getattr(learner, name) for name in _FUNCTIONS),
        {learner.observes: partial(_compile_once, settings_type, learner.observes)},
    )
    return replace(
        learner,
        settings_type=settings_type,
        compiled=bool(compiles_for),
        **dict(zip(_FUNCTIONS, functions, strict=True)),
    )


def _compile_once(
    settings_type: type, observes: Observes, start: Any, choose: Any, prefer: Any, policy: Any,
    learn: Any, begin: Any,
) -> None:  # fmt: skip
    """Compile a learner for the types that every host passes, without calling it."""
    states = observes == "states"
    state = 0 if states else read_only(np.zeros(1, np.float32))
    settings = type_of(sample(settings_type))
    stream, real, whole = type_of(np.zeros(4, np.uint64)), type_of(0.0), type_of(0)
    shape = Shape(1, 0, (0, 0)) if states else Shape(0, 1, (0, 0))
    memory = result_type(start, settings, type_of(shape), stream)
    rates = result_type(begin, settings, memory, whole, whole) if begin else whole
    arguments = (settings, memory, type_of(state), rates)
    chosen = (
        result_type(choose, *arguments, stream),
        result_type(prefer, settings, memory, type_of(state), real),
    )
    for name, found in zip(("choose", "prefer"), chosen, strict=True):
        if not str(found).startswith(("int", "uint")):
            raise CompilationError(f"{name} returns {found}, not a whole number")
    result_type(policy, *arguments, type_of(np.zeros(2)))
    transition = type_of(Transition(state, 0, 0.0, state, False, -1))
    result_type(learn, settings, memory, transition, rates, stream)


def learners() -> dict[str, LearnerType]:
    """Every registered kind of learner by name, in the order of registration."""
    return dict(_learners)


def learner_type(name: str) -> LearnerType:
    """The kind of learner of that name.

    Raises:
        RequestError: if there is none.
    """
    if str(name) not in _learners:
        raise unknown_name("learner", name, _learners)
    return _learners[name]


def _remade(name: str, values: tuple[Any, ...]) -> Any:
    """Settings where they arrive, of the learner that is registered there."""
    return learner_type(name).settings_type._make(values)  # type: ignore[attr-defined]


def learner_for_settings(settings_type: type) -> LearnerType:
    """The kind of learner that settings of this class belong to.

    Raises:
        RequestError: if they belong to none.
    """
    if settings_type not in _learners_by_settings:
        raise RequestError(f"learner = {settings_type.__name__}: no learner has such settings")
    return _learners_by_settings[settings_type]


def make_learner(name: str, **settings: Any) -> Any:
    """The settings of a learner, checked.

    Args:
        name: a registered name, for instance "q-learning".
        **settings: its fields, for instance `discount=0.99`; tables for those that are NamedTuples.

    Returns:
        An instance of its class of settings.

    Raises:
        RequestError: if the name is unknown, or a field is unknown or out of range.
    """
    return checked(learner_type(name).settings_type, settings, f"learner {name}")
