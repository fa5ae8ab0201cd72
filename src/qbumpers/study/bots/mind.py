"""A simulated learner who plays what it is sent, with its perception and its motor noise."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from qbumpers.compilation import uncompiled
from qbumpers.experiments.learner_designs import LearnerDesign
from qbumpers.learners import Motor, PowerLaw, dispatch, learner_type, perception
from qbumpers.learners.forgetting import begin_practice, practice_for, practise
from qbumpers.learners.interface import Shape
from qbumpers.learners.motor import move
from qbumpers.learners.perception import Perception, believed, noticing, perceive
from qbumpers.play.setup import Setup
from qbumpers.random_streams import EVALUATION, LEARNER, draw, trial_streams
from qbumpers.registration import as_numbers
from qbumpers.tasks.dynamics import TERMINATED

_move, _perceive, _believed, _noticing = map(uncompiled, (move, perceive, believed, noticing))
_forget_between, _practise = map(uncompiled, (dispatch.forget_between, practise))
_begin_practice = uncompiled(begin_practice)


class _Stack(NamedTuple):
    """The learner and what lies around it, see `qbumpers.simulation.loops.LearnerStack`."""

    settings: Any
    perception: Any
    motor: Motor | None
    share: float | None
    practice: Any


class Mind:
    """A simulated learner at one task.

    It learns from every step of training and practice in which the assistant may help or the
    learner is alone, and from none of tests and probes, in which it takes the action that it
    prefers: as in a simulation.

    Args:
        design: kind of learner, and what lies around it.
        setup: what is played.
        episodes: of training.
        seed: of the rehearsal.
        number: of the participant, from 0.
    """

    def __init__(
        self, design: LearnerDesign, setup: Setup, episodes: int, seed: int, number: int
    ) -> None:
        task = setup.task
        self._stack = _stack_of(design, setup, episodes)
        self._actions, self._episodes = task.actions, episodes
        streams = trial_streams(seed, {"rehearsal": design.name}, range(number, number + 1))[0]
        self._learning, self._testing = streams[LEARNER], streams[EVALUATION]
        shape = Shape(task.states, task.observation_size, (0,) * task.actions)
        self._fresh = dispatch.start(self._stack.settings, shape, self._learning.copy())
        self._memory = dispatch.start(self._stack.settings, shape, self._learning)
        if self._stack.practice is not None:
            _begin_practice(self._stack.practice)
        self._vectors = not task.states
        # Networks take too long as plain Python; tables take longer to compile.
        kind = learner_type(design.name)
        self._calls: Any = kind if self._vectors else dispatch
        self._trained = 0
        self._rates: Any = 0
        self._learns = False
        self._last, self._state = -1, None

    def begin(self, learns: bool) -> None:
        """An episode begins.

        Args:
            learns: whether it learns in it.
        """
        self._learns, self._last, self._state = learns, -1, None
        if not learns:
            return
        if self._trained:
            stack = self._stack
            _forget_between(stack.share, stack.practice, self._memory, self._fresh)
        episode = min(self._trained, self._episodes - 1)
        self._rates = dispatch.begin(self._stack.settings, self._memory, episode, self._episodes)
        self._trained += 1

    def propose(self, state: Any) -> int:
        """The action that its hand does.

        Args:
            state: number, or D numbers.
        """
        settings, now = self._stack.settings, self._as_state(state)
        if self._learns:
            stream = self._learning
            meant = self._calls.choose(settings, self._memory, now, self._rates, stream)
        else:
            stream = self._testing
            meant = self._calls.prefer(settings, self._memory, now, draw(stream))
        self._state = now
        self._last = int(_move(self._stack.motor, int(meant), self._last, self._actions, stream))
        return self._last

    def observe(self, last: Mapping[str, Any]) -> None:
        """What came of the proposal.

        Args:
            last: `proposed`, `executed`, `undone`, `reward`, `led` (the state) and `events`.
        """
        if not self._learns or self._state is None:
            return
        undone, stream = last["undone"], self._learning
        overridden = last["executed"] != last["proposed"] or undone
        believes = self._stack.perception
        experience = _perceive(
            believes, last["proposed"], last["executed"], undone, last["reward"],
            _noticing(believes, overridden, stream),
        )  # fmt: skip
        if experience.action < 0:
            return
        terminated = bool(last["events"] & TERMINATED)
        led = self._as_state(last["led"])
        transition = _believed(experience, self._state, led, terminated)
        settings = self._stack.settings
        self._calls.learn(settings, self._memory, transition, self._rates, stream)
        _practise(self._stack.practice, self._state, experience.action)

    def _as_state(self, state: Any) -> Any:
        return np.array(state, np.float32) if self._vectors else int(state)


def _stack_of(design: LearnerDesign, setup: Setup, episodes: int) -> _Stack:
    described = design.setup(setup.task.discount)
    believes: str | Perception = described["perception"]
    if isinstance(believes, str):
        named = perception(believes)
        penalty = described["penalty"] if named.penalty else 0.0
        believes = named._replace(penalty=penalty)
    forgetting: float | PowerLaw = described["forgetting"]
    practice = None
    if isinstance(forgetting, PowerLaw):
        sizes = (setup.task.states, setup.task.actions)
        practice = practice_for(forgetting, *sizes, 10 * episodes + 100)
    motor: Motor = described["motor"]
    return _Stack(
        as_numbers(described["learner"]),
        as_numbers(believes),
        motor if any(motor) else None,
        forgetting if isinstance(forgetting, float) and forgetting > 0 else None,
        practice,
    )
