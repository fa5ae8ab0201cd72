"""Rules a second time: plain Python, written from Algorithm 1 and Section 4 of the paper."""

import collections
from typing import Any

import numpy as np


def replacement_value(values, second):
    """Value of `AgentAction`."""
    worse = [value for value in values if value < max(values)]
    return max(worse) if second and worse else max(values)


def one_of(values, target, tie):
    """The action that `tie` in [0, 1) chooses among those of value `target`."""
    equal = [action for action, value in enumerate(values) if value == target]
    return equal[int(tie * len(equal))]


def none(situation, noise):
    return situation.proposed, 0.0


def maximal(situation, noise):
    values = list(situation.values)
    if values[situation.proposed] == max(values):
        return situation.proposed, 0.0
    return one_of(values, max(values), noise.tie), 1.0


def local_q_thresholding(situation, noise, alpha, second=False):
    values = list(situation.values)
    candidate = replacement_value(values, second)
    shifted = [value - min(values) for value in values]
    allowed = shifted[situation.proposed] >= (1 - alpha) * max(shifted)
    if allowed or values[situation.proposed] >= candidate:
        return situation.proposed, 0.0
    return one_of(values, candidate, noise.tie), 1.0


def logistic(ratio, p_max):
    """f as odds: those of p_max at 1, their inverse at 0, geometric in between."""
    with np.errstate(over="ignore"):
        odds_against = np.float64((1 - p_max) / p_max) ** (2 * ratio - 1)
        return float(1 / (1 + odds_against))


def stochastic_q_bumpers(
    situation, noise, alpha, v_min=0.0, p_max=0.999, second=False, escalate=True, clip=True
):
    values, proposed = list(situation.values), situation.proposed
    earned, discount, start_value = situation.earned, situation.discount, situation.start_value
    candidate = replacement_value(values, second)
    if values[proposed] >= candidate:
        return proposed, 0.0
    lower_value = start_value - alpha * (start_value - v_min)
    if escalate and earned + discount * candidate <= lower_value:
        return one_of(values, max(values), noise.tie), 1.0
    if alpha == 0:
        probability = 1.0
    else:
        lost = start_value - (earned + discount * values[proposed])
        ratio = lost / (alpha * (start_value - v_min))
        certain = clip and not 0 < ratio < 1
        probability = float(ratio >= 1) if certain else logistic(ratio, p_max)
    overrides = noise.coin < probability
    return (one_of(values, candidate, noise.tie) if overrides else proposed), probability


def take_back(situation, noise, tolerance):
    """An own rule of the tests: half of the proposals that give up too much are undone."""
    values = list(situation.values)
    if values[situation.proposed] >= max(values) - tolerance:
        return situation.proposed, 0.0, False
    return situation.proposed, 0.5, noise.coin < 0.5


RULES = {
    "none": none,
    "maximal": maximal,
    "local-q-thresholding": local_q_thresholding,
    "stochastic-q-bumpers": stochastic_q_bumpers,
    "take-back": take_back,
}


class PlainRule:
    """A rule with its options; it never remembers anything."""

    def __init__(self, name, **options):
        self.name, self.options = name, options

    def decide(self, situation, noise):
        return RULES[self.name](situation, noise, **self.options)

    def observe(self, step):
        pass


class PlainBudget:
    """Another rule, until it has overridden so often in one episode."""

    def __init__(self, of: dict[str, Any], per_episode: int):
        self.of, self.per_episode = plain_rule(**of), per_episode
        self.spent = collections.Counter()

    def decide(self, situation, noise):
        decision = self.of.decide(situation, noise)
        if self.spent[situation.episode] < self.per_episode:
            return decision
        overrides = decision[0] != situation.proposed or True in decision[2:]
        return (situation.proposed, 0.0) if overrides else decision

    def observe(self, step):
        self.of.observe(step)
        self.spent[step.episode] += step.executed != step.proposed or step.undone


class PlainSigns:
    """An own rule of the tests: half of its actions follow from the states that it is told."""

    def __init__(self):
        self.told = 0

    def decide(self, situation, noise):
        action = (situation.state + self.told) % len(situation.values)
        return (action if noise.coin < 0.5 else situation.proposed), 0.5

    def observe(self, step):
        self.told = 3 * step.state + 5 * step.next_state


def plain_rule(name, **options):
    """The plain form of an assistant, as a file would describe it."""
    with_memory = {"budget": PlainBudget, "signs": PlainSigns}
    return with_memory[name](**options) if name in with_memory else PlainRule(name, **options)
