"""How likely a learner makes the proposals of a record, one after another.

One pass over the record. The record decides what a learner's memory is, unless something that
happened to the learner is hidden: whether it noticed an override, if it notices some of them; what
an on-policy learner meant to do next when an episode was cut. Then the pass is a particle filter:
several learners live through the same record, each with chance of its own, and those that explain
the proposals survive (a bootstrap filter: Gordon, Salmond and Smith 1993). Its likelihood is
unbiased. With nothing hidden a single learner is the whole filter, and nothing is left to chance.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from qbumpers.borrowing import row
from qbumpers.compilation import called, compiled, compiled_apart, inlined
from qbumpers.learners.dispatch import begin, copy_memory, learn, policy, start
from qbumpers.learners.interface import Shape, Transition
from qbumpers.learners.motor import Motor, moved_policy
from qbumpers.learners.perception import believed, noticing, perceive
from qbumpers.random_streams import draw

WITHHELD, AFTER, BEFORE = range(3)
"""What a learner gets to know of its next action, and when that is scored.

Nothing; it, scored after learning, as fits learners that choose afresh; or it, scored before, as
fits those that choose their next action while they learn. No action is scored twice."""

_FEWEST = 0.5  # effective particles, as a share of all, below which they are drawn again
_WORDS = (0, 0, 0, 0)


class Choices(NamedTuple):
    """What one participant did and saw, step by step; arrays [N] of `qbumpers.Step`.

    Attributes:
        episode: int64.
        state: int64, in [0, S).
        proposed: int64, in [0, A).
        executed: int64, in [0, A).
        undone: bool.
        reward: float64.
        next_state: int64, in [0, S).
        terminated: bool, whether the episode ended there for good.
    """

    episode: np.ndarray
    state: np.ndarray
    proposed: np.ndarray
    executed: np.ndarray
    undone: np.ndarray
    reward: np.ndarray
    next_state: np.ndarray
    terminated: np.ndarray


class Stack(NamedTuple):
    """A learner with what lies around it, as numbers.

    Attributes:
        settings: of the learner; their type selects it.
        perception: how it reads overridden steps, a `qbumpers.learners.Perception`.
        motor: how its hand errs.
        lapse: probability of an action that has nothing to do with the learner, each alike.
    """

    settings: Any
    perception: Any
    motor: Motor
    lapse: float


@called
def _probability(
    stack: Stack, memory: Any, choices: Choices, step: int, last: int, rates: Any, out: np.ndarray
) -> float:
    """Probability of the action that was proposed at a step."""
    policy(stack.settings, memory, choices.state[step], rates, out)
    moved_policy(stack.motor, out, last, out)
    return float((1 - stack.lapse) * out[choices.proposed[step]] + stack.lapse / len(out))


@inlined
def _is_followed(choices: Choices, step: int, happened: Transition) -> bool:
    """Whether the episode of a step goes on, from where the learner believes it to."""
    following = step + 1
    if following >= len(choices.episode):
        return False
    if choices.episode[following] != choices.episode[step]:
        return False
    return choices.state[following] == happened.next_state


@called
def _live_through(
    stack: Stack, memory: Any, choices: Choices, step: int, rates: Any, stream: Any, order: int,
    out: np.ndarray,
) -> float:  # fmt: skip
    """Let a learner learn from a step.

    Returns:
        The probability of the next proposal, if it is scored before learning; else -1.
    """
    proposed, executed = choices.proposed[step], choices.executed[step]
    undone = choices.undone[step]
    coin = noticing(stack.perception, executed != proposed or undone, stream)
    experience = perceive(stack.perception, proposed, executed, undone, choices.reward[step], coin)
    ahead, next_action = -1.0, -1
    if experience.action < 0:
        return ahead
    happened = believed(
        experience, choices.state[step], choices.next_state[step], choices.terminated[step]
    )
    if order != WITHHELD and not happened.terminated and _is_followed(choices, step, happened):
        next_action = choices.proposed[step + 1]
        if order == BEFORE:
            ahead = _probability(stack, memory, choices, step + 1, proposed, rates, out)
    learn(
        stack.settings, memory,
        Transition(
            happened.state, happened.action, happened.reward, happened.next_state,
            happened.terminated, next_action,
        ),
        rates, stream,
    )  # fmt: skip
    return ahead


@compiled_apart
def _weighed(weights: np.ndarray, likely: np.ndarray) -> float:
    """Weigh particles, float64 [P], by how likely each made what was proposed, float64 [P].

    Returns:
        The logarithm of their mean likelihood; -inf if it was impossible to all, and weights stay.
    """
    total = (weights * likely).sum()
    if total > 0:
        weights *= likely / total
    return math.log(total) if total > 0 else -np.inf


@compiled_apart
def _are_few(weights: np.ndarray) -> bool:
    """Whether most of the weight lies on few particles."""
    return (weights**2).sum() * len(weights) * _FEWEST > 1


@compiled_apart
def _draw_again(weights: np.ndarray, chance: float, taken: np.ndarray) -> None:
    """Systematic resampling: how often each particle is taken; then all weigh the same.

    Args:
        weights: float64 [P], sum to 1; overwritten.
        chance: in [0, 1).
        taken: int64 [P], overwritten; sums to P.
    """
    particles, reached, place = len(weights), weights[0], 0
    taken[:] = 0
    for number in range(particles):
        aim = (number + chance) / particles
        while reached < aim and place < particles - 1:
            place += 1
            reached += weights[place]
        taken[place] += 1
    weights[:] = 1.0 / particles


@compiled
def score(
    stack: Stack, shape: Shape, choices: Choices, training: int, order: int, streams: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Log-probabilities of the proposals of a record, each given all that came before it.

    Args:
        stack: the learner.
        shape: of what it learns.
        choices: the record.
        training: episodes over which its schedules are counted.
        order: `WITHHELD`, `AFTER` or `BEFORE`.
        streams: uint64 [P + 1, 4], random streams of P particles, and one to draw them again; they
            change by what is drawn.
        out: float64 [N], overwritten; -inf if a proposal was impossible. Particles are then as
            likely as they were before it.
    """
    particles, steps = len(streams) - 1, len(choices.episode)
    memories = [start(stack.settings, shape, row(streams, p, _WORDS)) for p in range(particles)]
    likely, ahead = np.empty(particles), np.empty(particles)
    weights, taken = np.full(particles, 1.0 / particles), np.empty(particles, np.int64)
    workspace, step = np.empty(len(shape.width)), 0
    while step < steps:
        last, episode = -1, choices.episode[step]
        ahead[:] = -1.0
        rates = [begin(stack.settings, memory, episode, training) for memory in memories]
        while step < steps and choices.episode[step] == episode:
            for p in range(particles):
                likely[p] = ahead[p]
                if ahead[p] < 0:
                    likely[p] = _probability(
                        stack, memories[p], choices, step, last, rates[p], workspace
                    )
            out[step] = _weighed(weights, likely)
            if particles > 1 and _are_few(weights):
                _draw_again(weights, draw(row(streams, particles, _WORDS)), taken)
                free = 0
                for p in range(particles):
                    for _ in range(taken[p] - 1):
                        while taken[free] > 0:
                            free += 1
                        copy_memory(memories[free], memories[p])
                        rates[free] = rates[p]
                        free += 1
            for p in range(particles):
                ahead[p] = _live_through(
                    stack, memories[p], choices, step, rates[p], row(streams, p, _WORDS), order,
                    workspace,
                )  # fmt: skip
            last = choices.proposed[step]
            step += 1
