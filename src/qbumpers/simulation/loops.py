"""Trials of tabular learners: an assisted episode, then a greedy unassisted one, and again.

The loops below are plain Python that Numba compiles once for each decision rule and learner. One
that cannot be compiled runs through the same loops uncompiled.
"""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants.dispatch import decide, observe, undoes
from qbumpers.assistants.dispatch import start as start_rule
from qbumpers.borrowing import borrow, clear_scratch, hold, row
from qbumpers.compilation import compiled, compiled_for_session, inlined, uncompiled
from qbumpers.decisions import (
    Execution,
    Model,
    Noise,
    Step,
    begin,
    execution_of,
    proposal_of,
    settle,
    situate,
    step_of,
)
from qbumpers.learners.dispatch import begin as begin_learner
from qbumpers.learners.dispatch import choose, forget_between, fresh_memory, learn, prefer
from qbumpers.learners.dispatch import start as start_learner
from qbumpers.learners.forgetting import Practice, begin_practice, practise
from qbumpers.learners.interface import Shape
from qbumpers.learners.motor import move
from qbumpers.learners.perception import believed, noticing, perceive
from qbumpers.random_streams import ASSISTANT, ENVIRONMENT, EVALUATION, LEARNER, draw
from qbumpers.simulation.outcomes import Sinks
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, Dynamics, first_state, transition

_WORDS = (0, 0, 0, 0)  # as wide as the state of a stream


class Assistance(NamedTuple):
    """The assistant of a loop.

    Attributes:
        values: float64 [S, A], Q* by state.
        others: float64 [S, K, A], the further rows that the rule named.
        seen: int64 [S], what the assistant sees of each state; None if it sees the state.
        discount: gamma of the values, in (0, 1].
        options: of the rule, as numbers; their type selects it.
        width: a tuple of A integers, see `qbumpers.borrowing.row`.
    """

    values: np.ndarray
    others: np.ndarray
    seen: np.ndarray | None
    discount: float
    options: Any
    width: tuple[int, ...]


class LearnerStack(NamedTuple):
    """The learner of a loop: how it learns, and what lies around that.

    Attributes:
        settings: as numbers; their type selects the learner.
        perception: as numbers.
        motor: `Motor`; None if the hand never errs.
        forgetting: share of the way back to its first memory between episodes; None if 0.
        practice: arrays that change, if it forgets by age; else None.
    """

    settings: Any
    perception: Any
    motor: Any
    forgetting: float | None
    practice: Practice | None


class Minds(NamedTuple):
    """What is remembered in a trial.

    Attributes:
        learner: the learner's memory.
        fresh: that memory as it was at first; anything if nothing is forgotten.
        rule: the rule's memory.
    """

    learner: Any
    fresh: Any
    rule: Any


class TrialStreams(NamedTuple):
    """The random streams of trials.

    Attributes:
        all: uint64 [T, 1, 4, 4] or, to begin anew in every episode, [T, E, 4, 4], see
            `qbumpers.random_streams`.
        own: uint64 [4, 4], those of the trial that runs; they change.
    """

    all: np.ndarray
    own: np.ndarray


class When(NamedTuple):
    """Which episode of which trial.

    Attributes:
        trial: place of the trial among the outcomes.
        episode: counted from 0.
        assisted: whether the assistant is there.
    """

    trial: int
    episode: int
    assisted: bool


@inlined
def _seen(seen: np.ndarray | None, state: int) -> int:
    """What the assistant sees of a state."""
    if seen is None:
        return state
    return seen[state]


@inlined
def _keep(record: Step | None, index: int, state: int, next_state: int, step: Step) -> None:
    if record is None:
        return
    record.episode[index] = step.episode
    record.state[index] = state
    record.proposed[index] = step.proposed
    record.executed[index] = step.executed
    record.undone[index] = step.undone
    record.credited[index] = step.credited
    record.overridden[index] = step.overridden
    record.probability[index] = step.probability
    record.coin[index] = step.coin
    record.tie[index] = step.tie
    for action in range(len(step.values)):
        record.values[index, action] = step.values[action]
    record.projected_return[index] = step.projected_return
    record.reward[index] = step.reward
    record.next_state[index] = next_state
    record.events[index] = step.events


@inlined
def _count_assisted(counts: Any, state: int, assisted: bool, overridden: bool) -> None:
    if counts is not None:
        counts.assisted[state] += assisted
        counts.overridden[state] += overridden


@inlined
def _count_unassisted(counts: Any, state: int, assisted: bool) -> None:
    if counts is not None:
        counts.unassisted[state] += assisted


@inlined
def _is_over(script: Any, recorded: int) -> bool:
    """Whether a script has been played to its end."""
    if script is None:
        return False
    return recorded >= len(script.proposed)


@inlined
def _propose(
    script: Any, recorded: int, learner: LearnerStack, memory: Any, state: int, rates: Any,
    last: int, actions: int, streams: Any,
) -> tuple[int, Noise]:  # fmt: skip
    """What the learner proposes, and the assistant's noise; or what a script says."""
    if script is None:
        meant = choose(learner.settings, memory, state, rates, streams[LEARNER])
        done = move(learner.motor, meant, last, actions, streams[LEARNER])
        noise = streams[ASSISTANT]
        return proposal_of(done, actions), Noise(draw(noise), draw(noise))
    return script.proposed[recorded], Noise(script.coin[recorded], script.tie[recorded])


@inlined
def _chance(possibilities: int, stream: Any) -> float:
    """A number that chooses among possibilities, drawn only if there is a choice."""
    return draw(stream) if possibilities > 1 else 0.0


@inlined
def _happened(event: int, undone: bool, last: bool) -> int:
    """Events of a step: an undone one ends nothing, and the last one that is allowed does."""
    events = event & ~TERMINATED if undone else event
    return events | LIMIT if last and not events & TERMINATED else events


@inlined
def _assisted_episode(
    dynamics: Dynamics, assistance: Assistance, learner: LearnerStack, memory: Any, rates: Any,
    rule_memory: Any, streams: Any, when: When, sinks: Sinks, recorded: int,
) -> tuple[Any, int]:  # fmt: skip
    """One episode of training; returns the rule's memory and how many steps there are so far."""
    nature, width = streams[ENVIRONMENT], assistance.width
    state = first_state(dynamics, _chance(len(dynamics.start_states), nature))
    account = begin(row(assistance.values, state, width), when.episode)
    total, overrides, events, length, last = 0.0, 0, 0, 0, -1
    while length < dynamics.episode_limit and not _is_over(sinks.script, recorded):
        clear_scratch()
        proposed, noise = _propose(
            sinks.script, recorded, learner, memory, state, rates, last, dynamics.actions, streams
        )
        situation = situate(
            account, _seen(assistance.seen, state), row(assistance.values, state, width),
            row(assistance.others, state, width), proposed,
        )  # fmt: skip
        execution = Execution(proposed, False, 0.0)
        if when.assisted:
            decision = decide(situation, noise, assistance.options, rule_memory)
            execution = execution_of(decision, undoes(decision), dynamics.actions)
        index = transition(dynamics, state, execution.executed, _chance(dynamics.outcomes, nature))
        reward, event = np.float64(dynamics.reward[index]), int(dynamics.events[index])
        next_state = dynamics.next_state[index]
        overridden = execution.executed != proposed or execution.undone
        experience = perceive(
            learner.perception, proposed, execution.executed, execution.undone, reward,
            noticing(learner.perception, overridden, streams[LEARNER]),
        )  # fmt: skip
        length += 1
        happened = _happened(event, execution.undone, length == dynamics.episode_limit)
        step = step_of(
            situation, noise, execution, experience.action, reward,
            _seen(assistance.seen, next_state), happened,
        )  # fmt: skip
        if when.assisted:
            rule_memory = observe(rule_memory, step, assistance.options)
        if experience.action >= 0:
            learn(
                learner.settings, memory,
                believed(experience, state, next_state, event & TERMINATED != 0), rates,
                streams[LEARNER],
            )  # fmt: skip
            practise(learner.practice, state, experience.action)
        _count_assisted(sinks.counts, state, when.assisted, overridden)
        _keep(sinks.record, recorded, state, next_state, step)
        recorded += 1
        account = settle(account, reward, assistance.discount)
        total += reward
        overrides += overridden
        events |= happened
        last = proposed
        if happened & TERMINATED:
            break
        if not execution.undone:
            state = next_state
    outcomes, place = sinks.outcomes, (when.trial, when.episode)
    outcomes.assisted_return[place] = total
    outcomes.assisted_length[place] = length
    outcomes.overrides[place] = overrides
    outcomes.assisted_events[place] = events
    return rule_memory, recorded


@inlined
def _greedy_episode(
    dynamics: Dynamics, learner: LearnerStack, memory: Any, stream: Any, when: When, sinks: Sinks
) -> None:
    """One unassisted episode, without exploration or learning."""
    state = first_state(dynamics, _chance(len(dynamics.start_states), stream))
    total, events, length, last = 0.0, 0, 0, -1
    while length < dynamics.episode_limit:
        meant = prefer(learner.settings, memory, state, draw(stream))
        done = move(learner.motor, meant, last, dynamics.actions, stream)
        last = proposal_of(done, dynamics.actions)
        _count_unassisted(sinks.counts, state, when.assisted)
        index = transition(dynamics, state, last, _chance(dynamics.outcomes, stream))
        total += dynamics.reward[index]
        length += 1
        state = dynamics.next_state[index]
        events |= _happened(int(dynamics.events[index]), False, length == dynamics.episode_limit)
        if events & TERMINATED:
            break
    outcomes, place = sinks.outcomes, (when.trial, when.episode)
    outcomes.unassisted_return[place] = total
    outcomes.unassisted_length[place] = length
    outcomes.unassisted_events[place] = events


@inlined
def begin_streams(streams: TrialStreams, trial: int, episode: int) -> None:
    """Copy streams, number by number: copying slices takes Numba far longer to compile."""
    for source in range(streams.own.shape[0]):
        for word in range(streams.own.shape[1]):
            streams.own[source, word] = streams.all[trial, episode, source, word]


@inlined
def run_episodes(
    dynamics: Dynamics, assistance: Assistance, learner: LearnerStack, minds: Minds,
    streams: TrialStreams, trial: int, retention: int, sinks: Sinks, recorded: int,
) -> int:  # fmt: skip
    """The episodes of one trial, whose streams and memories have begun.

    Args:
        dynamics: what is to be learned.
        assistance: what helps in it.
        learner: what is simulated, with what lies around it.
        minds: what is remembered.
        streams: of all trials, and this trial's own, which has begun.
        trial: place of the trial among the outcomes.
        retention: R, episodes at the end without the assistant.
        sinks: what is to be filled.
        recorded: steps of training before this trial.

    Returns:
        The steps of training so far.
    """
    episodes = sinks.outcomes.assisted_return.shape[1]
    training = episodes - retention
    own = (
        row(streams.own, LEARNER, _WORDS),
        row(streams.own, ASSISTANT, _WORDS),
        row(streams.own, ENVIRONMENT, _WORDS),
        row(streams.own, EVALUATION, _WORDS),
    )
    memory, rule_memory = minds.learner, minds.rule
    begin_practice(learner.practice)
    for episode in range(episodes):
        if episode > 0 and streams.all.shape[1] > 1:
            begin_streams(streams, trial, episode)
        when = When(trial, episode, episode < training)
        if episode > 0:
            forget_between(learner.forgetting, learner.practice, memory, minds.fresh)
        rates = begin_learner(learner.settings, memory, episode, training)
        rule_memory, recorded = _assisted_episode(
            dynamics, assistance, learner, memory, rates, rule_memory, own, when, sinks, recorded
        )
        _greedy_episode(dynamics, learner, memory, own[EVALUATION], when, sinks)
    return recorded


@compiled
def run_trials(
    model: Model, assistance: Assistance, learner: LearnerStack, streams: np.ndarray,
    retention: int, sinks: Sinks,
) -> int:  # fmt: skip
    """Run trials one after another.

    In the last `retention` episodes the assistant is gone: the learner goes on by itself, with the
    exploration and learning rate that the schedules end with.

    Args:
        model: what is to be learned, with its dynamics.
        assistance: what helps in them.
        learner: what is simulated, with what lies around it.
        streams: uint64 [T, 1, 4, 4] or, to begin anew in every episode, [T, E, 4, 4], see
            `qbumpers.random_streams`.
        retention: R, of the E episodes.
        sinks: what is to be filled.

    Returns:
        Number of steps of training.

    Raises:
        RequestError: if the rule or the learner chooses an action that there is not, or the rule
            gives a probability outside [0, 1].
    """
    shape = Shape(model.states, 0, assistance.width)
    dynamics, help_given, kept = borrow(model.dynamics), borrow(assistance), borrow(sinks)
    own = np.empty((4, 4), np.uint64)
    trial_streams = TrialStreams(streams, borrow(own))
    recorded = 0
    for trial in range(sinks.outcomes.assisted_return.shape[0]):
        begin_streams(trial_streams, trial, 0)
        stream = row(trial_streams.own, LEARNER, _WORDS)
        forgets = learner.forgetting, learner.practice
        fresh = fresh_memory(forgets, learner.settings, shape, stream)
        held = start_learner(learner.settings, shape, stream)
        minds = Minds(borrow(held), fresh, start_rule(assistance.options, model))
        recorded = run_episodes(
            dynamics, help_given, learner, minds, trial_streams, trial, retention, kept, recorded
        )
        hold(held)
    hold(own)
    return recorded


run_trials_for_session = compiled_for_session(uncompiled(run_trials))
"""The same loops for rules and learners from outside the package, which may change at any time."""
