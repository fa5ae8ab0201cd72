"""Mirrors of a learner: copies of what it may have learned, and how likely each copy is.

Nobody tells the assistant how a learner reads overrides, how fast it learns or how much it
explores. So it keeps one table of action values M_k, a *mirror*, per hypothesis k, a perception and
a learning rate, and lets each learn from the same steps as the learner,

    M_k(s, c) <- M_k(s, c) + rate_k (r + gamma (1 - terminal) max_b M_k(s', b) - M_k(s, c)),

where c is the proposed action if k takes overrides for its own doing ("transition"), the executed
one if it notices them ("observant"), and nothing is learned from an override if it is taken for an
interruption. A filter weighs every mirror together with a way to choose: greedy but for near ties
that are drawn by a softmax of temperature tau, and a random action with probability epsilon,

    P(a | k, tau, epsilon) = (1 - epsilon) softmax(M_k(s, .) / tau)(a) + epsilon / A.
"""

from typing import NamedTuple

import numpy as np

from qbumpers.compilation import compiled
from qbumpers.decisions import Step
from qbumpers.tasks.dynamics import TERMINATED

PERCEPTIONS = ("transition", "observant", "interruption")
"""What an override may be to a learner, in the order of the mirrors."""

_RATES = np.array([0.02, 0.1, 0.3, 0.6, 1.0])
_TEMPERATURES = np.array([0.0, 0.003, 0.03])  # shares of what an episode may lose
_EPSILONS = np.array([0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0])

_PER_PERCEPTION = len(_RATES)
_TRANSITION, _OBSERVANT = len(_RATES), 2 * len(_RATES)  # where the mirrors of each end
MIRRORS = len(PERCEPTIONS) * len(_RATES)
_WAYS = len(_TEMPERATURES) * len(_EPSILONS)

_DRIFT_WITHIN, _DRIFT_BETWEEN = 1e-3, 1e-6  # per step: how fast a learner's ways may change
_CHANGE = 0.1  # per episode: probability that the learning rate has become a neighbouring one


class Mirrors(NamedTuple):
    """What a learner may have learned, by K hypotheses; those of one perception lie together.

    Attributes:
        values: float64 [S, A, K], their action values, in reward units.
        best: float64 [S, K], the largest of them in a state.
        weights: float64 [B, E, K], probabilities of temperature, epsilon and mirror; sum to 1.
    """

    values: np.ndarray
    best: np.ndarray
    weights: np.ndarray


class Reading(NamedTuple):
    """What a proposal says of the learner.

    Attributes:
        shares: float64 [K], probability of each mirror, the proposal included; sums to 1.
        meant: probability that the proposal is a mistake of which experience would cure the
            learner: with a transition learner that it is meant and no slip, for what a slip
            teaches is soon overwritten; with others that it is what they would choose.
    """

    shares: np.ndarray
    meant: float


@compiled
def blank_mirrors(states: int, actions: int) -> Mirrors:
    """Mirrors of a learner that knows nothing yet, all equally likely."""
    weights = np.full((len(_TEMPERATURES), len(_EPSILONS), MIRRORS), 1 / (_WAYS * MIRRORS))
    return Mirrors(np.zeros((states, actions, MIRRORS)), np.zeros((states, MIRRORS)), weights)


@compiled
def _choices(mirrors: Mirrors, state: int, action: int, loss: float) -> np.ndarray:
    """Probability that each mirror means an action, float64 [B, K], by temperature.

    Args:
        mirrors: of the learner.
        state: where it chooses.
        action: what it chooses.
        loss: what an episode may lose, in reward units; temperatures are shares of it.
    """
    values, best = mirrors.values, mirrors.best
    found = np.empty((len(_TEMPERATURES), MIRRORS))
    for k in range(MIRRORS):
        equal = 0.0
        for other in range(values.shape[1]):
            equal += values[state, other, k] == best[state, k]
        found[0, k] = (values[state, action, k] == best[state, k]) / equal
    for tau in range(1, len(_TEMPERATURES)):
        sharpness = 1 / (_TEMPERATURES[tau] * loss)
        for k in range(MIRRORS):
            total = 0.0
            for other in range(values.shape[1]):
                total += np.exp((values[state, other, k] - best[state, k]) * sharpness)
            own = np.exp((values[state, action, k] - best[state, k]) * sharpness)
            found[tau, k] = own / total
    return found


@compiled
def read(mirrors: Mirrors, state: int, action: int, loss: float) -> Reading:
    """What a proposal says of the learner.

    Args:
        mirrors: of the learner, before the proposal.
        state: where it was proposed.
        action: the proposal.
        loss: what an episode may lose, in reward units.
    """
    chances, weights = _choices(mirrors, state, action, loss), mirrors.weights
    actions = mirrors.values.shape[1]
    shares, total, meant = np.zeros(MIRRORS), 0.0, 0.0
    for tau in range(len(_TEMPERATURES)):
        for k in range(MIRRORS):
            chance, deliberate, random = chances[tau, k], 0.0, 0.0
            for way in range(len(_EPSILONS)):
                deliberate += weights[tau, way, k] * (1 - _EPSILONS[way])
                random += weights[tau, way, k] * _EPSILONS[way]
            own = deliberate * chance
            joint = own + random / actions
            shares[k] += joint
            total += joint
            meant += own if k < _TRANSITION else joint * chance
    for k in range(MIRRORS):
        shares[k] /= total
    return Reading(shares, meant / total)


@compiled
def _weigh(mirrors: Mirrors, step: Step, loss: float) -> np.ndarray:
    """Change the weights by a proposal, and let them drift; returns the shares before the drift."""
    chances, weights = _choices(mirrors, step.state, step.proposed, loss), mirrors.weights
    actions, shares = mirrors.values.shape[1], np.zeros(MIRRORS)
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            for k in range(MIRRORS):
                chance = (1 - _EPSILONS[way]) * chances[tau, k] + _EPSILONS[way] / actions
                weights[tau, way, k] *= chance
                shares[k] += weights[tau, way, k]
    total = shares.sum()
    for k in range(MIRRORS):
        shares[k] /= total
    kept = (1 - _DRIFT_WITHIN - _DRIFT_BETWEEN) / total
    for perception in range(len(PERCEPTIONS)):
        first = perception * _PER_PERCEPTION
        held = shares[first : first + _PER_PERCEPTION].sum()
        fresh = _DRIFT_WITHIN * held / _PER_PERCEPTION + _DRIFT_BETWEEN / MIRRORS
        for tau in range(len(_TEMPERATURES)):
            for way in range(len(_EPSILONS)):
                for k in range(first, first + _PER_PERCEPTION):
                    weights[tau, way, k] = kept * weights[tau, way, k] + fresh / _WAYS
    return shares


@compiled
def _rehearse(
    mirrors: Mirrors, state: int, action: int, target: np.ndarray, first: int, end: int
) -> None:
    """Let the mirrors from `first` to `end` learn `target` [K] of an action."""
    values, best = mirrors.values, mirrors.best
    for k in range(first, end):
        rate = _RATES[k % _PER_PERCEPTION]
        values[state, action, k] += rate * (target[k] - values[state, action, k])
        highest = values[state, 0, k]
        for other in range(1, values.shape[1]):
            highest = max(highest, values[state, other, k])
        best[state, k] = highest


@compiled
def reflect(mirrors: Mirrors, step: Step, discount: float, loss: float) -> np.ndarray:
    """Let the mirrors see a step: weigh them by the proposal, then let them learn its outcome.

    Args:
        mirrors: changed in place.
        step: what happened.
        discount: gamma of the task.
        loss: what an episode may lose, in reward units.

    Returns:
        float64 [K], the probability of each mirror, the proposal included.
    """
    shares = _weigh(mirrors, step, loss)
    future = 0.0 if step.events & TERMINATED else discount
    target = step.reward + future * mirrors.best[step.next_state]
    if step.proposed == step.executed:
        _rehearse(mirrors, step.state, step.proposed, target, 0, MIRRORS)
    else:
        _rehearse(mirrors, step.state, step.proposed, target, 0, _TRANSITION)
        _rehearse(mirrors, step.state, step.executed, target, _TRANSITION, _OBSERVANT)
    return shares


@compiled
def transition_rate(shares: np.ndarray) -> float:
    """Expected learning rate from an override, of mirrors that take it for their own doing."""
    total = 0.0
    for k in range(_TRANSITION):
        total += shares[k] * _RATES[k]
    return total


@compiled
def observant_share(shares: np.ndarray) -> float:
    """Probability that the learner credits what was executed."""
    return shares[_TRANSITION:_OBSERVANT].sum()


@compiled
def misled_value(mirrors: Mirrors, shares: np.ndarray, state: int) -> float:
    """What a state is worth to a transition learner, times the probability that it is one."""
    total = 0.0
    for k in range(_TRANSITION):
        total += shares[k] * mirrors.best[state, k]
    return total


@compiled
def transition_share(shares: np.ndarray) -> float:
    """Probability that the learner takes overrides for its own doing."""
    return shares[:_TRANSITION].sum()


@compiled
def _arrivals(shares: np.ndarray) -> np.ndarray:
    """Share of the learners now at a rate who were at the rate below, the same, the one above.

    float64 [3, K]; the columns sum to 1.
    """
    found = np.zeros((3, MIRRORS))
    for k in range(MIRRORS):
        place = k % _PER_PERCEPTION
        lowest, highest = place == 0, place == _PER_PERCEPTION - 1
        stays = 1 - _CHANGE / 2 if lowest or highest else 1 - _CHANGE
        found[1, k] = stays * shares[k]
        if not lowest:
            found[0, k] = _CHANGE / 2 * shares[k - 1]
        if not highest:
            found[2, k] = _CHANGE / 2 * shares[k + 1]
        total = found[0, k] + found[1, k] + found[2, k]
        for neighbour in range(3):
            found[neighbour, k] /= total
    return found


@compiled
def _mix(row: np.ndarray, parts: np.ndarray) -> None:
    """Mix the numbers [K] of neighbouring mirrors in place, with the parts [3, K] of `_arrivals`."""
    below = row[0]
    for k in range(MIRRORS):
        own, above = row[k], row[min(k + 1, MIRRORS - 1)]
        row[k] = parts[0, k] * below + parts[1, k] * own + parts[2, k] * above
        below = own


@compiled
def between_episodes(mirrors: Mirrors) -> None:
    """Allow for a learning rate that changes from episode to episode: neighbouring mirrors mix."""
    values, best, weights = mirrors
    parts = _arrivals(weights.sum(axis=0).sum(axis=0))
    for state in range(values.shape[0]):
        for action in range(values.shape[1]):
            _mix(values[state, action], parts)
        for k in range(MIRRORS):
            best[state, k] = values[state, :, k].max()
    leaving = _arrivals(np.ones(MIRRORS))
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            _mix(weights[tau, way], leaving)
