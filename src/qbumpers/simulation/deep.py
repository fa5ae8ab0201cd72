"""Simulated people who see vectors and learn by Double DQN, trial after trial (Section 4.3)."""

import math
from typing import Any, NamedTuple, cast

import numpy as np

from qbumpers.assistants.dispatch import start
from qbumpers.compilation import compiled_for_session, entered, uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import DoubleDQN
from qbumpers.learners import perception as named_perception
from qbumpers.learners.double_dqn import make_brain, rates
from qbumpers.learners.q_learning import scheduled
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw
from qbumpers.simulation.condition import Condition, outcome_room, streams
from qbumpers.simulation.deep_steps import START_VALUE, act, prefer, take
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, Steps
from qbumpers.tasks import VectorTask
from qbumpers.tasks.dynamics import TERMINATED, TRUNCATED, finite

_ENDED = TERMINATED | TRUNCATED

_act_for_session = compiled_for_session(uncompiled(act))
_take_for_session = compiled_for_session(uncompiled(take))


def run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    """Simulate trials of a condition, one after another on one core."""
    outcomes = outcome_room(condition, len(trials))
    _run_trials(condition, trials, seed, outcomes, None, None)
    return Simulation(outcomes, None)


def record(condition: Condition, trials: range, seed: int, script: Script | None) -> Steps:
    """Every assisted step of one trial; `qbumpers.simulation.record` says more."""
    rows: list[tuple[Any, ...]] = []
    _run_trials(condition, trials, seed, outcome_room(condition, 1), rows, script)
    kinds = (
        np.int64, np.float32, np.float32, np.uint8, np.int64, np.int64, np.int64, np.bool_,
        np.float64, np.float64, np.float64, np.float64, np.float64, np.float64,
    )  # fmt: skip
    columns = zip(*rows, strict=True) if rows else [()] * len(kinds)
    return Steps(*(np.array(c, kind) for c, kind in zip(columns, kinds, strict=True)))


def _run_trials(
    condition: Condition,
    trials: range,
    seed: int,
    outcomes: Outcomes,
    rows: list[tuple[Any, ...]] | None,
    script: Script | None,
) -> None:
    each = streams(condition, trials, seed)
    for place, number in enumerate(trials):
        trial = _Trial(condition, number, each[place], rows, script)
        for episode in range(condition.episodes + condition.retention):
            trial.live(episode, outcomes, place)


class _Calls(NamedTuple):
    """Compiled code for the types of one trial."""

    act: Any
    take: Any
    prefer: Any
    finite: Any


class _Trial:
    """One person's trial.

    Args:
        condition: what is simulated.
        number: of the trial, for messages.
        each: uint64 [1 or E, 4, 4], streams, of the whole trial or of each episode.
        rows: step records are appended; or None.
        script: played again; or None.
    """

    def __init__(
        self,
        condition: Condition,
        number: int,
        each: np.ndarray,
        rows: list[tuple[Any, ...]] | None,
        script: Script | None,
    ) -> None:
        task, person = cast(VectorTask, condition.task), cast(DoubleDQN, condition.learner)
        self._condition, self._task, self._person = condition, task, person
        self._stepper, self._number = task.make_stepper(), number
        self._each, self._streams = each, each[0].copy()
        self._rows, self._script, self._played = rows, script, 0
        layout = person.network.layout(task.observation_size, task.actions)
        brain = make_brain(person, layout, self._streams[LEARNER])
        self._brain = tuple(brain)
        self._learner = (tuple(layout), brain.parameters, np.zeros(layout.room(1), np.float32))
        values = condition.values
        room = np.zeros(values.layout.room(1), np.float32)
        self._expert = (tuple(values.layout), values.parameters, room)
        self._known, self._account = np.zeros(task.actions), np.zeros(3)
        self._numbers, self._penalty = tuple(rates(person)), float(person.penalty)
        self._perception = tuple(named_perception(condition.perception))
        self._options = condition.assistant.options
        self._memory = start(self._options)
        self._calls = {True: self._entered(True)}
        if condition.retention:
            self._calls[False] = self._entered(False)

    def _entered(self, helped: bool) -> _Calls:
        """The calls of a step, compiled unless the assistant's rule cannot be."""
        rule = self._condition.assistant.rule
        calls = (act, take) if rule.built_in else (_act_for_session, _take_for_session)
        if not rule.compiled:
            calls = tuple(map(uncompiled, calls))
        observation = np.zeros(self._task.observation_size, np.float32)
        return _Calls(
            entered(
                calls[0], self._learner, self._expert, observation, self._known, self._streams,
                0.0, True, self._options, self._memory, self._account,
                None if self._script is None else (0, 0.0, 0.0),
            ),
            entered(
                calls[1], self._learner, self._brain, self._numbers, self._penalty,
                self._perception, observation, observation, (0, 0, 0.0, 0.0, 0.0), 0.0, 0,
                self._streams, self._known, self._options if helped else None, self._memory,
                self._account, self._condition.discount,
            ),
            entered(prefer, self._learner, observation, self._streams[EVALUATION]),
            entered(finite, 0.0, observation),
        )  # fmt: skip

    def live(self, episode: int, outcomes: Outcomes, place: int) -> None:
        """An episode of training, then a greedy one without help.

        Args:
            episode: its number.
            outcomes: filled.
            place: of the trial among them.
        """
        if episode and len(self._each) > 1:
            self._streams[:] = self._each[episode]
        assisted = self._assisted_episode(episode)
        unassisted = self._greedy_episode(episode)
        at = (place, episode)
        outcomes.assisted_return[at], outcomes.assisted_length[at] = assisted[:2]
        outcomes.assisted_events[at], outcomes.overrides[at] = assisted[2:]
        outcomes.unassisted_return[at], outcomes.unassisted_length[at] = unassisted[:2]
        outcomes.unassisted_events[at] = unassisted[2]

    def _assisted_episode(self, episode: int) -> tuple[float, int, int, int]:
        """Return, length, events and overrides of an episode of training."""
        condition, limit = self._condition, self._task.episode_limit
        helped = episode < condition.episodes
        epsilon = scheduled(self._person.epsilon, episode, condition.episodes)
        self._account[:] = 0.0, 1.0, math.nan
        observation = self._begin(self._streams[ENVIRONMENT], episode)
        total, overrides, events, length = 0.0, 0, 0, 0
        while length < limit and not events & _ENDED:
            script = None
            if self._script is not None:
                if self._played == len(self._script.proposed):
                    break
                script = self._scripted()
            observation, reward, event, overridden = self._step(
                observation, epsilon, helped, script, (episode, length)
            )
            total += reward
            overrides += overridden
            events |= event
            length += 1
        return total, length, events, overrides

    def _step(
        self,
        observation: np.ndarray,
        epsilon: float,
        helped: bool,
        script: Any,
        when: tuple[int, int],
    ) -> tuple[np.ndarray, float, int, bool]:
        """Where a step of training leads, its reward and events, and whether it was overridden."""
        calls, streams, known, account = (
            self._calls[helped], self._streams, self._known, self._account,
        )  # fmt: skip
        chosen = calls.act(
            self._learner, self._expert, observation, known, streams, epsilon, helped,
            self._options, self._memory, account, script,
        )  # fmt: skip
        if when[1] == 0:
            self._condition.assistant.check_start(float(account[START_VALUE]))
        proposed, executed = chosen[:2]
        if not 0 <= executed < self._task.actions:
            raise RequestError("the assistant's rule chose an action outside the action space")
        following, reward, event = self._stepper.step(executed)
        credited, projected, self._memory, sound = calls.take(
            self._learner, self._brain, self._numbers, self._penalty, self._perception,
            observation, following, chosen, reward, event, streams, known,
            self._options if helped else None, self._memory, account, self._condition.discount,
        )  # fmt: skip
        if not sound:
            raise self._not_finite(when[0], when[1], following, reward)
        if self._rows is not None:
            what = (when[0], observation, following, event, proposed, executed, credited)
            how = (proposed != executed, *chosen[2:], known.copy(), projected, reward)
            self._rows.append(what + how)
        return following, reward, event, proposed != executed

    def _greedy_episode(self, episode: int) -> tuple[float, int, int]:
        """Return, length and events of an episode without help, exploration or learning."""
        stepper, learner, stream = self._stepper, self._learner, self._streams[EVALUATION]
        _, _, prefer, finite = self._calls[True]
        limit = self._task.episode_limit
        observation = self._begin(stream, episode)
        total, events, length = 0.0, 0, 0
        while length < limit and not events & _ENDED:
            observation, reward, event = stepper.step(prefer(learner, observation, stream))
            if not finite(reward, observation):
                raise self._not_finite(episode, length, observation, reward)
            total += reward
            events |= event
            length += 1
        return total, length, events

    def _begin(self, stream: np.ndarray, episode: int) -> np.ndarray:
        observation = self._stepper.reset(draw(stream))
        size = self._task.observation_size
        if observation.dtype != np.float32 or observation.shape != (size,):
            raise RequestError(
                f"task {self._task.name}: an observation is {observation.dtype} "
                f"{observation.shape}; float32 ({size},) is needed"
            )
        if not np.isfinite(observation).all():
            raise self._not_finite(episode, -1, observation, 0.0)
        return observation

    def _scripted(self) -> tuple[int, float, float]:
        script: Any = self._script
        place, self._played = self._played, self._played + 1
        return int(script.proposed[place]), float(script.coin[place]), float(script.tie[place])

    def _not_finite(
        self, episode: int, length: int, observation: np.ndarray, reward: float
    ) -> RequestError:
        return RequestError(
            f"task {self._task.name}: trial {self._number}, episode {episode}, step {length + 1}: "
            f"observation {observation.tolist()}, reward {reward}; every number must be finite"
        )
