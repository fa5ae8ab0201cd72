"""Episodes of unequal length on a graphics card: three ways to deal them out to its threads.

Threads that run in step wait for the longest episode of their group. Kernels written by hand, of
Q-learning without an assistant, compare a thread per learner, which is what the package does, with
*persistent* threads that take up the next learner as they finish, and with a kernel that runs *one
step after another*, of whichever episode a thread is in, so that none waits for the others' end.
"""

import functools
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from measuring import Row, Timed, alternate, compared, is_quick, show, watched
from numba import cuda as numba_cuda
from numba.core import config
from plain_gpu import short_stream

from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.simulation import device_of, simulate
from qbumpers.simulation.cuda.layout import LANES
from qbumpers.tasks import make_task
from qbumpers.tasks.dynamics import TERMINATED

cuda: Any = numba_cuda

TASKS = ("cliff-walking", "frozen-lake", "windy-gridworld")
WAYS = ("a thread per learner", "persistent", "one step after another")
UNIT = "M steps/s"
THREADS = 128
BLOCKS_PER_MULTIPROCESSOR = 8

SHARED_BYTES = 27 * 1024
"""That a block asks for, so that no way has more of them at once on a large card: fewer learners
at a time take less room in its caches, which is another matter."""

_FULL = (1 << 17, 100, 3)  # learners, episodes, rounds
_QUICK = (8, 2, 1)


class Table(NamedTuple):
    """A task in arrays of the card.

    Attributes:
        following: int32 [S * A * K], where outcomes lead.
        reward: float32 [S * A * K].
        ended: uint8 [S * A * K], whether an outcome ends the episode.
        cumulative: float32 [S * A * K], probability of an outcome or one before it.
    """

    following: Any
    reward: Any
    ended: Any
    cumulative: Any


class Sizes(NamedTuple):
    """Numbers that a kernel is compiled for."""

    states: int
    actions: int
    outcomes: int
    start: int
    limit: int


@functools.cache
def table_of(name: str) -> tuple[Table, Sizes]:
    """A task of the package that begins in one state."""
    task = make_task(name)
    dynamics = task.dynamics()
    sizes = Sizes(
        task.states, task.actions, dynamics.outcomes,
        int(np.flatnonzero(task.start)[0]), task.episode_limit,
    )  # fmt: skip
    ended = (dynamics.events & TERMINATED > 0).astype(np.uint8)
    arrays = (
        dynamics.next_state.astype(np.int32), dynamics.reward.astype(np.float32), ended,
        dynamics.cumulative.astype(np.float32),
    )  # fmt: skip
    return Table(*map(cuda.to_device, arrays)), sizes


@cuda.jit(device=True, inline="always")
def best(values: Any, state: Any, actions: Any) -> Any:
    """The largest value of a state."""
    found = values[state * actions]
    for action in range(1, actions):
        found = max(found, values[state * actions + action])
    return found


@cuda.jit(device=True, inline="always")
def choice(values: Any, state: Any, actions: Any, explores: Any, chance: Any) -> Any:
    """Any action, or one of the best."""
    if explores:
        return int(chance * np.float32(actions))
    highest, equal = best(values, state, actions), 0
    for action in range(actions):
        equal += values[state * actions + action] == highest
    left, found = int(chance * np.float32(equal)), 0
    for action in range(actions):
        if values[state * actions + action] == highest:
            if left == 0:
                found = action
            left -= 1
    return found


@cuda.jit(device=True, inline="always")
def outcome(table: Any, first: Any, outcomes: Any, chance: Any) -> Any:
    """Which outcome of an action happens."""
    index = first
    while index < first + outcomes - 1 and table.cumulative[index] <= chance:
        index += 1
    return index


@cuda.jit(device=True, inline="always")
def rate_of(episode: Any, episodes: Any) -> Any:
    """Exploration and learning rate."""
    gone = min(np.float32(episode) / (np.float32(0.9) * np.float32(episodes)), np.float32(1))
    return np.float32(1) - gone * np.float32(0.98)


@functools.cache
def make_kernel(sizes: Sizes, way: str) -> Any:
    """The kernel that runs learners in a way."""
    states, actions, outcomes, start, limit = sizes
    words, kind, begin, uniform = short_stream(np.float32)

    @cuda.jit(device=True, inline="always")
    def step(table: Any, values: Any, state: Any, stream: Any, rate: Any, learns: Any) -> Any:
        explores = uniform(stream) < rate and learns
        action = choice(values, state, actions, explores, uniform(stream))
        first = (state * actions + action) * outcomes
        index = outcome(table, first, outcomes, uniform(stream))
        following, ended = table.following[index], table.ended[index]
        if learns:
            future = np.float32(0) if ended else best(values, following, actions)
            place = state * actions + action
            values[place] += rate * (table.reward[index] + future - values[place])
        return following, ended, table.reward[index]

    @cuda.jit(device=True, inline="always")
    def in_episodes(table: Any, values: Any, learner: Any, episodes: Any, found: Any,
                    steps: Any) -> None:  # fmt: skip
        stream, taken, total = cuda.local.array(words, kind), 0, np.float32(0)
        begin(learner, stream)
        for episode in range(episodes):
            rate = rate_of(episode, episodes)
            state, ended, length = start, 0, 0
            while length < limit and not ended:
                state, ended, _ = step(table, values, state, stream, rate, True)
                length += 1
            taken += length
            state, ended, length = start, 0, 0
            while length < limit and not ended:
                state, ended, reward = step(table, values, state, stream, rate, False)
                length += 1
                total += reward
            taken += length
        found[learner] = total / np.float32(episodes)
        steps[learner] = taken

    @cuda.jit(device=True, inline="always")
    def in_steps(table: Any, values: Any, learner: Any, episodes: Any, found: Any,
                 steps: Any) -> None:  # fmt: skip
        stream, taken, total = cuda.local.array(words, kind), 0, np.float32(0)
        begin(learner, stream)
        episode, learns, state, length = 0, True, start, 0
        rate = rate_of(0, episodes)
        while episode < episodes:
            state, ended, reward = step(table, values, state, stream, rate, learns)
            length += 1
            total += np.float32(0) if learns else reward
            if ended or length == limit:
                taken += length
                episode += 0 if learns else 1
                learns = not learns
                state, length, rate = start, 0, rate_of(episode, episodes)
        found[learner] = total / np.float32(episodes)
        steps[learner] = taken

    run: Any = in_steps if way == "one step after another" else in_episodes
    size = states * actions

    @cuda.jit
    def one_each(table: Any, episodes: Any, found: Any, steps: Any, taken: Any) -> None:
        learner = cuda.grid(1)
        if learner < found.shape[0]:
            values = cuda.local.array(size, np.float32)
            for place in range(size):
                values[place] = np.float32(0)
            run(table, values, learner, episodes, found, steps)

    @cuda.jit
    def one_after_another(table: Any, episodes: Any, found: Any, steps: Any, taken: Any) -> None:
        values = cuda.local.array(size, np.float32)
        learner = cuda.atomic.add(taken, 0, 1)
        while learner < found.shape[0]:
            for place in range(size):
                values[place] = np.float32(0)
            run(table, values, learner, episodes, found, steps)
            learner = cuda.atomic.add(taken, 0, 1)

    return one_after_another if way == "persistent" else one_each


class Ran(NamedTuple):
    """What learners came to: their unassisted returns, all their steps, and how long it took."""

    unassisted: np.ndarray
    steps: int
    seconds: float


def run(task: str, way: str, learners: int, episodes: int) -> Ran:
    """Simulate learners, and say how long the kernel took alone."""
    table, sizes = table_of(task)
    kernel, blocks = make_kernel(sizes, way), -(-learners // THREADS)
    if way == "persistent":
        blocks = min(blocks, BLOCKS_PER_MULTIPROCESSOR * _multiprocessors())
    found, steps = cuda.device_array(learners, np.float32), cuda.device_array(learners, np.int64)

    def launch(episodes: int) -> float:
        taken = cuda.to_device(np.zeros(1, np.int64))
        begin = time.perf_counter()
        kernel[blocks, THREADS, 0, SHARED_BYTES](table, episodes, found, steps, taken)
        cuda.synchronize()
        return time.perf_counter() - begin

    launch(1)
    seconds = launch(episodes)
    return Ran(found.copy_to_host(), int(steps.copy_to_host().sum()), seconds)


def _multiprocessors() -> int:
    simulated = config.ENABLE_CUDASIM  # type: ignore[attr-defined]
    return 1 if simulated else cuda.get_current_device().MULTIPROCESSOR_COUNT


def _timed(task: str, way: str, learners: int, episodes: int) -> Timed:
    def timed(_: int) -> float:
        ran = run(task, way, learners, episodes)
        return ran.steps / ran.seconds / 1e6

    return timed


def at_work(task: str, assistant: str, trials: int, episodes: int) -> Row:
    """Share of the threads that are at work, if groups of them end each episode together."""
    outcomes = simulate(
        task, assistant, trials=trials, episodes=episodes, workers=usable_cores()
    ).outcomes
    steps = longest = 0
    for lengths in (outcomes.assisted_length, outcomes.unassisted_length):
        groups = lengths.reshape(-1, LANES, lengths.shape[1])
        steps += int(groups.sum())
        longest += LANES * int(groups.max(axis=1).sum())
    return Row(f"{task}, {assistant}, threads at work", steps / longest, "of all")


def measure(quick: bool) -> Iterator[Row]:
    """Every row of this benchmark; of a card none, with a sentence, if there is none."""
    learners, episodes, rounds = _QUICK if quick else _FULL
    for task in TASKS:
        for assistant in ("none", "maximal"):
            yield at_work(task, assistant, LANES if quick else 100 * LANES, episodes)
    try:
        device_of("gpu")
    except RequestError as error:
        print(f"Skipped: {error}")
        return
    for task in TASKS[:1] if quick else TASKS:
        _check_agreement(task, learners, episodes)
        rates = alternate({way: _timed(task, way, learners, episodes) for way in WAYS}, rounds)
        plain = rates[WAYS[0]]
        for way, rate in rates.items():
            yield compared(f"{task}, {way}", rate, UNIT, WAYS[0], plain)


def _check_agreement(task: str, learners: int, episodes: int) -> None:
    """Every learner comes to the same, whichever way it is run."""
    expected = run(task, WAYS[0], learners, episodes)
    for way in WAYS[1:]:
        found = run(task, way, learners, episodes)
        if found.steps != expected.steps or (found.unassisted != expected.unassisted).any():
            raise RuntimeError(f"{way}: learners come to something else than {WAYS[0]}")


if __name__ == "__main__":
    show("Episodes of unequal length", [*watched(measure(is_quick(__doc__)))])
