"""Cliff Walking's learner as a plain Python loop, the way one would first write it.

The decision rule is the package's, run from its Python source; task, learner and loop are written
here anew, so that equal means also check the compiled loops.
"""

from typing import NamedTuple

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.decisions import Noise, Situation

ROWS, COLUMNS, START, GOAL = 4, 12, 36, 47
MOVES = [(-1, 0), (0, 1), (1, 0), (0, -1)]
EPISODES, DECAY, LIMIT = 100, 90, 100

NO_FURTHER_ROWS = np.zeros((0, 4))


class Totals(NamedTuple):
    """What some trials add up to.

    Attributes:
        steps: of all episodes, assisted and unassisted.
        assisted_mean: return of an assisted episode.
        unassisted_mean: return of a greedy unassisted episode.
    """

    steps: int
    assisted_mean: float
    unassisted_mean: float


def run(assistant: Assistant, values: np.ndarray, trials: int, seed: int) -> Totals:
    """Simulate learners one after another.

    Args:
        assistant: what decides about proposed actions.
        values: float64 [48, 4], Q* of the assistant.
        trials: how many learners.
        seed: decides what learners and assistant draw.

    Returns:
        Steps and means.
    """
    generator = np.random.default_rng(seed)
    steps, assisted, unassisted = 0, 0.0, 0.0
    for _ in range(trials):
        own_values = [[0.0] * len(MOVES) for _ in range(ROWS * COLUMNS)]
        for episode in range(EPISODES):
            rate = 1 + min(episode / DECAY, 1) * (0.02 - 1)
            total, length = assisted_episode(assistant, values, own_values, rate, generator)
            assisted, steps = assisted + total, steps + length
            total, length = greedy_episode(own_values, generator)
            unassisted, steps = unassisted + total, steps + length
    return Totals(steps, assisted / (trials * EPISODES), unassisted / (trials * EPISODES))


def move(state: int, action: int) -> tuple[int, float, bool]:
    """Next state, reward, and whether the episode ends."""
    row = min(max(state // COLUMNS + MOVES[action][0], 0), ROWS - 1)
    column = min(max(state % COLUMNS + MOVES[action][1], 0), COLUMNS - 1)
    cell = row * COLUMNS + column
    if cell == GOAL:
        return cell, 99.0, True
    if cell > START:
        return START, -100.0, False
    return cell, -1.0, False


def greedy(values: list[float], generator: np.random.Generator) -> int:
    """An action of the largest value, ties broken at random."""
    best = max(values)
    equal = [action for action, value in enumerate(values) if value == best]
    return equal[int(generator.random() * len(equal))]


def assisted_episode(
    assistant: Assistant,
    values: np.ndarray,
    own_values: list[list[float]],
    rate: float,
    generator: np.random.Generator,
) -> tuple[float, int]:
    """An assisted episode, learned from; returns its return and length."""
    state, earned, start_value = START, 0.0, float(values[START].max())
    for length in range(1, LIMIT + 1):
        if generator.random() < rate:
            proposed = int(generator.random() * len(MOVES))
        else:
            proposed = greedy(own_values[state], generator)
        situation = Situation(
            state, values[state], NO_FURTHER_ROWS, proposed, earned, 1.0, start_value, 0, length - 1
        )
        noise = Noise(generator.random(), generator.random())
        next_state, reward, ends = move(state, assistant.decide(situation, noise).action)
        future = 0.0 if ends else max(own_values[next_state])
        own_values[state][proposed] += rate * (reward + future - own_values[state][proposed])
        earned += reward
        if ends:
            return earned, length
        state = next_state
    return earned, LIMIT


def greedy_episode(
    own_values: list[list[float]], generator: np.random.Generator
) -> tuple[float, int]:
    """An unassisted episode without exploration or learning; returns its return and length."""
    state, total = START, 0.0
    for length in range(1, LIMIT + 1):
        state, reward, ends = move(state, greedy(own_values[state], generator))
        total += reward
        if ends:
            return total, length
    return total, LIMIT
