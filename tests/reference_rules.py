"""Rules a second time: plain Python, written from the papers, one list after the other."""

import collections
import inspect
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


def hard_bumpers(situation, noise, alpha, v_min=0.0, second=False):
    values, proposed = list(situation.values), situation.proposed
    candidate = replacement_value(values, second)
    allowed = alpha * (situation.start_value - v_min)
    lost = situation.start_value - (situation.earned + situation.discount * values[proposed])
    if values[proposed] >= candidate or lost <= allowed:
        return proposed, 0.0
    return one_of(values, candidate, noise.tie), 1.0


def random_override(situation, noise, probability, second=False):
    values = list(situation.values)
    candidate = replacement_value(values, second)
    if values[situation.proposed] >= candidate:
        return situation.proposed, 0.0
    replacement = one_of(values, candidate, noise.tie)
    return (replacement if noise.coin < probability else situation.proposed), probability


def expert_mixing(situation, noise, share=1.0, decay=0.9):
    return random_override(situation, noise, share * decay**situation.episode)


def shield(situation, noise, threshold):
    safety, values = list(situation.others[0]), list(situation.values)
    if safety[situation.proposed] >= threshold or safety[situation.proposed] == max(safety):
        return situation.proposed, 0.0
    safe = [value for value, chance in zip(values, safety, strict=True) if chance >= threshold]
    if not safe:
        return one_of(safety, max(safety), noise.tie), 1.0
    masked = [v if s >= threshold else None for v, s in zip(values, safety, strict=True)]
    return one_of(masked, max(safe), noise.tie), 1.0


def better_for_all_goals(situation, noise):
    """The best on average of the actions that beat the proposal in every row."""
    rows, values = [list(row) for row in situation.others], list(situation.values)
    better = [
        all(row[action] > row[situation.proposed] for row in rows) for action in range(len(values))
    ]
    if not any(better):
        return situation.proposed, 0.0
    masked = [value if allowed else None for value, allowed in zip(values, better, strict=True)]
    return one_of(masked, max(v for v in masked if v is not None), noise.tie), 1.0


def undo(situation, noise, tolerance=0.0):
    mistake = max(situation.values) - situation.values[situation.proposed] > tolerance
    return situation.proposed, float(mistake), mistake


def correct(situation, noise, tolerance=0.0):
    values = list(situation.values)
    if max(values) - values[situation.proposed] > tolerance:
        return one_of(values, max(values), noise.tie), 1.0
    return situation.proposed, 0.0


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
    "hard-bumpers": hard_bumpers,
    "random-override": random_override,
    "expert-mixing": expert_mixing,
    "shield": shield,
    "better-for-all-goals": better_for_all_goals,
    "undo": undo,
    "correct": correct,
    "take-back": take_back,
}


def overrides(decision, situation):
    """Whether a decision (action, probability[, undo]) is one."""
    return decision[0] != situation.proposed or True in decision[2:]


class PlainRule:
    """A rule with its options; it never remembers anything."""

    def __init__(self, name, **options):
        self.name, self.options = name, options

    def decide(self, situation, noise):
        return RULES[self.name](situation, noise, **self.options)

    def observe(self, step):
        pass


class PlainBudget:
    """Another rule, until it has overridden so often: in an episode, in all, or of all steps."""

    def __init__(
        self,
        of: dict[str, Any],
        per_episode=None,
        in_all=None,
        share: float | None = None,
        task=None,
    ):
        self.of = plain_rule(task=task, **of)
        self.limits, self.share = (per_episode, in_all), share
        self.spent, self.steps = collections.Counter(), 0

    def exhausted(self, episode):
        so_far = (self.spent[episode], self.spent.total())
        limits = zip(so_far, self.limits, strict=True)
        if any(limit is not None and spent >= limit for spent, limit in limits):
            return True
        return self.share is not None and so_far[1] + 1 > self.share * (self.steps + 1)

    def decide(self, situation, noise):
        decision = self.of.decide(situation, noise)
        if overrides(decision, situation) and self.exhausted(situation.episode):
            return situation.proposed, 0.0
        return decision

    def observe(self, step):
        self.of.observe(step)
        self.steps += 1
        self.spent[step.episode] += step.executed != step.proposed or step.undone


class PlainFading:
    """A share of another rule's overrides that halves."""

    def __init__(self, of: dict[str, Any], half_life: float, task=None):
        self.of, self.half_life = plain_rule(task=task, **of), half_life

    def decide(self, situation, noise):
        decision = self.of.decide(situation, noise)
        probability = decision[1] * 0.5 ** (situation.episode / self.half_life)
        if overrides(decision, situation) and noise.coin >= probability:
            return situation.proposed, probability
        return (decision[0], probability, *decision[2:])

    def observe(self, step):
        self.of.observe(step)


class PlainHysteresis:
    """Another rule that goes on until its last steps were calm."""

    def __init__(self, of: dict[str, Any], calm: int, task=None):
        self.of, self.calm, self.last = plain_rule(task=task, **of), calm, []

    def decide(self, situation, noise):
        decision = self.of.decide(situation, noise)
        values, proposed = list(situation.values), situation.proposed
        lately = [happened for episode, happened in self.last if episode == situation.episode]
        if not any(lately[-self.calm :]) or values[proposed] == max(values):
            return decision
        if overrides(decision, situation):
            return (decision[0], 1.0, *decision[2:])
        return one_of(values, max(values), noise.tie), 1.0

    def observe(self, step):
        self.of.observe(step)
        self.last.append((step.episode, step.executed != step.proposed or step.undone))


class PlainClosestAcceptable:
    """The nearest of the actions within a share of the range."""

    def __init__(self, alpha: float, task):
        self.alpha, self.distance = alpha, np.asarray(task.action_distance).tolist()

    def decide(self, situation, noise):
        values, proposed = list(situation.values), situation.proposed
        least = max(values) - min(values)
        fine = [a for a, v in enumerate(values) if v - min(values) >= (1 - self.alpha) * least]
        if proposed in fine:
            return proposed, 0.0
        nearest = min(self.distance[proposed][a] for a in fine)
        near = [a for a in fine if self.distance[proposed][a] == nearest]
        best = [a for a in near if values[a] == max(values[b] for b in near)]
        return best[int(noise.tie * len(best))], 1.0

    def observe(self, step):
        pass


class PlainClosestAcceptableUnknownGoal(PlainClosestAcceptable):
    """The same by the row of the proposal."""

    def decide(self, situation, noise):
        row = situation.others[situation.proposed]
        return super().decide(situation._replace(values=row), noise)


class PlainAcceptOrReject:
    """Nothing in place of what is worse than nothing."""

    def __init__(self, task, tolerance: float = 0.0):
        self.no_op, self.tolerance = task.no_op, tolerance

    def decide(self, situation, noise):
        gain = situation.values[situation.proposed] - situation.values[self.no_op]
        return (situation.proposed, 0.0) if gain >= -self.tolerance else (self.no_op, 1.0)

    def observe(self, step):
        pass


class PlainTrajectoryBumpers:
    """Actions that cannot lead too far from a path."""

    def __init__(self, path, reach: int, task):
        self.reach, self.next_states = reach, {}
        for s, a in np.ndindex(task.states, task.actions):
            outcomes = zip(task.next_state[s, a], task.probability[s, a], strict=True)
            self.next_states[s, a] = {int(to) for to, chance in outcomes if chance > 0}
        self.near = set(path)  # grown backwards by one step, `reach` times
        for _ in range(reach):
            self.near |= {s for (s, _), to in self.next_states.items() if to & self.near}

    def decide(self, situation, noise):
        values, proposed = list(situation.values), situation.proposed
        leads = [self.next_states[situation.state, action] for action in range(len(values))]
        fine = [action for action, states in enumerate(leads) if states <= self.near]
        allowed = fine or list(range(len(values)))
        best = [a for a in allowed if values[a] == max(values[b] for b in allowed)]
        if proposed in fine or proposed in best:
            return proposed, 0.0
        return best[int(noise.tie * len(best))], 1.0

    def observe(self, step):
        pass


class PlainAdvice:
    """Advice while a budget lasts."""

    def __init__(self, when, budget, every=2, threshold=0.0, sure=0.5):
        self.when, self.left, self.every = when, budget, every
        self.threshold, self.sure = threshold, sure
        self.history = []  # (state, proposed, whether it was a mistake)

    def advises(self, state, values, proposed):
        if self.left == 0:
            return False
        if self.when in ("early", "alternating"):
            return self.when == "early" or len(self.history) % self.every == 0
        here = [(action, mistake) for at, action, mistake in self.history if at == state]
        often = collections.Counter(action for action, _ in here).most_common(1)
        asked = {
            "importance": True,
            "mistakes": values[proposed] < max(values),
            "predictive": bool(here) and here[-1][1],
            "jointly": not often or often[0][1] < self.sure * len(here),
        }
        return max(values) - min(values) > self.threshold and asked[self.when]

    def decide(self, situation, noise):
        values, proposed = list(situation.values), situation.proposed
        if values[proposed] == max(values) or not self.advises(situation.state, values, proposed):
            return proposed, 0.0
        return one_of(values, max(values), noise.tie), 1.0

    def observe(self, step):
        values = list(step.values)
        self.left -= self.advises(step.state, values, step.proposed)
        mistake = values[step.proposed] < max(values)
        self.history.append((step.state, step.proposed, mistake))


class PlainPenalised:
    """Overrides that are worth their price."""

    def __init__(self, target, rate=0.01, price=0.0):
        self.target, self.rate, self.price = target, rate, price

    def decide(self, situation, noise):
        values = list(situation.values)
        if max(values) - values[situation.proposed] > self.price:
            return one_of(values, max(values), noise.tie), 1.0
        return situation.proposed, 0.0

    def observe(self, step):
        overridden = step.executed != step.proposed or step.undone
        self.price = max(0.0, self.price - self.rate * (self.target - overridden))


class PlainAssistAsNeeded:
    """Strength that follows the errors of episodes."""

    def __init__(self, forgetting, gain, task, dead_band=0.0, v_min=0.0):
        self.forgetting, self.gain, self.dead_band = forgetting, gain, dead_band
        self.v_min, self.discount = v_min, task.discount
        self.strength, self.rewards, self.start_value = 0.0, [], 0.0

    def decide(self, situation, noise):
        return random_override(situation, noise, self.strength)

    def observe(self, step):
        if not self.rewards:
            self.start_value = max(step.values)
        self.rewards.append(step.reward)
        if not step.events & (1 | 8 | 16):
            return
        earned, weight = 0.0, 1.0
        for reward in self.rewards:
            earned, weight = earned + weight * reward, weight * self.discount
        error = (self.start_value - earned) / (self.start_value - self.v_min) - self.dead_band
        self.strength = self.forgetting * self.strength + self.gain * max(0.0, error)
        self.strength, self.rewards = min(1.0, self.strength), []


class PlainRiskAndNovelty:
    """Overrides of what is new or risky, and of more once it has begun."""

    def __init__(self, visits, risk, release):
        self.visits, self.risk, self.release = visits, risk, release
        self.visited, self.before = collections.Counter(), None

    def decide(self, situation, noise):
        values, proposed = list(situation.values), situation.proposed
        limit = self.release if self.before == situation.episode else self.risk
        new = self.visited[situation.state] < self.visits
        if values[proposed] < max(values) and (new or 1 - situation.others[0][proposed] > limit):
            return one_of(values, max(values), noise.tie), 1.0
        return proposed, 0.0

    def observe(self, step):
        self.visited[step.state] += 1
        overridden = step.executed != step.proposed or step.undone
        self.before = step.episode if overridden else None


class PlainSigns:
    """An own rule of the tests: half of its actions follow from the states that it is told."""

    def __init__(self):
        self.told = 0

    def decide(self, situation, noise):
        action = (situation.state + self.told) % len(situation.values)
        return (action if noise.coin < 0.5 else situation.proposed), 0.5

    def observe(self, step):
        self.told = 3 * step.state + 5 * step.next_state


WITH_MEMORY: dict[str, Any] = {
    "budget": PlainBudget,
    "fading": PlainFading,
    "hysteresis": PlainHysteresis,
    "closest-acceptable": PlainClosestAcceptable,
    "closest-acceptable-unknown-goal": PlainClosestAcceptableUnknownGoal,
    "accept-or-reject": PlainAcceptOrReject,
    "trajectory-bumpers": PlainTrajectoryBumpers,
    "assist-as-needed": PlainAssistAsNeeded,
    "advice-on-a-budget": PlainAdvice,
    "penalised-interventions": PlainPenalised,
    "risk-and-novelty": PlainRiskAndNovelty,
    "signs": PlainSigns,
}


def plain_rule(name, task=None, **options):
    """The plain form of an assistant, as a file would describe it; some know the task."""
    # Not above: that module takes from this one what the rules have in common.
    from tests import reference_learner_aware as aware

    if name == "learner-aware-bumpers":
        return aware.PlainLearnerAware(**options, task=task)
    if name == "model-free-learner-aware-bumpers":
        return aware.PlainModelFreeLearnerAware(**options, task=task)
    if name not in WITH_MEMORY:
        return PlainRule(name, **options)
    kind = WITH_MEMORY[name]
    knows = "task" in inspect.signature(kind).parameters
    return kind(**options, **({"task": task} if knows else {}))
