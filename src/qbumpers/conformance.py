"""Whether a rule, a learner and a perception do the same in every host: for those of one's own too.

`check_conformance` simulates a short trial in compiled code, and holds every other host to its
record: the same loops in plain Python, a `Session` that replays the record, and `SharedControl`
around an environment that plays it.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple, Unpack

import gymnasium
import numpy as np
from gymnasium import spaces

from qbumpers.assistants import Assistant
from qbumpers.decisions import Step
from qbumpers.learners import dispatch, learner_for_settings
from qbumpers.learners.interface import Shape, Transition
from qbumpers.networks import Network
from qbumpers.random_streams import LEARNER, trial_streams
from qbumpers.registration import as_numbers
from qbumpers.session import Session, replay, rows_of
from qbumpers.shared_control import RECORD, SharedControl
from qbumpers.simulation import Condition, Setup, make_condition
from qbumpers.simulation.condition import had_by
from qbumpers.simulation.trials import engine_of
from qbumpers.tasks import TabularTask, Task, cliff_walking
from qbumpers.tasks.corridors import slippery_corridor, vector_corridor
from qbumpers.tasks.dynamics import CRASH, LIMIT, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.values import NetworkValues, solve
from qbumpers.values.others import PER_PROPOSAL, numbered

_EPISODES, _RETENTION, _SEED = 4, 1, 2019
_TOLERANCE = 1e-12  # of probabilities: two ways to the same exponential


class ConformanceError(AssertionError):
    """Two hosts did not do the same."""


class Checked(NamedTuple):
    """One comparison that held.

    Attributes:
        task: name of the task.
        host: what was held to the compiled simulator, for instance "Session".
        steps: how many steps were compared.
        overridden: on how many of them the assistant overrode the learner.
    """

    task: str
    host: str
    steps: int
    overridden: int


def check_conformance(
    assistant: Assistant, *, tasks: Iterable[Task] | None = None, **setup: Unpack[Setup]
) -> list[Checked]:
    """Take an assistant, and a learner if one is given, through every host.

    Args:
        assistant: what is taken through the hosts.
        tasks: to try; small ones of this package that the assistant and the learner can do if None.
        **setup: `learner`, `perception`, `motor`, `forgetting`, see `qbumpers.simulation.Setup`.

    Returns:
        What was compared.

    Raises:
        ConformanceError: at the first difference.
        RequestError: if a task does not suit the assistant or the learner.
    """
    found = []
    for task in small_tasks(assistant, setup.get("learner")) if tasks is None else tasks:
        condition = make_condition(
            task, assistant,
            **{"values": small_values(task, assistant), "episodes": _EPISODES,
               "retention": _RETENTION, **setup},
        )  # fmt: skip
        found += _check_hosts(condition)
    return found


def _check_hosts(condition: Condition) -> list[Checked]:
    engine, trial, name = engine_of(condition.task), range(1), condition.task.name
    steps: Step = engine.record(condition, trial, _SEED, None)
    plain = engine.record(condition, trial, _SEED, None, interpreted=True)
    _compare(f"{name}, plain Python", steps, plain)
    assisted = Step(*(column[steps.episode < condition.episodes] for column in steps))
    _replayed(condition, assisted)
    _compare(f"{name}, SharedControl", assisted, _through_wrapper(condition, assisted))
    overridden = int(assisted.overridden.sum())
    hosts = ("plain Python", "Session", "SharedControl")
    return [Checked(name, host, len(assisted.episode), overridden) for host in hosts]


def _compare(where: str, expected: Step, found: Step) -> None:
    for field in Step._fields:
        one, other = np.asarray(getattr(expected, field)), np.asarray(getattr(found, field))
        if one.shape != other.shape:
            raise ConformanceError(f"{where}: {other.shape} of {field}, {one.shape} expected")
        tolerance = _TOLERANCE if field == "probability" else 0.0
        wrong = np.flatnonzero(
            ~np.isclose(one.astype(float), other.astype(float), rtol=0, atol=tolerance)
            .reshape(len(one), -1).all(axis=1)
        )  # fmt: skip
        if len(wrong):
            step = int(wrong[0])
            raise ConformanceError(
                f"{where}: step {step}: {field} is {other[step]}, {one[step]} expected"
            )


def _replayed(condition: Condition, steps: Step) -> None:
    """Decide a record again in a session; probabilities may differ by rounding alone."""
    close = steps._replace(probability=np.round(steps.probability, 9))
    session = _Rounding(
        condition.assistant, _values_by_state(condition), condition.model(), condition.perceived()
    )
    replay(session, None, close)


class _Rounding(Session):
    """A session whose probabilities are rounded: two exponentials differ in the last place."""

    def record(self, reward: float, next_state: Any, events: int, notice: float = 0.0) -> Step:
        step = super().record(reward, next_state, events, notice)
        return step._replace(probability=round(step.probability, 9))


def _values_by_state(condition: Condition) -> Any:
    """The condition's values as hosts in Python take them, with the further rows by name."""
    if not condition.task.states:
        return condition.values
    values = _WithOthers(condition.values, condition.discount)
    values.others = {
        name: _WithOthers(condition.others[:, place], condition.discount)
        for place, name in enumerate(condition.row_names)
    }
    return values


class _WithOthers:
    def __init__(self, table: np.ndarray, discount: float) -> None:
        self.table, self.discount = table, discount
        self.others: dict[str, Any] = {}

    def __call__(self, state: Any, /) -> np.ndarray:
        return self.table[int(state)]


class _Recorded(gymnasium.Env[Any, Any]):
    """An environment that answers as a record says, whatever the action."""

    def __init__(self, condition: Condition, steps: Step) -> None:
        self.task = condition.task
        # A record counts states and actions from 0.
        states = condition.task.states
        vectors: Any = condition.task.observation_space
        self.observation_space = spaces.Discrete(states) if states else vectors
        self.action_space = spaces.Discrete(condition.task.actions)
        self._steps, self._next = list(rows_of(steps)), 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin where the next recorded step did."""
        super().reset(seed=seed)
        return self._steps[self._next].state, {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Answer what the next recorded step tells, whatever the action."""
        step = self._steps[self._next]
        self._next += 1
        info = {"success": bool(step.events & SUCCESS), "crash": bool(step.events & CRASH)}
        truncated = bool(step.events & (TRUNCATED | LIMIT))
        return (
            step.next_state, float(step.reward), bool(step.events & TERMINATED), truncated, info
        )  # fmt: skip

    def snapshot(self) -> Any:
        return None

    def restore(self, snapshot: Any) -> None:
        """The record goes on where the state was taken back."""


def _through_wrapper(condition: Condition, steps: Step) -> Step:
    """The record that `SharedControl` gives when a record's proposals and noise are played."""
    env = SharedControl(
        _Recorded(condition, steps), condition.assistant, _values_by_state(condition),
        perception=condition.perceived(),
    )  # fmt: skip
    noise = list(zip(steps.coin.tolist(), steps.tie.tolist(), strict=True))
    rows, over = [], True
    for number, proposed in enumerate(steps.proposed):
        if over:
            env.reset(options={"noise": noise[number:]})
        *_, terminated, truncated, info = env.step(int(proposed))
        row = Step(**info[RECORD])
        over = terminated or truncated or number + 1 == len(noise)
        over = over or steps.episode[number + 1] != steps.episode[number]
        # The wrapper cannot tell the step limit of this environment from another truncation, nor
        # see whether an override was noticed.
        recorded = int(steps.events[number])
        rows.append(row._replace(
            events=recorded if over else row.events, credited=int(steps.credited[number])
            if 0 < condition.perceived().notices < 1 else row.credited,
        ))  # fmt: skip
    return Step(*(np.array(column) for column in zip(*rows, strict=True)))


def check_policy(settings: Any, *, draws: int = 20_000, seed: int = _SEED) -> float:
    """Hold a tabular learner's `policy` to the frequencies of its `choose`.

    The learner learns a little of Cliff Walking first. If the two agree, a check fails by chance
    less often than once in a million states.

    Args:
        settings: of a registered learner of numbered states; they select the learner.
        draws: how often `choose` is called in each state that is looked at.
        seed: decides what the learner draws.

    Returns:
        The largest difference, as a share of the largest that is allowed.

    Raises:
        ConformanceError: if they disagree, or the probabilities do not sum to 1.
    """
    task = cliff_walking()
    numbers, learner = as_numbers(settings), learner_for_settings(type(settings))
    stream = trial_streams(seed, "conformance", range(1))[0, LEARNER]
    memory = dispatch.start(numbers, Shape(task.states, 0, (0,) * task.actions), stream)
    out, worst = np.zeros(task.actions), 0.0
    for episode, state in enumerate((36, 24, 25, 13) * 2):  # before and after learning there
        rates = dispatch.begin(numbers, memory, episode, 8)
        counts = np.zeros(task.actions)
        dispatch.policy(numbers, memory, state, rates, out)
        if not np.isclose(out.sum(), 1) or (out < 0).any():
            raise ConformanceError(f"{learner.name}: policy {out} in state {state} is no policy")
        expected = out.copy()
        for _ in range(draws):
            counts[dispatch.choose(numbers, memory, state, rates, stream)] += 1
        allowed = 6 * np.sqrt(np.maximum(expected * (1 - expected), 1 / draws) / draws)
        worst = max(worst, float((np.abs(counts / draws - expected) / allowed).max()))
        _learn_something(task, numbers, memory, rates, stream, state)
    if worst > 1:
        raise ConformanceError(f"{learner.name}: choose does not follow its policy")
    return worst


def _learn_something(
    task: TabularTask, numbers: Any, memory: Any, rates: Any, stream: np.ndarray, state: int
) -> None:
    for action in range(task.actions):
        next_state, reward = int(task.next_state[state, action, 0]), task.reward[state, action, 0]
        ended = bool(task.terminated[state, action, 0])
        happened = Transition(state, action, float(reward), next_state, ended, -1)
        dispatch.learn(numbers, memory, happened, rates, stream)


def small_tasks(assistant: Assistant, settings: Any = None) -> list[Task]:
    """Tasks of a few steps that an assistant and a learner can do."""
    observes = learner_for_settings(type(settings)).observes if settings is not None else None
    tasks: list[Task] = [slippery_corridor(), cliff_walking()] if observes != "vectors" else []
    if observes != "states":
        tasks.append(vector_corridor())
    return [task for task in tasks if all(had_by(task)[need] for need in assistant.needs)]


def small_values(task: Task, assistant: Assistant) -> Any:
    """Values for one of the `small_tasks`, with the further rows that the rule named."""
    generator = np.random.default_rng(_SEED)
    if task.states:
        solved = solve(task)
        tables = {n: _random_table(generator, task) for n in _row_names(assistant, task)}
        others = {n: _WithOthers(table, solved.discount) for n, table in tables.items()}
        values = _WithOthers(np.asarray(solved.table), solved.discount)
        values.others = others
        return values
    others = {name: _random_network(generator, task) for name in _row_names(assistant, task)}
    return replace(_random_network(generator, task), others=others)


def _row_names(assistant: Assistant, task: Task) -> list[str]:
    """A row for each name, or one for each proposal of it."""
    return [
        row
        for name in assistant.values
        for row in (numbered(name, task.actions) if name == PER_PROPOSAL else [name])
    ]


def _random_table(generator: np.random.Generator, task: Task) -> np.ndarray:
    return generator.normal(size=(task.states, task.actions))


def _random_network(generator: np.random.Generator, task: Task) -> NetworkValues:
    network = Network(hidden=(4,))
    size = network.layout(task.observation_size, task.actions).parameters()
    parameters = generator.normal(size=size).astype(np.float32)
    return NetworkValues(
        network, task.observation_size, task.actions, parameters, 0.9, task.name, "random"
    )
