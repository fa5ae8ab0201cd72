"""What the trials of a condition begin with on a card, and where each has its own of it.

Learner and rule start once, on the processor; what they begin with is copied to every trial.
"""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import dispatch as rules
from qbumpers.assistants.registry import unchanged
from qbumpers.borrowing import scratch
from qbumpers.compilation import uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import dispatch as learners
from qbumpers.learners.forgetting import Practice
from qbumpers.learners.interface import Shape
from qbumpers.simulation.condition import Condition, compiled_learner, outcome_room
from qbumpers.simulation.cuda.devices import Precision
from qbumpers.simulation.cuda.layout import (
    DESK_BYTES,
    WORD,
    Far,
    Near,
    Space,
    changed,
    parts_of,
    words_of,
)
from qbumpers.simulation.loops import Assistance, LearnerStack, Minds
from qbumpers.simulation.outcomes import StateCounts, room_for_steps
from qbumpers.simulation.tabular import forgetting_of
from qbumpers.source.references import global_names

_SCRATCH_WORDS = 1024  # twice what any rule of this package needs for 4 actions
_STREAM_BYTES = 128


class Own(NamedTuple):
    """An array of which every trial has one: what it holds at first."""

    first: np.ndarray


class Begun(NamedTuple):
    """What the trials of a condition begin with, in arrays of the processor.

    What each trial has of its own is a `Near` or a `Far`, whose array is that of one trial.

    Attributes:
        dynamics: where actions lead, and what for.
        assistance: as the loops take it.
        learner: likewise.
        minds: likewise.
        counts: `StateCounts` of a trial.
        record: `Step` of arrays for the steps of a trial; None if they are not kept.
        retention: R.
        space: near memory of each trial.
        bytes: what each trial needs of the memory of the card.
    """

    dynamics: Any
    assistance: Assistance
    learner: LearnerStack
    minds: Minds
    counts: Any
    record: Any
    retention: int
    space: Space
    bytes: int


def begin(condition: Condition, precision: Precision, recorded: bool) -> Begun:
    """What the trials of a condition begin with.

    Args:
        condition: what is to be simulated, of a task with a table.
        precision: of tables, values and rewards.
        recorded: whether every step of training is kept.

    Raises:
        RequestError: if its learner draws what it begins with.
    """
    model = condition.model()
    learner, minds = _remembering(condition, precision)
    counts = StateCounts(*(Own(np.zeros(model.states, np.int32)) for _ in range(3)))  # type: ignore[arg-type]
    (learner, minds, counts), desk = _placed((learner, minds, counts))
    record = _room_for_record(condition) if recorded else None
    far = parts_of(Far, (learner, minds, counts, record))
    episodes = condition.episodes + condition.retention
    drawn = _STREAM_BYTES * (episodes if condition.common_random_numbers else 1)
    needed = [each.arrays for each in far] + [*outcome_room(condition, 1)]
    return Begun(
        model.dynamics._replace(reward=_real(model.dynamics.reward, precision)),
        _assistance(condition, precision),
        learner, minds, counts, record, condition.retention,
        Space(max(1, desk), _scratch_words(condition)),
        drawn + sum(array.nbytes for array in needed),
    )  # fmt: skip


def _assistance(condition: Condition, precision: Precision) -> Assistance:
    task = condition.task
    return Assistance(
        _real(condition.values, precision),
        _real(condition.others, precision),
        None if task.seen is None else np.ascontiguousarray(task.seen, np.int64),
        condition.discount,
        condition.assistant.numbers,
        (0,) * task.actions,
    )


def _remembering(condition: Condition, precision: Precision) -> tuple[LearnerStack, Minds]:
    """The learner, and what it and the rule remember at first."""

    def kept(array: np.ndarray) -> np.ndarray:
        return _real(array, precision) if array.dtype == np.float64 else array.copy()

    def owned(array: np.ndarray) -> Any:
        """What a rule does not change, such as the transitions of the task, is shared by all."""
        changes = array.flags.writeable and condition.assistant.rule.observe is not unchanged
        return Own(kept(array)) if changes else array

    settings, perception, motor = compiled_learner(condition)
    share, practice = forgetting_of(condition)
    forgets = share is not None or practice is not None
    first = changed(np.ndarray, kept, _first_memory(condition, settings))
    of_rule = rules.start(condition.assistant.numbers, condition.model())
    age: Any = None if practice is None else Own(practice.age)
    return (
        LearnerStack(
            settings, perception, motor, share, practice and Practice(age, practice.shares)
        ),
        Minds(
            changed(np.ndarray, Own, first),
            first if forgets else 0,
            changed(np.ndarray, owned, of_rule),
        ),
    )


def _real(array: np.ndarray, precision: Precision) -> np.ndarray:
    return np.array(array, precision, order="C")


def _first_memory(condition: Condition, settings: Any) -> Any:
    task, stream = condition.task, np.arange(1, 5, dtype=np.uint64)
    before = stream.copy()
    memory = learners.start(settings, Shape(task.states, 0, (0,) * task.actions), stream)
    if (stream != before).any():
        raise RequestError(
            f"learner {condition.learner_type.name}: its start draws what it begins with, but on a "
            "GPU all learners begin with the same"
        )
    return memory


def _room_for_record(condition: Condition) -> Any:
    most = (condition.episodes + condition.retention) * condition.task.episode_limit
    steps = room_for_steps(most, np.zeros((), np.int64), condition.task.actions)
    return changed(np.ndarray, Far, steps)


def _placed(parts: Any) -> tuple[Any, int]:
    """A place for each array that a trial has of its own, small ones near; words of the desk."""
    order = sorted(parts_of(Own, parts), key=lambda own: words_of(own.first))
    used, near = 0, set[int]()
    for own in order:
        if (used + words_of(own.first)) * WORD <= DESK_BYTES:
            used += words_of(own.first)
            near.add(id(own.first))
    desk = 0

    def place(own: Own) -> Near | Far:
        nonlocal desk
        if id(own.first) not in near:
            return Far(own.first)
        desk += words_of(own.first)
        return Near(own.first, desk - words_of(own.first))

    return changed(Own, place, parts), used


def _scratch_words(condition: Condition) -> int:
    of_rules = [part for rule in condition.assistant.chain for part in rule.parts]
    functions = [*of_rules, *condition.learner_type.parts]
    return _SCRATCH_WORDS if _calls(functions, scratch) else 1


def _calls(functions: list[Any], wanted: Any) -> bool:
    """Whether one of some functions calls another one, if only by way of others."""
    waiting, seen = functions, set[int]()
    while waiting:
        function: Any = uncompiled(waiting.pop())
        if function is wanted:
            return True
        code: Any = getattr(function, "__code__", None)
        if code is not None and id(function) not in seen:
            seen.add(id(function))
            names = [name for name, _ in global_names(code)]
            waiting = waiting + [function.__globals__.get(name) for name in names]
    return False
