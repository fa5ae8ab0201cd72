"""Sampling of outcomes: which outcome a number in [0, 1) falls on."""

import dataclasses

import numba
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.tasks.dynamics import first_state, sample, transition
from tests.tasks.examples import random_task, random_tasks

chances = st.floats(0, 1, exclude_max=True)
LAST_CHANCE = float(np.nextafter(1, 0))


def plain_sample(probability: np.ndarray, chance: float) -> int:
    """The first outcome at which the running sum of probabilities exceeds `chance`."""
    running = 0.0
    for index, share in enumerate(probability):
        running += share
        if chance < running:
            return index
    return int(np.flatnonzero(probability)[-1])  # the sum fell short of 1 by round-off


@given(random_tasks, chances, st.data())
def test_a_chance_falls_on_the_outcome_that_the_running_sum_says(task, chance, data):
    state = data.draw(st.integers(0, task.states - 1))
    action = data.draw(st.integers(0, task.actions - 1))
    dynamics = task.dynamics()
    index = transition(dynamics, state, action, chance)
    outcome = plain_sample(task.probability[state, action], chance)
    assert dynamics.next_state[index] == task.next_state[state, action, outcome]
    assert dynamics.reward[index] == task.reward[state, action, outcome]
    assert bool(dynamics.events[index] & 1) == task.terminated[state, action, outcome]


@given(random_tasks, chances)
def test_an_episode_starts_where_the_running_sum_says(task, chance):
    assert first_state(task.dynamics(), chance) == plain_sample(task.start, chance)


@given(random_tasks, st.sampled_from([0.0, LAST_CHANCE]))
def test_an_impossible_outcome_is_never_drawn_even_at_the_ends(task, chance):
    # Rows may miss 1 by a little; what is left belongs to the last outcome that is possible.
    short = dataclasses.replace(
        task, probability=task.probability * (1 - 1e-9), start=task.start * (1 - 1e-9)
    )
    dynamics = short.dynamics()
    assert task.start[first_state(dynamics, chance)] > 0
    for state, action in np.ndindex(task.states, task.actions):
        assert task.probability.ravel()[transition(dynamics, state, action, chance)] > 0


def test_the_borders_belong_to_the_next_outcome():
    cumulative = np.array([9.0, 0.25, 0.75, 1.0, 9.0])
    drawn = [sample(cumulative, 1, 3, chance) for chance in (0.0, 0.25, 0.74, 0.75, LAST_CHANCE)]
    assert drawn == [1, 2, 2, 3, 3]


def test_compiled_code_draws_the_same_outcomes():
    @numba.njit
    def compiled_transitions(dynamics, state, action, chances):
        return [transition(dynamics, state, action, chance) for chance in chances]

    dynamics = random_task(3, 5, 2).dynamics()
    several = np.random.default_rng(0).random(50)
    for state in range(5):
        plain = [transition(dynamics, state, 1, chance) for chance in several]
        assert compiled_transitions(dynamics, state, 1, several) == plain
