"""Simulated people who see vectors and learn by Double DQN, trial after trial (Section 4.3)."""

import math
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from qbumpers.assistants.dispatch import start
from qbumpers.compilation import compiled_for_session, uncompiled
from qbumpers.errors import RequestError
from qbumpers.learners import perception as named_perception
from qbumpers.learners.double_dqn import make_brain, rates
from qbumpers.learners.q_learning import scheduled
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw
from qbumpers.simulation.condition import Condition, outcome_room, streams
from qbumpers.simulation.deep_steps import START_VALUE, act, prefer, take
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, Steps
from qbumpers.tasks.dynamics import TERMINATED, TRUNCATED

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
    stepper = condition.task.make_stepper()
    with threadpool_limits(1):  # matrices this small are multiplied fastest by one thread
        for place, trial in enumerate(trials):
            person = _Trial(condition, stepper, trial, each[place], outcomes, rows, script)
            for episode in range(condition.episodes + condition.retention):
                person.live(place, episode)


class _Trial:
    """One person's trial; what is passed to compiled code is held as plain tuples.

    Args:
        condition: what is simulated.
        stepper: the environment.
        trial: its number, for messages.
        each: uint64 [1 or E, 4, 4], streams, of the whole trial or of each episode.
        outcomes: filled.
        rows: step records are appended; or None.
        script: played again; or None.
    """

    def __init__(
        self,
        condition: Condition,
        stepper: Any,
        trial: int,
        each: np.ndarray,
        outcomes: Outcomes,
        rows: list[tuple[Any, ...]] | None,
        script: Script | None,
    ) -> None:
        task, learner = condition.task, condition.learner
        layout = learner.network.layout(task.observation_size, task.actions)
        values = condition.values
        self._condition, self._stepper, self._trial = condition, stepper, trial
        self._each, self._streams = each, each[0].copy()
        self._outcomes, self._rows, self._script = outcomes, rows, script
        brain = make_brain(learner, layout, self._streams[LEARNER])
        self._brain = tuple(brain)
        self._learner = (tuple(layout), brain.parameters, np.zeros(layout.room(1), np.float32))
        room = np.zeros(values.layout.room(1), np.float32)
        self._expert = (tuple(values.layout), values.parameters, room)
        self._known = np.zeros(task.actions)
        self._numbers = tuple(rates(learner))
        self._penalty = float(learner.penalty)
        self._perception = tuple(named_perception(condition.perception))
        self._options = condition.assistant.options
        self._memory = start(self._options)
        self._calls = _calls(condition)
        self._played = 0

    def live(self, place: int, episode: int) -> None:
        """An episode of training, then a greedy one without help.

        Args:
            place: of the trial among the outcomes.
            episode: its number.
        """
        if episode and len(self._each) > 1:
            self._streams[:] = self._each[episode]
        self._assisted_episode(place, episode)
        self._greedy_episode(place, episode)

    def _assisted_episode(self, place: int, episode: int) -> None:
        condition, stepper, streams = self._condition, self._stepper, self._streams
        learner, expert, brain, known = self._learner, self._expert, self._brain, self._known
        numbers, penalty, perception = self._numbers, self._penalty, self._perception
        act, take = self._calls
        options, memory, gamma = self._options, self._memory, condition.discount
        helped = episode < condition.episodes
        observing = options if helped else None
        epsilon = scheduled(condition.learner.epsilon, episode, condition.episodes)
        account = np.array([0.0, 1.0, math.nan])
        observation = self._begin(streams[ENVIRONMENT], episode)
        total, overrides, events, length = 0.0, 0, 0, 0
        while length < condition.task.episode_limit:
            script = None
            if self._script is not None:
                if self._played >= len(self._script.proposed):
                    break
                script = self._scripted()
            chosen = act(
                learner, expert, observation, known, streams, epsilon, helped, options, memory,
                account, script,
            )  # fmt: skip
            if length == 0:
                condition.assistant.check_start(float(account[START_VALUE]))
            executed = chosen[1]
            if not 0 <= executed < condition.task.actions:
                raise RequestError("the assistant's rule chose an action outside the action space")
            following, reward, event = stepper.step(executed)
            credited, projected, memory, finite = take(
                learner, brain, numbers, penalty, perception, observation, following, chosen,
                reward, event, streams, known, observing, memory, account, gamma,
            )  # fmt: skip
            if not finite:
                raise self._not_finite(episode, length, following, reward)
            if self._rows is not None:
                self._rows.append(
                    (
                        episode,
                        observation,
                        following,
                        event,
                        *chosen[:2],
                        credited,
                        chosen[0] != executed,
                        *chosen[2:],
                        known.copy(),
                        projected,
                        reward,
                    )
                )
            total += reward
            overrides += chosen[0] != executed
            events |= event
            length += 1
            observation = following
            if event & _ENDED:
                break
        self._memory = memory
        outcomes = self._outcomes
        outcomes.assisted_return[place, episode] = total
        outcomes.assisted_length[place, episode] = length
        outcomes.overrides[place, episode] = overrides
        outcomes.assisted_events[place, episode] = events

    def _greedy_episode(self, place: int, episode: int) -> None:
        stepper, learner, stream = self._stepper, self._learner, self._streams[EVALUATION]
        observation = self._begin(stream, episode)
        total, events, length = 0.0, 0, 0
        while length < self._condition.task.episode_limit:
            observation, reward, event = stepper.step(prefer(learner, observation, stream))
            if not (math.isfinite(reward) and np.isfinite(observation).all()):
                raise self._not_finite(episode, length, observation, reward)
            total += reward
            events |= event
            length += 1
            if event & _ENDED:
                break
        self._outcomes.unassisted_return[place, episode] = total
        self._outcomes.unassisted_length[place, episode] = length
        self._outcomes.unassisted_events[place, episode] = events

    def _begin(self, stream: np.ndarray, episode: int) -> np.ndarray:
        observation = self._stepper.reset(draw(stream))
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
            f"task {self._condition.task.name}: trial {self._trial}, episode {episode}, step "
            f"{length + 1}: observation {observation.tolist()}, reward {reward}; every number "
            "must be finite"
        )


class _Calls(NamedTuple):
    """The compiled calls of a step, or the same uncompiled for a rule that cannot be."""

    act: Any
    take: Any


def _calls(condition: Condition) -> _Calls:
    rule = condition.assistant.rule
    if not rule.compiled:
        return _Calls(uncompiled(act), uncompiled(take))
    return _Calls(act, take) if rule.built_in else _Calls(_act_for_session, _take_for_session)
