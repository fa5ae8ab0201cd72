"""Simulated learners that observe vectors, trial after trial (Section 4.3)."""

from typing import Any, NamedTuple, cast

import numpy as np

from qbumpers.compilation import compiled_for_session, entered, hold, uncompiled
from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.learners.dispatch import begin as begin_learner
from qbumpers.learners.dispatch import start as start_learner
from qbumpers.learners.interface import Shape
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw
from qbumpers.simulation.condition import Condition, compiled_learner, outcome_room, streams
from qbumpers.simulation.deep_steps import (
    NOT_FINITE,
    START_VALUE,
    Common,
    NetworkAssistance,
    Pieces,
    act,
    preferred,
    take,
)
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, TRUNCATED

REVISION: int = 1
"""Raised when trials give other numbers by anything that is no rule, learner or task."""

PRECISION: str = "float32"

_ENDED = TERMINATED | TRUNCATED

_SESSION = {f: compiled_for_session(uncompiled(f)) for f in (hold, act, take, preferred)}


def run_block(condition: Condition, trials: range, seed: int) -> Simulation:
    """Simulate trials: `run_block` of `qbumpers.simulation.trials.Engine`."""
    outcomes = outcome_room(condition, len(trials))
    _run_trials(condition, trials, seed, outcomes, None, None)
    return Simulation(outcomes, None)


def record(
    condition: Condition,
    trials: range,
    seed: int,
    script: Script | None,
    interpreted: bool = False,
) -> Step:
    """Every step of training of one trial: `record` of `qbumpers.simulation.trials.Engine`."""
    rows: list[Step] = []
    _run_trials(condition, trials, seed, outcome_room(condition, 1), rows, script, interpreted)
    kinds = Step(
        episode=np.int64, state=np.float32, proposed=np.int64, executed=np.int64, undone=np.bool_,
        credited=np.int64, overridden=np.bool_, probability=np.float64, coin=np.float64,
        tie=np.float64, values=cast(Any, np.float64), projected_return=np.float64,
        reward=np.float64, next_state=np.float32, events=np.uint8,
    )  # fmt: skip
    columns = zip(*rows, strict=True) if rows else [()] * len(kinds)
    return Step(*(np.array(c, kind) for c, kind in zip(columns, kinds, strict=True)))


def _run_trials(
    condition: Condition,
    trials: range,
    seed: int,
    outcomes: Outcomes,
    rows: list[Step] | None,
    script: Script | None,
    interpreted: bool = False,
) -> None:
    each = streams(condition, trials, seed)
    for place, number in enumerate(trials):
        trial = _Trial(condition, number, each[place], rows, script, interpreted)
        for episode in range(condition.episodes + condition.retention):
            trial.run_episodes(episode, outcomes, place)


class _Calls(NamedTuple):
    """Compiled code for the types of one trial."""

    act: Any
    take: Any
    preferred: Any


class _Trial:
    """One learner's trial.

    Args:
        condition: what is simulated.
        number: which trial, for messages.
        each: uint64 [1 or E, 4, 4], streams, of the whole trial or of each episode.
        rows: step records are appended; or None.
        script: played again; or None.
        interpreted: whether the pieces of a step run as plain Python.
    """

    def __init__(
        self,
        condition: Condition,
        number: int,
        each: np.ndarray,
        rows: list[Step] | None,
        script: Script | None,
        interpreted: bool,
    ) -> None:
        task = condition.task
        self._condition, self._task = condition, task
        self._stepper, self._number = task.make_stepper(), number
        self._each, self._streams = each, each[0].copy()
        self._rows, self._script, self._played = rows, script, 0
        self._compiled = (
            not interpreted and condition.assistant.compiled and condition.learner_type.compiled
        )
        shape = Shape(0, task.observation_size, (0,) * task.actions)
        self._memory = start_learner(condition.learner, shape, self._streams[LEARNER])
        self._settings, self._perception, self._motor = compiled_learner(condition)
        self._numbers = np.zeros(5)
        self._assistance = _assistance(condition)
        self._rule_memory = condition.assistant.start(condition.model())
        self._undoes = "undo" in condition.assistant.needs
        self._rates = begin_learner(condition.learner, self._memory, 0, condition.episodes)
        self._calls = {True: self._entered(True)}
        if condition.retention:
            self._calls[False] = self._entered(False)

    def _entered(self, assisted: bool) -> _Calls:
        """The calls of a step, compiled unless the rule or the learner cannot be."""
        calls = tuple(map(self._kind, (act, take, preferred)))
        begun = (self._common(), self._options(assisted), self._rule_memory)
        observation = np.zeros(self._task.observation_size, np.float32)
        script = None if self._script is None else (0, 0.0, 0.0)
        chosen, outcome = (0, 0, False, 0.0, 0.0, 0.0), (observation, 0.0, 0, 0)
        return _Calls(
            entered(calls[0], *begun, observation, 0, script),
            entered(calls[1], *begun, observation, chosen, outcome),
            entered(calls[2], begun[0], observation, 0.0, 0, True),
        )

    def _kind(self, function: Any) -> Any:
        """A function of a step: compiled with the package, in this process, or not at all."""
        if not self._compiled:
            return uncompiled(function)
        ours = self._condition.assistant.built_in and self._condition.learner_type.built_in
        return function if ours else _SESSION[function]

    def _common(self) -> Any:
        """What the steps of an episode have in common."""
        pieces = Pieces(
            settings=self._settings, memory=self._memory, rates=self._rates, motor=self._motor,
            perception=self._perception, assistance=self._assistance,
            numbers=self._numbers, streams=self._streams,
        )  # fmt: skip
        return self._kind(hold)(pieces) if self._compiled else Common(pieces)

    def _options(self, assisted: bool) -> Any:
        return self._condition.assistant.numbers if assisted else None

    def run_episodes(self, episode: int, outcomes: Outcomes, place: int) -> None:
        """An episode of training, then a greedy unassisted one.

        Args:
            episode: which one of the trial, counted from 0.
            outcomes: arrays [T, E], of which the elements of this episode are filled.
            place: row of the trial in them.
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
        assisted = episode < condition.episodes
        self._rates = begin_learner(condition.learner, self._memory, episode, condition.episodes)
        self._numbers[:] = 0.0, 1.0, 0.0, episode, 0
        calls, common, options = self._calls[assisted], self._common(), self._options(assisted)
        observation = self._begin(self._streams[ENVIRONMENT], episode)
        total, overrides, events, length, last = 0.0, 0, 0, 0, -1
        while length < limit and not events & _ENDED:
            script = None
            if self._script is not None:
                if self._played == len(self._script.proposed):
                    break
                script = self._scripted()
            chosen = calls.act(common, options, self._rule_memory, observation, last, script)
            if length == 0:
                condition.assistant.check_start(float(self._numbers[START_VALUE]))
            last, executed, undone = chosen[:3]
            next_observation, reward, event, after = self._environment_step(
                observation, executed, undone
            )
            length += 1
            happened = event & ~_ENDED if undone else event
            happened |= LIMIT if length == limit and not happened & _ENDED else 0
            credited, projected, self._rule_memory, sound = calls.take(
                common, options, self._rule_memory, observation, chosen,
                (next_observation, reward, event, happened),
            )  # fmt: skip
            if not sound:
                raise self._not_finite(episode, length - 1, next_observation, reward)
            overridden = last != executed or undone
            if self._rows is not None:
                probability, coin, tie = chosen[3:]
                self._rows.append(Step(
                    episode, observation, last, executed, undone, credited, overridden,
                    probability, coin, tie, self._assistance.row.copy(), projected, reward,
                    next_observation, happened,
                ))  # fmt: skip
            total += reward
            overrides += overridden
            events |= happened
            observation = after
        return total, length, events, overrides

    def _environment_step(
        self, observation: np.ndarray, executed: int, undone: bool
    ) -> tuple[np.ndarray, float, int, np.ndarray]:
        """Where an action leads, its reward and events, and the observation after it."""
        if not undone:
            next_observation, reward, events = self._stepper.step(executed)
            return next_observation, reward, events, next_observation
        stepper: Any = self._stepper
        if not self._undoes:
            raise RequestError(
                f"assistant {self._condition.assistant.name} undoes a step; its rule must be "
                'registered with needs=("undo",)'
            )
        before = stepper.snapshot()
        next_observation, reward, events = stepper.step(executed)
        stepper.restore(before)
        return next_observation, reward, events, observation

    def _greedy_episode(self, episode: int) -> tuple[float, int, int]:
        """Return, length and events of an unassisted episode without exploration or learning."""
        stepper, stream = self._stepper, self._streams[EVALUATION]
        prefer = self._calls[True].preferred
        common = self._common()
        limit = self._task.episode_limit
        observation = self._begin(stream, episode)
        action = prefer(common, observation, 0.0, -1, False)
        total, events, length, over = 0.0, 0, 0, False
        while not over:
            observation, reward, event = stepper.step(action)
            total += reward
            events |= event
            length += 1
            over = length == limit or bool(event & _ENDED)
            action = prefer(common, observation, reward, action, over)
            if action == NOT_FINITE:
                raise self._not_finite(episode, length - 1, observation, reward)
        return total, length, events if events & _ENDED else events | LIMIT

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


def _assistance(condition: Condition) -> NetworkAssistance:
    values, others = condition.values, condition.others
    actions = condition.task.actions
    parameters = np.stack([each.parameters for each in (values, *others)])
    parameters.flags.writeable = False
    return NetworkAssistance(
        layout=values.layout,
        parameters=parameters,
        workspace=np.zeros(values.layout.workspace(1), np.float32),
        row=np.zeros(actions),
        other_rows=np.zeros((len(others), actions)),
        discount=condition.discount,
    )
