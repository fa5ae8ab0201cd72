"""Mirrors of a learner: copies of what it may have learned, and how likely each copy is.

Nobody tells the assistant how a learner reads overrides, how fast it learns or how much it
explores. So it keeps one table of action values M_k, a *mirror*, per hypothesis k, a perception and
a learning rate, and lets each learn from the same steps as the learner,

    M_k(s, c) <- M_k(s, c) + rate_k (r + gamma (1 - terminal) max_b M_k(s', b) - M_k(s, c)),

where c is the proposed action if k takes overrides for its own doing ("transition"), the executed
one if it notices them ("observant"), and nothing is learned from an override if it is taken for an
interruption. A filter weighs every mirror together with a way to choose: greedy but for near ties
that a temperature tau blurs, and a random action with probability epsilon,

    P(a | k, tau, epsilon) = (1 - epsilon) g_tau(a) / sum of g_tau(b) over b + epsilon / A,
    g_tau(a) = max(0, 1 - (max_b M_k(s, b) - M_k(s, a)) / (8 tau))^8,

which is a softmax nearly, but without an exponential: it takes less time, and is the same to the
bit everywhere.
"""

from typing import NamedTuple

import numpy as np

from qbumpers.borrowing import scratch
from qbumpers.compilation import compiled
from qbumpers.decisions import Step
from qbumpers.tasks.dynamics import TERMINATED

PERCEPTIONS = ("transition", "observant", "interruption")
"""What an override may be to a learner, in the order of the mirrors."""

_PRIOR = np.array([0.98, 0.01, 0.01])
# Others soon show themselves, while a transition learner that is taken for another is harmed.

_RATES = np.array([0.02, 0.1, 0.3, 0.6, 1.0])
_TEMPERATURES = np.array([0.0, 0.003, 0.03])  # shares of what an episode may lose
_EPSILONS = np.array([0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0])

_PER_PERCEPTION = len(_RATES)
_TRANSITION, _OBSERVANT = len(_RATES), 2 * len(_RATES)  # where the mirrors of each end
MIRRORS = len(PERCEPTIONS) * len(_RATES)
_WAYS = len(_TEMPERATURES) * len(_EPSILONS)

LEARNS = 0.1
"""Expected learning rate below which a learner hardly learns any more."""

_DRIFT_WITHIN, _DRIFT_BETWEEN = 1e-3, 1e-6  # per step: how fast a learner's ways may change
_NEGLIGIBLE = 1e-3  # probability of a mirror that need not be looked at
_CHANGE = 0.1  # per episode: probability that the learning rate has become a neighbouring one


class Mirrors(NamedTuple):
    """What a learner may have learned, by K hypotheses; those of one perception lie together.

    Attributes:
        values: float64 [S, A, K], their action values, in reward units.
        best: float64 [S, K], the largest of them in a state.
        visited: bool [S], whether anything was learned in a state.
        weights: float64 [B, E, K], probabilities of temperature, epsilon and mirror; sum to 1.
    """

    values: np.ndarray
    best: np.ndarray
    visited: np.ndarray
    weights: np.ndarray


class Reading(NamedTuple):
    """What a proposal says of the learner.

    Attributes:
        shares: float64 [K], probability of each mirror, the proposal included; sums to 1.
        unaware: probability that it is a transition learner's.
        rate: expected learning rate.
    """

    shares: np.ndarray
    unaware: float
    rate: float


@compiled
def _sum(numbers: np.ndarray, first: int, end: int) -> float:
    """Sum of some of the numbers [K], one after the other: NumPy's own order of sums differs."""
    total = 0.0
    for k in range(first, end):
        total += numbers[k]
    return total


@compiled
def expected_rate(shares: np.ndarray) -> float:
    """Learning rate to expect by the probabilities [K] of the mirrors."""
    total = 0.0
    for k in range(MIRRORS):
        total += shares[k] * _RATES[k % _PER_PERCEPTION]
    return total


@compiled
def blank_mirrors(states: int, actions: int) -> Mirrors:
    """Mirrors of a learner that knows nothing yet, every rate and way to choose equally likely."""
    weights = np.empty((len(_TEMPERATURES), len(_EPSILONS), MIRRORS))
    for k in range(MIRRORS):
        weights[:, :, k] = _PRIOR[k // _PER_PERCEPTION] / (_PER_PERCEPTION * _WAYS)
    values, best = np.zeros((states, actions, MIRRORS)), np.zeros((states, MIRRORS))
    return Mirrors(values, best, np.zeros(states, np.bool_), weights)


@compiled
def _closeness(gap: float, per_gap: float) -> float:
    """g, from how far a value falls short and 1 / (8 tau): 1 at no gap, 0 at 8 temperatures."""
    near = max(0.0, 1 - gap * per_gap)
    near *= near
    near *= near
    return near * near


@compiled
def _find_choices(
    mirrors: Mirrors, state: int, action: int, loss: float, found: np.ndarray
) -> None:
    """Probability that each mirror means an action, by temperature.

    Args:
        mirrors: what the learner may believe.
        state: where it chooses.
        action: what it chooses.
        loss: what an episode may lose, in reward units; temperatures are shares of it.
        found: float64 [B, K], zeros that are overwritten.
    """
    values, best, count = mirrors.values, mirrors.best, mirrors.best.shape[1]
    own = scratch((len(_TEMPERATURES), MIRRORS), 0.0)
    # Mirrors are innermost, and counted at run time: so the compiler takes several at once.
    for other in range(values.shape[1]):
        for k in range(count):
            found[0, k] += values[state, other, k] == best[state, k]
    for k in range(count):
        own[0, k] = values[state, action, k] == best[state, k]
    for tau in range(1, len(_TEMPERATURES)):
        per_gap = 1 / (8 * _TEMPERATURES[tau] * loss)
        for other in range(values.shape[1]):
            for k in range(count):
                found[tau, k] += _closeness(best[state, k] - values[state, other, k], per_gap)
        for k in range(count):
            own[tau, k] = _closeness(best[state, k] - values[state, action, k], per_gap)
    for tau in range(len(_TEMPERATURES)):
        for k in range(count):
            found[tau, k] = own[tau, k] / found[tau, k]


@compiled
def read(mirrors: Mirrors, state: int, action: int, loss: float) -> Reading:
    """What a proposal says of the learner.

    Args:
        mirrors: of the learner, before the proposal.
        state: where it was proposed.
        action: the proposal.
        loss: what an episode may lose, in reward units.
    """
    chances, weights = scratch((len(_TEMPERATURES), MIRRORS), 0.0), mirrors.weights
    _find_choices(mirrors, state, action, loss, chances)
    count, shares = weights.shape[2], scratch(MIRRORS, 0.0)
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            random = _EPSILONS[way] / mirrors.values.shape[1]
            for k in range(count):
                shares[k] += weights[tau, way, k] * (
                    (1 - _EPSILONS[way]) * chances[tau, k] + random
                )
    total = _sum(shares, 0, MIRRORS)
    for k in range(MIRRORS):
        shares[k] /= total
    return Reading(shares, _sum(shares, 0, _TRANSITION), expected_rate(shares))


@compiled
def _weigh(mirrors: Mirrors, step: Step, loss: float) -> None:
    """Change the weights by a proposal, and let them drift.

    How a learner takes overrides shows in what it learns from them: those of the perceptions stay
    if it hardly learns.
    """
    chances, weights = scratch((len(_TEMPERATURES), MIRRORS), 0.0), mirrors.weights
    _find_choices(mirrors, step.state, step.proposed, loss, chances)
    count = weights.shape[2]
    before, after = scratch(MIRRORS, 0.0), scratch(MIRRORS, 0.0)
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            random = _EPSILONS[way] / mirrors.values.shape[1]
            for k in range(count):
                before[k] += weights[tau, way, k]
                weights[tau, way, k] *= (1 - _EPSILONS[way]) * chances[tau, k] + random
                after[k] += weights[tau, way, k]
    kept, fresh = scratch(MIRRORS, 0.0), scratch(MIRRORS, 0.0)
    learns, total = expected_rate(before) >= LEARNS, _sum(after, 0, MIRRORS)
    for k in range(count):
        first = k - k % _PER_PERCEPTION
        found = _sum(after, first, first + _PER_PERCEPTION)
        held = found / total if learns else _sum(before, first, first + _PER_PERCEPTION)
        kept[k] = (1 - _DRIFT_WITHIN - _DRIFT_BETWEEN) * held / found
        fresh[k] = (_DRIFT_WITHIN * held / _PER_PERCEPTION + _DRIFT_BETWEEN / MIRRORS) / _WAYS
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            for k in range(count):
                weights[tau, way, k] = kept[k] * weights[tau, way, k] + fresh[k]


@compiled
def _find_best(mirrors: Mirrors, state: int) -> None:
    """Put the largest values of a state into `best`."""
    values, best, count = mirrors.values, mirrors.best, mirrors.best.shape[1]
    for k in range(count):
        best[state, k] = values[state, 0, k]
    for action in range(1, values.shape[1]):
        for k in range(count):
            best[state, k] = max(best[state, k], values[state, action, k])


@compiled
def _rehearse(
    mirrors: Mirrors, state: int, action: int, target: np.ndarray, first: int, end: int
) -> None:
    """Let the mirrors from `first` to `end` learn `target` [K] of an action."""
    values = mirrors.values
    mirrors.visited[state] = True
    for k in range(first, end):
        rate = _RATES[k % _PER_PERCEPTION]
        values[state, action, k] += rate * (target[k] - values[state, action, k])
    _find_best(mirrors, state)


@compiled
def reflect(mirrors: Mirrors, step: Step, discount: float, loss: float) -> None:
    """Let the mirrors see a step: weigh them by the proposal, then let them learn its outcome.

    Args:
        mirrors: changed in place.
        step: what happened.
        discount: gamma of the task.
        loss: what an episode may lose, in reward units.
    """
    _weigh(mirrors, step, loss)
    future = 0.0 if step.events & TERMINATED else discount
    target = scratch(MIRRORS, 0.0)
    for k in range(MIRRORS):
        target[k] = step.reward + future * mirrors.best[step.next_state, k]
    if step.proposed == step.executed:
        _rehearse(mirrors, step.state, step.proposed, target, 0, MIRRORS)
    else:
        _rehearse(mirrors, step.state, step.proposed, target, 0, _TRANSITION)
        _rehearse(mirrors, step.state, step.executed, target, _TRANSITION, _OBSERVANT)


@compiled
def misled_credit(shares: np.ndarray, target: np.ndarray) -> float:
    """What a transition learner credits its own action with, times the probability that it is one.

    Args:
        shares: float64 [K], probabilities of the mirrors.
        target: float64 [K], what the executed action is worth to each.
    """
    total = 0.0
    for k in range(_TRANSITION):
        total += shares[k] * target[k]
    return total


@compiled
def lasting_harm(
    mirrors: Mirrors, shares: np.ndarray, state: int, proposed: int, executed: int,
    target: np.ndarray, harms: np.ndarray, loss: float,
) -> float:  # fmt: skip
    """What the learner's own choices in a state will cost once it has learned from a step.

    It chooses by what it then believes, blurred by the largest temperature, for as long as the
    lesson lasts: 1 / rate updates.

    Args:
        mirrors: before the step.
        shares: float64 [K], their probabilities.
        state: where the step begins.
        proposed: the learner's action.
        executed: the assistant's.
        target: float64 [K], what the executed action is worth to each mirror.
        harms: float64 [A], what each choice costs.
        loss: what an episode may lose, in reward units.
    """
    values, total = mirrors.values, 0.0
    per_gap = 1 / (8 * _TEMPERATURES[-1] * loss)
    for k in range(MIRRORS):
        if shares[k] < _NEGLIGIBLE:
            continue
        rate = _RATES[k % _PER_PERCEPTION]
        credited = proposed if k < _TRANSITION or proposed == executed else executed
        learned = rate if k < _OBSERVANT or proposed == executed else 0.0
        old = values[state, credited, k]
        new = old + learned * (target[k] - old)
        highest = new
        for action in range(len(harms)):
            if action != credited:
                highest = max(highest, values[state, action, k])
        chosen = harm = 0.0
        for action in range(len(harms)):
            value = new if action == credited else values[state, action, k]
            chance = _closeness(highest - value, per_gap)
            chosen += chance
            harm += chance * harms[action]
        total += shares[k] / rate * harm / chosen
    return total


@compiled
def _find_arrivals(shares: np.ndarray, found: np.ndarray) -> None:
    """Share of the learners now at a rate who were at the rate below, the same, the one above.

    Args:
        shares: float64 [K], how many learners were at each rate.
        found: float64 [3, K], zeros that are overwritten; the columns then sum to 1.
    """
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


@compiled
def _mix(row: np.ndarray, parts: np.ndarray, padded: np.ndarray) -> None:
    """Mix the numbers [K] of neighbouring mirrors in place.

    Args:
        row: the numbers.
        parts: float64 [3, K], from `_find_arrivals`.
        padded: float64 [K + 2], overwritten but for its ends.
    """
    for k in range(len(row)):
        padded[k + 1] = row[k]
    for k in range(len(row)):
        below, own, above = padded[k], padded[k + 1], padded[k + 2]
        row[k] = parts[0, k] * below + parts[1, k] * own + parts[2, k] * above


@compiled
def between_episodes(mirrors: Mirrors) -> None:
    """Allow for a learning rate that changes from episode to episode: neighbouring mirrors mix."""
    values, weights = mirrors.values, mirrors.weights
    shares, padded = scratch(MIRRORS, 0.0), scratch(MIRRORS + 2, 0.0)
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            for k in range(MIRRORS):
                shares[k] += weights[tau, way, k]
    parts = scratch((3, MIRRORS), 0.0)
    _find_arrivals(shares, parts)
    for state in range(values.shape[0]):
        if mirrors.visited[state]:
            for action in range(values.shape[1]):
                _mix(values[state, action], parts, padded)
            _find_best(mirrors, state)
    leaving = scratch((3, MIRRORS), 0.0)
    _find_arrivals(scratch(MIRRORS, 1.0), leaving)
    for tau in range(len(_TEMPERATURES)):
        for way in range(len(_EPSILONS)):
            _mix(weights[tau, way], leaving, padded)
