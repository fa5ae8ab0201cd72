"""Learners as a user would write them."""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.learners import register_learner


class Averaging(NamedTuple):
    """One step size for all episodes, and no exploration: it begins with high hopes."""

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    step_size: Annotated[float, Field(gt=0, le=1)] = 0.5
    hopes: float = 0.0


class Values(NamedTuple):
    values: np.ndarray


def first_values(settings, shape, stream):
    return Values(np.full((shape.states, len(shape.width)), settings.hopes))


def best(settings, memory, state, rates, stream):
    return int(np.argmax(memory.values[state]))


def prefer_best(settings, memory, state, tie):
    return int(np.argmax(memory.values[state]))


def always_best(settings, memory, state, rates, out):
    out[:] = 0.0
    out[np.argmax(memory.values[state])] = 1.0


def average(settings, memory, transition, rates, stream):
    future = 0.0 if transition.terminated else np.max(memory.values[transition.next_state])
    target = transition.reward + settings.discount * future
    values = memory.values[transition.state]
    values[transition.action] += settings.step_size * (target - values[transition.action])


def register_averaging(name="averaging"):
    return register_learner(
        name, Averaging, start=first_values, choose=best, prefer=prefer_best,
        policy=always_best, learn=average,
    )  # fmt: skip


class Linear(NamedTuple):
    """A linear function of the observation for each action, of rewards alone; no exploration."""

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    step_size: Annotated[float, Field(gt=0)] = 0.01


class Weights(NamedTuple):
    weights: np.ndarray


def no_weights(settings, shape, stream):
    return Weights(np.zeros((len(shape.width), shape.observation_size)))


def best_of_observation(settings, memory, state, rates, stream):
    return int(np.argmax((memory.weights * state).sum(axis=1)))


def prefer_best_of_observation(settings, memory, state, tie):
    return int(np.argmax((memory.weights * state).sum(axis=1)))


def always_best_of_observation(settings, memory, state, rates, out):
    out[:] = 0.0
    out[np.argmax((memory.weights * state).sum(axis=1))] = 1.0


def follow_rewards(settings, memory, transition, rates, stream):
    weights = memory.weights[transition.action]
    error = transition.reward - (weights * transition.state).sum()
    weights += settings.step_size * error * transition.state


def choose_with_a_dictionary(settings, memory, state, rates, stream):
    """The same choices by means that Numba cannot compile."""
    products = {a: float((w * state).sum()) for a, w in enumerate(memory.weights)}
    return max(products, key=products.__getitem__)


def register_linear(name="linear", choose=best_of_observation):
    return register_learner(
        name, Linear, start=no_weights, choose=choose,
        prefer=prefer_best_of_observation, policy=always_best_of_observation, learn=follow_rewards,
        observes="vectors",
    )  # fmt: skip
