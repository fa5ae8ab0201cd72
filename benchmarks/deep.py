"""Learners of the lunar lander by Double DQN: a step, a whole learner, two processes, memory.

Times of steps are of the processor, resets not counted, which a busy machine disturbs less than the
clock on the wall. The engine plays a training episode and a greedy one in turn, so the resets of
the environment tell both apart; episodes before the first update of the learner are left out.
"""

import dataclasses
import importlib.util
import statistics
import time
from typing import Any, NamedTuple

import numpy as np
from blocks import block
from measuring import Row, Target, Timed, alternate, compared, is_quick, show

from qbumpers.assistants import make_assistant
from qbumpers.learners import DoubleDQN, Schedule
from qbumpers.networks import Network
from qbumpers.simulation import Condition, make_condition, run
from qbumpers.simulation.workers import Pool, make_pool
from qbumpers.tasks import VectorTask, make_task
from qbumpers.tasks.lunar_lander.stepper import Lander
from qbumpers.values import NetworkValues

SEED = 0  # of the terrain; Gymnasium's environment can have it too
# As for most of a trial: exploration has come to an end.
LEARNER = DoubleDQN(epsilon=Schedule(0.02, 0.02, 0.1))
ASSISTANT = make_assistant("stochastic-q-bumpers", alpha=0.7)
UNIT = "us"
FASTER = Target(8, at_least=True)

_START_VALUE = 40.0  # what a good expert finds at the start
_EPISODES = 60  # of a round, some 5,000 steps of each kind
_WHOLE = 2_000  # training episodes of a learner of Figure 4, and greedy ones
_LENGTHS = 240, 280  # steps of both, on average over an unassisted trial


def expert() -> NetworkValues:
    """Random action values of the right shape and about the right size."""
    network, parameters = Network(), np.random.default_rng(0)
    drawn = parameters.normal(0, 0.1, network.layout(8, 4).parameters())
    values = NetworkValues(network, 8, 4, drawn, 0.99, "lunar-lander", "random")
    drawn[-4:] += _START_VALUE - values(Lander(SEED).reset()).max()  # biases of the action values
    return dataclasses.replace(values, parameters=drawn)


class Watch:
    """The lander for simulators, noting the time before and after each reset.

    Attributes:
        times: seconds of the processor, two for each reset.
    """

    def __init__(self) -> None:
        lander = Lander(SEED)
        self._reset = lander.reset
        self.step = lander.step  # nothing in between: steps are what is measured
        self.times: list[float] = []

    def reset(self, chance: float) -> np.ndarray:
        """As the lander's."""
        self.times.append(time.process_time())
        observation = self._reset(chance)
        self.times.append(time.process_time())
        return observation


class Steps(NamedTuple):
    """Microseconds per training step, evaluation step and reset; a list has one per round."""

    training: Any
    evaluation: Any
    reset: Any


def own_steps(trial: int) -> Steps:
    """Microseconds of the engine's steps, of one trial."""
    watch = Watch()
    task = dataclasses.replace(lunar_lander(), make_stepper=lambda: watch)
    outcomes = run(condition_of(task), trials=range(trial, trial + 1)).outcomes
    times = np.array([*watch.times, time.process_time()])
    playing = np.diff(times)[1::2].reshape(-1, 2)  # a row per episode: training, greedy
    lengths = np.stack([outcomes.assisted_length[0], outcomes.unassisted_length[0]], axis=1)
    learning = np.cumsum(lengths[:, 0]) - lengths[:, 0] >= LEARNER.learning_starts
    training, evaluation = playing[learning].sum(axis=0) / lengths[learning].sum(axis=0) * 1e6
    return Steps(training, evaluation, float(np.diff(times)[0::2].mean()) * 1e6)


def lunar_lander() -> VectorTask:
    """The task on a terrain that Gymnasium's environment can have too."""
    task: Any = make_task("lunar-lander", seed=SEED)
    return task


def condition_of(task: VectorTask) -> Condition:
    """Bumpers at the task."""
    return make_condition(task, ASSISTANT, values=expert(), learner=LEARNER, episodes=_EPISODES)


def against_plain_loops(rounds: int, steps: int) -> list[Row]:
    """The engine against plain PyTorch and Stable-Baselines3, and what follows for a learner."""
    from plain_torch import PlainLearner, stable_baselines3

    plain = PlainLearner(LEARNER, ASSISTANT, expert(), SEED)
    other = stable_baselines3(LEARNER, SEED)
    found: dict[str, list[Any]] = {"own": [], "plain": []}

    def own(number: int) -> float:
        found["own"].append(own_steps(number))
        return found["own"][-1].training

    def theirs(_: int) -> float:
        found["plain"].append(plain.run(steps))
        return found["plain"][-1].training / found["plain"][-1].training_steps * 1e6

    def learn(_: int) -> float:
        begin = time.process_time()
        other.learn(steps, reset_num_timesteps=False)
        return (time.process_time() - begin) / steps * 1e6

    own_steps(0)  # compiles what is not compiled yet
    plain.run(LEARNER.learning_starts)
    other.learn(LEARNER.learning_starts)
    training = alternate({"own": own, "plain": theirs, "other": learn}, rounds)
    evaluation = [times.evaluation / times.evaluation_steps * 1e6 for times in found["plain"]]
    own_times = Steps(*zip(*found["own"], strict=True))
    return [
        compared(
            "deep learner, training step", training["own"], UNIT,
            "plain PyTorch", training["plain"], Target(60),
        ),
        faster("  faster than plain PyTorch", training["own"], training["plain"]),
        faster("  faster than SB3's DQN, unassisted", training["own"], training["other"]),
        compared(
            "deep learner, evaluation step", own_times.evaluation, UNIT,
            "plain PyTorch", evaluation, Target(25),
        ),
        whole_learner(own_times),
    ]  # fmt: skip


def faster(name: str, ours: list[float], theirs: list[float]) -> Row:
    """How many times as long another program takes."""
    ratios = [their / our for our, their in zip(ours, theirs, strict=True)]
    baseline = f"it takes {statistics.median(theirs):,.0f} {UNIT}"
    return Row(name, statistics.median(ratios), "times", baseline, ratios, FASTER)


def whole_learner(times: Steps) -> Row:
    """Seconds of one core for a learner of Figure 4, from its steps and resets."""
    seconds = [
        _WHOLE * (_LENGTHS[0] * training + _LENGTHS[1] * evaluation + 2 * reset) / 1e6
        for training, evaluation, reset in zip(*times, strict=True)
    ]
    title = f"a learner of 2 x {_WHOLE:,} episodes"
    baseline = f"at {_LENGTHS[0]} and {_LENGTHS[1]} steps each"
    return Row(title, statistics.median(seconds), "core-s", baseline, target=Target(40))


def processes(rounds: int) -> list[Row]:
    """Two learners at once, each in a process, against one; a ratio of 2 would be perfect."""
    condition = condition_of(lunar_lander())
    peaks: list[float] = []

    def rate(pool: Pool, number: int) -> Timed:
        def timed(first: int) -> float:
            trials = range(first, first + number)
            blocks = [pool.submit(block, "", each) for each in trials]
            found = [each.result() for each in blocks]
            peaks.extend(peak for _, peak in found)
            return sum(each for each, _ in found) / 1e3

        return timed

    with make_pool({"": condition}, 2) as pool:
        timed = {"two": rate(pool, 2), "one": rate(pool, 1)}
        alternate(timed, 2)  # starts both processes, and loads compiled code
        rates = alternate(timed, rounds)
    row = compared(
        "deep learners, two processes", rates["two"], "k steps/s", "one process", rates["one"]
    )
    efficiency = statistics.median(row.ratios) / 2
    rows = [row._replace(name=f"{row.name}, efficiency {efficiency:.0%}")]
    if np.isfinite(peaks).all():
        rows.append(Row("whole process of a learner, peak", max(peaks), "MB", target=Target(200)))
    return rows


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark; none if PyTorch or Stable-Baselines3 is not installed."""
    if not all(map(importlib.util.find_spec, ("torch", "stable_baselines3"))):
        print("PyTorch or Stable-Baselines3 is not installed: deep learners are left out.")
        return []
    rounds, steps = (2, 500) if quick else (5, 1_000)
    return [*against_plain_loops(rounds, steps), *processes(rounds)]


if __name__ == "__main__":
    show("Deep learners", measure(is_quick(__doc__)))
