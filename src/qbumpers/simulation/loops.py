"""Trials of tabular learners: an assisted episode, then a greedy one without help, and again.

The loops below are plain Python that Numba compiles once for each decision rule. A rule that cannot
be compiled runs through the same loops uncompiled.
"""

from typing import Any

import numpy as np
from numba.extending import register_jitable

from qbumpers.assistants.dispatch import decide, observe, start
from qbumpers.borrowing import borrow, row
from qbumpers.choice import best_value
from qbumpers.compilation import INLINE, compiled, compiled_for_session, uncompiled
from qbumpers.decisions import Noise, Situation, Step, projected_return
from qbumpers.errors import RequestError
from qbumpers.learners.perception import Experience, perceive
from qbumpers.learners.q_learning import QLearner, choose, choose_greedily, learned, scheduled
from qbumpers.random_streams import ASSISTANT, ENVIRONMENT, EVALUATION, LEARNER, draw
from qbumpers.tasks.dynamics import TERMINATED, first_state, transition

_WORDS = (0, 0, 0, 0)  # as wide as the state of a stream


@register_jitable(**INLINE)
def _record(record: Any, index: int, episode: int, state: int, led: Any, step: Step) -> None:
    record.episode[index] = episode
    record.state[index] = state
    record.next_state[index] = led[0]
    record.events[index] = led[1]
    record.proposed[index] = step.proposed
    record.executed[index] = step.executed
    record.credited[index] = step.credited
    record.overridden[index] = step.overridden
    record.probability[index] = step.probability
    record.coin[index] = step.coin
    record.tie[index] = step.tie
    record.values[index] = step.values
    record.projected_return[index] = step.projected_return
    record.reward[index] = step.reward


@register_jitable(**INLINE)
def _chance(possibilities: int, stream: Any) -> float:
    """A number that chooses among possibilities, drawn only where there is a choice."""
    return draw(stream) if possibilities > 1 else 0.0


@register_jitable(**INLINE)
def _learn(
    own_values: np.ndarray,
    state: int,
    experience: Experience,
    event: int,
    next_state: int,
    learner: QLearner,
    learning_rate: float,
    width: Any,
) -> None:
    if experience.action < 0:
        return
    future = 0.0
    if not event & TERMINATED:
        future = learner.discount * best_value(row(own_values, next_state, width))
    values = row(own_values, state, width)
    values[experience.action] = learned(
        values[experience.action], experience.reward, future, learning_rate
    )


@register_jitable(**INLINE)
def _assisted_episode(
    dynamics, values, gamma, own_values, learner, perception, options, memory, streams, width,
    rates, helped, outcomes, place, counts, record, recorded, script,
):  # fmt: skip
    """One training episode; returns the rule's memory and how many steps there are so far."""
    explore, chance, nature = streams[LEARNER], streams[ASSISTANT], streams[ENVIRONMENT]
    epsilon, learning_rate = rates
    state = first_state(dynamics, _chance(len(dynamics.start_states), nature))
    start_value = best_value(row(values, state, width))
    earned, discount, total = 0.0, 1.0, 0.0
    overrides, events, length = 0, 0, 0
    while length < dynamics.episode_limit:
        if script is None:
            own_row = row(own_values, state, width)
            proposed = choose(own_row, epsilon, draw(explore), draw(explore))
            noise = Noise(draw(chance), draw(chance))
        else:
            if recorded >= len(script.proposed):
                break
            proposed = script.proposed[recorded]
            noise = Noise(script.coin[recorded], script.tie[recorded])
        known = row(values, state, width)
        situation = Situation(known, proposed, earned, discount, start_value)
        executed, probability = proposed, 0.0
        if helped:
            decision = decide(situation, noise, options, memory)
            executed, probability = int(decision.action), float(decision.probability)
        if not 0 <= executed < dynamics.actions:
            raise RequestError("the assistant's rule chose an action outside the action space")
        index = transition(dynamics, state, executed, _chance(dynamics.outcomes, nature))
        reward, event = dynamics.reward[index], dynamics.events[index]
        next_state = dynamics.next_state[index]
        experience = perceive(perception, proposed, executed, reward, learner.penalty)
        step = Step(
            proposed, executed, experience.action, executed != proposed,
            probability, noise.coin, noise.tie, known,
            projected_return(earned, discount, known[proposed]), reward,
        )  # fmt: skip
        if helped:
            memory = observe(memory, step, options)
        _learn(own_values, state, experience, event, next_state, learner, learning_rate, width)
        if counts is not None:
            counts.assisted[state] += helped
            counts.overridden[state] += step.overridden
        if record is not None:
            _record(record, recorded, place[1], state, (next_state, event), step)
        recorded += 1
        earned += discount * reward
        discount *= gamma
        total += reward
        overrides += step.overridden
        events |= event
        length += 1
        state = next_state
        if event & TERMINATED:
            break
    outcomes.assisted_return[place] = total
    outcomes.assisted_length[place] = length
    outcomes.overrides[place] = overrides
    outcomes.assisted_events[place] = events
    return memory, recorded


@register_jitable(**INLINE)
def _greedy_episode(dynamics, own_values, stream, width, helped, outcomes, place, counts):
    """One episode without help, exploration or learning."""
    state = first_state(dynamics, _chance(len(dynamics.start_states), stream))
    total, events, length = 0.0, 0, 0
    while length < dynamics.episode_limit:
        action = choose_greedily(row(own_values, state, width), draw(stream))
        if counts is not None:
            counts.unassisted[state] += helped
        index = transition(dynamics, state, action, _chance(dynamics.outcomes, stream))
        total += dynamics.reward[index]
        events |= dynamics.events[index]
        length += 1
        state = dynamics.next_state[index]
        if dynamics.events[index] & TERMINATED:
            break
    outcomes.unassisted_return[place] = total
    outcomes.unassisted_length[place] = length
    outcomes.unassisted_events[place] = events


@register_jitable(**INLINE)
def _begin(own_streams: np.ndarray, streams: np.ndarray, trial: int, episode: int) -> None:
    """Copy streams, number by number: copying slices takes Numba far longer to compile."""
    for source in range(own_streams.shape[0]):
        for word in range(own_streams.shape[1]):
            own_streams[source, word] = streams[trial, episode, source, word]


@compiled
def run_trials(
    dynamics, values, gamma, learner, perception, options, streams, retention, width, own_values,
    outcomes, counts, record, script,
):  # fmt: skip
    """Run trials one after another.

    In the last `retention` episodes the assistant is gone: the learner goes on by itself, with the
    exploration and learning rate that the schedules end with.

    Args:
        dynamics: the task.
        values: float64 [S, A], Q* of the assistant.
        gamma: discount of those values.
        learner: the simulated person.
        perception: what they believe happened.
        options: of the assistant; their type selects its rule.
        streams: uint64 [T, 1, 4, 4] or, to begin anew in every episode, [T, E, 4, 4], see
            `qbumpers.random_streams`.
        retention: R, of the E episodes.
        width: a tuple of A integers, see `qbumpers.borrowing.row`.
        own_values: float64 [S, A], room for the learner's values; overwritten.
        outcomes: `Outcomes` of arrays [T, E], filled.
        counts: `StateCounts`, added to; or None.
        record: `Steps` with room for every assisted step, filled; or None.
        script: `Script` to be played again; or None.

    Returns:
        Number of assisted steps.

    Raises:
        RequestError: where the rule chooses an action that there is not.
    """
    trials, episodes = outcomes.assisted_return.shape
    training = episodes - retention
    dynamics, values, own_values = borrow(dynamics), borrow(values), borrow(own_values)
    outcomes, counts = borrow(outcomes), borrow(counts)
    record, script = borrow(record), borrow(script)
    own_streams = np.empty((4, 4), np.uint64)
    rows = borrow(own_streams)
    trial_streams = (
        row(rows, 0, _WORDS),
        row(rows, 1, _WORDS),
        row(rows, 2, _WORDS),
        row(rows, 3, _WORDS),
    )
    recorded = 0
    for trial in range(trials):
        own_values[:] = learner.initial_value
        memory = start(options)
        for episode in range(episodes):
            if episode == 0 or streams.shape[1] > 1:
                _begin(own_streams, streams, trial, episode)
            helped = episode < training
            rates = (
                scheduled(learner.epsilon, episode, training),
                scheduled(learner.learning_rate, episode, training),
            )
            memory, recorded = _assisted_episode(
                dynamics, values, gamma, own_values, learner, perception, options, memory,
                trial_streams, width, rates, helped, outcomes, (trial, episode),
                counts, record, recorded, script,
            )  # fmt: skip
            _greedy_episode(
                dynamics, own_values, trial_streams[EVALUATION], width, helped, outcomes,
                (trial, episode), counts,
            )  # fmt: skip
    return recorded


run_trials_for_session = compiled_for_session(uncompiled(run_trials))
"""The same loops for rules from outside the package, whose sources may change at any time."""
