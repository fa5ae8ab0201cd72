"""The least that a graphics card could do: bumpers and Q-learning at Cliff Walking, by hand.

A kernel of one task, one rule and one learner, with 32-bit random numbers and nothing kept but the
mean returns of each learner. It is written apart from the package, which is measured against it.
With the package's own streams of 64 bits in their place, it says what these cost.
"""

import functools
import math
import time
from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda

from qbumpers.random_streams import draw

cuda: Any = numba_cuda

ROWS, COLUMNS, LIMIT = 4, 12, 100
START, GOAL = 36, 47
THREADS = 128


class Plain(NamedTuple):
    """What the kernel found: mean returns of each learner, and steps of all."""

    assisted: np.ndarray
    unassisted: np.ndarray
    steps: int
    seconds: float


def tables(kind: str) -> tuple[np.ndarray, ...]:
    """Next state, reward and value of each action, flat; the goal ends an episode."""
    next_state, reward = np.zeros((48, 4), np.int32), np.zeros((48, 4))
    for state in range(48):
        for action, (down, right) in enumerate(((-1, 0), (0, 1), (1, 0), (0, -1))):
            row = min(max(state // COLUMNS + down, 0), ROWS - 1)
            column = min(max(state % COLUMNS + right, 0), COLUMNS - 1)
            place = row * COLUMNS + column
            fell = row == ROWS - 1 and 0 < column < COLUMNS - 1
            next_state[state, action] = START if fell else place
            reward[state, action] = -100 if fell else 99 if place == GOAL else -1
    values = np.zeros((48, 4))
    for _ in range(500):
        values = reward + np.where(next_state == GOAL, 0, values.max(axis=1)[next_state])
    return next_state.ravel(), reward.ravel().astype(kind), values.ravel().astype(kind)


@cuda.jit(device=True, inline="always")
def one_of(table: Any, first: Any, target: Any, chance: Any) -> Any:
    """One of the four actions of a value, each alike."""
    equal = 0
    for action in range(4):
        equal += table[first + action] == target
    left = int(chance * equal)
    found = 0
    for action in range(4):
        if table[first + action] == target:
            if left == 0:
                found = action
            left -= 1
    return found


@cuda.jit(device=True, inline="always")
def best_of(table: Any, first: Any) -> Any:
    """The largest of four values."""
    one = max(table[first], table[first + 1])
    return max(one, max(table[first + 2], table[first + 3]))


class Stream(NamedTuple):
    """Random numbers of a learner: words and type of its state, how it begins, and the next one."""

    words: int
    kind: Any
    begin: Any
    uniform: Any


def short_stream(real: Any) -> Stream:
    """Words of 32 bits by Xorshift (Marsaglia 2003)."""
    share = real(2.0**-24)

    @cuda.jit(device=True, inline="always")
    def begin(learner: Any, state: Any) -> None:
        state[0] = learner * 2654435761 % 4294967295 + 1

    @cuda.jit(device=True, inline="always")
    def uniform(state: Any) -> Any:
        word = state[0]
        word ^= (word << 13) & 0xFFFFFFFF
        word ^= word >> 17
        word ^= (word << 5) & 0xFFFFFFFF
        state[0] = word & 0xFFFFFFFF
        return real(state[0] >> 8) * share

    return Stream(1, np.int64, begin, uniform)


def long_stream(real: Any) -> Stream:
    """Words of 64 bits by SFC64, as the package draws them."""

    @cuda.jit(device=True, inline="always")
    def begin(learner: Any, state: Any) -> None:
        for word in range(3):
            state[word] = np.uint64(learner + 1)
        state[3] = np.uint64(1)
        for _ in range(12):
            draw(state)

    @cuda.jit(device=True, inline="always")
    def uniform(state: Any) -> Any:
        return real(draw(state))

    return Stream(4, np.uint64, begin, uniform)


STREAMS = {"32 bits": short_stream, "64 bits": long_stream}


@functools.cache
def make_kernel(kind: str, bits: str = "32 bits") -> Any:
    """The kernel for numbers of a kind, "float32" or "float64", and one of `STREAMS`."""
    real = np.float32 if kind == "float32" else np.float64
    steepness = real(2 * math.log(0.001 / 0.999))
    words, state_kind, begin, uniform = STREAMS[bits](real)

    @cuda.jit
    def kernel(next_state: Any, reward: Any, values: Any, alpha: Any, episodes: Any, found: Any,
               steps: Any) -> None:  # fmt: skip
        learner = cuda.grid(1)
        if learner >= steps.shape[0]:
            return
        table = cuda.local.array(192, real)
        for place in range(192):
            table[place] = real(0)
        stream = cuda.local.array(words, state_kind)
        begin(learner, stream)
        start = best_of(values, 4 * START)
        allowed = alpha * start
        assisted, unassisted, taken = 0.0, 0.0, 0
        for episode in range(episodes):
            gone = min(real(episode) / (real(0.9) * real(episodes)), real(1))
            rate = real(1) + gone * real(0.02 - 1)
            state, earned = START, real(0)
            for _ in range(LIMIT):
                first = 4 * state
                explores = uniform(stream) < rate
                chance = uniform(stream)
                proposed = int(chance * real(4))
                if not explores:
                    proposed = one_of(table, first, best_of(table, first), chance)
                best, second = best_of(values, first), real(-1e30)
                for action in range(4):
                    if values[first + action] < best:
                        second = max(second, values[first + action])
                if second < real(-1e29):
                    second = best
                executed = proposed
                coin = uniform(stream)
                tie = uniform(stream)
                if values[first + proposed] < second:
                    if start - (earned + second) >= allowed:
                        executed = one_of(values, first, best, tie)
                    else:
                        ratio = (start - (earned + values[first + proposed])) / allowed
                        due = real(1) / (real(1) + math.exp(steepness * (ratio - real(0.5))))
                        due = real(0) if ratio <= real(0) else real(1) if ratio >= real(1) else due
                        if coin < due:
                            executed = one_of(values, first, second, tie)
                gained, following = reward[first + executed], next_state[first + executed]
                earned += gained
                future = real(0) if following == GOAL else best_of(table, 4 * following)
                table[first + proposed] += rate * (gained + future - table[first + proposed])
                taken += 1
                state = following
                if state == GOAL:
                    break
            assisted += earned
            state = START
            for _ in range(LIMIT):
                first = 4 * state
                chosen = one_of(table, first, best_of(table, first), uniform(stream))
                unassisted += reward[first + chosen]
                taken += 1
                state = next_state[first + chosen]
                if state == GOAL:
                    break
        found[learner, 0] = assisted / episodes
        found[learner, 1] = unassisted / episodes
        steps[learner] = taken

    return kernel


def run(learners: int, episodes: int, alpha: float, kind: str, bits: str = "32 bits") -> Plain:
    """Simulate learners, and say how long the kernel took alone."""
    sent = [cuda.to_device(array) for array in tables(kind)]
    found, steps = cuda.device_array((learners, 2)), cuda.device_array(learners, np.int64)
    kernel, blocks = make_kernel(kind, bits), -(-learners // THREADS)
    share = np.dtype(kind).type(alpha)
    kernel[blocks, THREADS](*sent, share, 1, found, steps)
    cuda.synchronize()
    begin = time.perf_counter()
    kernel[blocks, THREADS](*sent, share, episodes, found, steps)
    cuda.synchronize()
    seconds = time.perf_counter() - begin
    means = found.copy_to_host()
    return Plain(means[:, 0], means[:, 1], int(steps.copy_to_host().sum()), seconds)
