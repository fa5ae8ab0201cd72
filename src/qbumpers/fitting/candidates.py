"""A learner, with its perception, as an explanation of one participant's proposals."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from qbumpers.compilation import compiled_for_session, compiling_together, uncompiled
from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.fitting.likelihood import AFTER, BEFORE, WITHHELD, Choices, Stack, score
from qbumpers.fitting.parameters import free_by_default, known_parameter, make_stack, parameters_of
from qbumpers.learners import LearnerType, Perception, learner_type
from qbumpers.learners import perception as named_perception
from qbumpers.learners.interface import Shape
from qbumpers.random_streams import LEARNER, trial_streams
from qbumpers.simulation.checking import checked_perception
from qbumpers.tasks.dynamics import TERMINATED

_score_for_session = compiled_for_session(uncompiled(score))


class Candidate(NamedTuple):
    """A learner that may explain what was proposed.

    Attributes:
        learner: its registered name.
        perception: name of how it reads overridden steps, or a text that describes it.
        stack: its numbers; those of `free` are where the search begins.
        free: names of the parameters that are estimated.
    """

    learner: str
    perception: str
    stack: Stack
    free: tuple[str, ...]

    @property
    def name(self) -> str:
        """The learner and its perception."""
        return f"{self.learner}, {self.perception}"

    def parameters(self) -> set[str]:
        """Names of all its parameters."""
        return {*parameters_of(self.stack)}


def make_candidate(
    learner: str,
    perception: str | Perception,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
) -> Candidate:
    """A learner that may explain what was proposed, checked.

    Args:
        learner: a registered name of a learner of numbered states.
        perception: of overridden steps, or the name of one.
        free: names of further parameters that are to be estimated; a whole schedule takes the
            place of its numbers.
        fixed: parameters that are not estimated, with their values.

    Raises:
        RequestError: if a name is unknown, a number is out of range, a parameter is both free and
            fixed, the learner observes vectors, or the perception does not suit it.
    """
    kind, fixed = learner_type(learner), fixed or {}
    if kind.observes != "states":
        raise RequestError(f"learner = {learner!r}; it observes vectors, which cannot be fitted")
    checked_perception(kind, perception)
    found = perception if isinstance(perception, Perception) else named_perception(perception)
    stack = make_stack(learner, found, fixed)
    for name in free:
        known_parameter(parameters_of(stack), name, learner)
        if name in fixed:
            raise RequestError(f"{name}: free and fixed = {fixed[name]!r}; only one is possible")
    taken = {*fixed, *free}
    names = [n for n in free_by_default(stack) if not {n, n.partition(".")[0]} & taken]
    names += free
    shown = perception if isinstance(perception, str) else _described(perception)
    return Candidate(learner, shown, stack, tuple(names))


def _described(perception: Perception) -> str:
    return (
        f"notices={perception.notices:g} credits={perception.credits} "
        f"penalty={perception.penalty:g}"
    )


def suits(learner: str, perception: str | Perception) -> bool:
    """Whether a learner can have a perception.

    Raises:
        RequestError: if there is no such learner or perception.
    """
    kind = learner_type(learner)
    checked_perception(replace(kind, imitates=False), perception)
    try:
        checked_perception(kind, perception)
    except RequestError:
        return False
    return True


def choices_of(steps: Step, where: str) -> Choices:
    """What one participant did and saw, as compiled code reads it.

    Args:
        steps: a table of steps of numbered states, in the order in which they happened.
        where: for messages, for instance "participant 3".

    Raises:
        RequestError: if there are none, states are vectors, numbers are negative or not finite, or
            episodes are out of order.
    """
    state = np.asarray(steps.state)
    if state.ndim != 1 or state.dtype.kind not in "iu":
        raise RequestError(f"{where}: states are not numbered; vectors cannot be fitted")
    if not len(state):
        raise RequestError(f"{where}: no step was recorded")
    whole = {
        name: np.ascontiguousarray(getattr(steps, name), np.int64)
        for name in ("episode", "state", "proposed", "executed", "next_state")
    }
    for name, column in whole.items():
        if column.min() < 0:
            raise RequestError(f"{where}: {name} = {column.min()}; it must be 0 or more")
    actions = np.asarray(steps.values).shape[1]
    for name in ("proposed", "executed"):
        if whole[name].max() >= actions:
            raise RequestError(
                f"{where}: {name} = {whole[name].max()}; it must lie in [0, {actions})"
            )
    if (np.diff(whole["episode"]) < 0).any():
        raise RequestError(f"{where}: episodes are out of order; steps are needed as they happened")
    reward = np.ascontiguousarray(steps.reward, np.float64)
    if not np.isfinite(reward).all():
        raise RequestError(f"{where}: every reward must be finite")
    terminated = (np.asarray(steps.events, np.int64) & TERMINATED) > 0
    undone = np.ascontiguousarray(steps.undone, np.bool_)
    return Choices(**whole, undone=undone, reward=reward, terminated=terminated)


class Likelihood:
    """How likely a candidate makes the proposals of one participant, by its parameters.

    Args:
        candidate: the learner.
        choices: what the participant proposed, and what followed.
        shape: of what is learned.
        training: episodes over which schedules are counted.
        particles: simulated learners, if something is hidden.
        seed: of what is hidden.

    Attributes:
        candidate: the learner.
        steps: how many proposals there are.
        hidden: whether anything was hidden the last time, so that a particle filter was needed.

    Raises:
        RequestError: if undone steps do not say what the learner would need to know.
    """

    def __init__(
        self,
        candidate: Candidate,
        choices: Choices,
        shape: Shape,
        training: int,
        particles: int = 100,
        seed: int = 0,
    ) -> None:
        _check_undone(candidate, choices)
        self.candidate, self.steps, self.hidden = candidate, len(choices.episode), False
        self._choices, self._shape, self._training = choices, shape, training
        self._particles, self._seed = particles, seed
        self._score = _scorer(learner_type(candidate.learner))
        self._streams = self._fresh(0)
        self._out = np.empty(self.steps)
        unnoticing = candidate.stack._replace(
            perception=candidate.stack.perception._replace(notices=0.0)
        )
        withheld, given = (self._draws(unnoticing, order) for order in (WITHHELD, AFTER))
        self._order = BEFORE if withheld > given else AFTER

    def log_probabilities(self, stack: Stack, repeat: int = 0) -> np.ndarray:
        """Log-probability of each proposal, given what came before it.

        Args:
            stack: the learner with its numbers.
            repeat: which repetition of what is hidden.

        Returns:
            float64 [N]; -inf if the learner would never have proposed that.
        """
        if self._order == BEFORE and (stack.motor.slip > 0 or stack.motor.lag > 0):
            raise RequestError(
                f"motor: learner {self.candidate.learner} chooses its next action while it learns, "
                "and the record does not say what a hand that errs was meant to do"
            )
        self.hidden = self._draws(stack, self._order) > 0
        if self.hidden:
            streams = (self._streams if repeat == 0 else self._fresh(repeat)).copy()
            self._call(stack, self._order, streams)
        return self._out.copy()

    def _fresh(self, repeat: int) -> np.ndarray:
        """uint64 [P + 1, 4], random streams of a repetition."""
        content = {"fitting": self.candidate.name, "repeat": repeat}
        return trial_streams(self._seed, content, range(self._particles + 1))[:, LEARNER].copy()

    def _draws(self, stack: Stack, order: int) -> int:
        """How many numbers a single learner draws that lives through the record."""
        streams = self._streams[:2].copy()
        self._call(stack, order, streams)
        return int(streams[0, 3] - self._streams[0, 3])  # the last word of a stream counts

    def _call(self, stack: Stack, order: int, streams: np.ndarray) -> None:
        with compiling_together(f"learner {self.candidate.learner}"):
            self._score(
                stack, self._shape, self._choices, self._training, order, streams, self._out
            )


def _scorer(kind: LearnerType) -> Any:
    if not kind.compiled:
        return uncompiled(score)
    return score if kind.built_in else _score_for_session


def _check_undone(candidate: Candidate, choices: Choices) -> None:
    perception = candidate.stack.perception
    sees_executed = perception.notices > 0 or "perception.notices" in candidate.free
    if choices.undone.any() and sees_executed and perception.credits == 0:
        raise RequestError(
            f"perception = {candidate.perception!r}; steps were undone, and their record does not "
            "say whether the action had ended the episode, which a learner that credits it would "
            "have seen"
        )
