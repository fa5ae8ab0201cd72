"""A learner whose choice is not a whole number in compiled code runs as plain Python."""

from typing import NamedTuple

import numpy as np
import pytest

from qbumpers.learners import learner_for_settings, register_learner


class Settings(NamedTuple):
    pass


class Memory(NamedTuple):
    values: np.ndarray


def start(settings, shape, stream):
    return Memory(np.zeros((shape.states, len(shape.width))))


def choose(settings, memory, state, rates, stream):
    return {0: 1}.get(state)  # in compiled code an action, or nothing


def prefer(settings, memory, state, tie):
    return 1


def policy(settings, memory, state, rates, out):
    out[:] = 0
    out[1] = 1


def learn(settings, memory, transition, rates, stream):
    pass


def test_a_warning_says_so_where_it_is_registered():
    with pytest.warns(UserWarning, match="choose returns .*, not a whole number") as caught:
        kind = register_learner(
            "may-not-choose", Settings, start=start,
            choose=choose,  # pyright: ignore[reportArgumentType] - this is what is refused
            prefer=prefer, policy=policy, learn=learn,
        )  # fmt: skip
    assert caught[0].filename == __file__
    assert not learner_for_settings(kind).compiled
