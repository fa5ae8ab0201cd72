"""Learners of tables a second time, as their sources write them: plain Python, number by number.

Of the package they know only the settings. `ReferenceTrial` of `tests.reference_simulation` lets
them learn in whole trials, beside the compiled ones.
"""

import itertools
import math

from tests.reference_rules import one_of


class Table:
    """Rows of values, to be gone through by (state, action)."""

    def __init__(self, rows):
        self.rows = rows

    def items(self):
        return [((s, a), value) for s, own in enumerate(self.rows) for a, value in enumerate(own)]

    def __setitem__(self, place, value):
        state, action = place
        self.rows[state][action] = value


class Learner:
    """What the learners below have in common: epsilon-greedy choices by `wanted`."""

    def __init__(self, settings, states, actions):
        self.settings, self.states, self.actions = settings, range(states), range(actions)
        self.epsilon = 0.0
        self.q = self.table(getattr(settings, "initial_value", 0.0))

    def table(self, value):
        return {(s, a): float(value) for s in self.states for a in self.actions}

    def begin(self, rate_of):
        """Before an episode; `rate_of` gives the number of a schedule."""
        self.epsilon = rate_of(self.settings.epsilon)

    def wanted(self, state):
        """What the learner thinks of the actions in a state: the largest is the best."""
        return [self.q[state, action] for action in self.actions]

    def choose(self, state, generator):
        coin, tie = generator.random(), generator.random()
        if coin < self.epsilon:
            return int(tie * len(self.actions))
        return one_of(self.wanted(state), max(self.wanted(state)), tie)

    def future(self, next_state, ended):
        return 0.0 if ended else self.settings.discount * max(self.wanted(next_state))

    def remembered(self):
        """Everything that can be forgotten, as (dictionary by (state, action, ...), its origin)."""
        return [(self.q, getattr(self.settings, "initial_value", 0.0))]


def softly(exponents, generator):
    """An action with probability in proportion to the exponential of its number."""
    weights = [math.exp(exponent) for exponent in exponents]
    chance = generator.random() * sum(weights)
    sums = list(itertools.accumulate(weights))
    return next((action for action, total in enumerate(sums) if chance < total), len(sums) - 1)


class SoftmaxQLearner(Learner):
    def __init__(self, *given):
        super().__init__(*given)
        self.last = {}

    def begin(self, rate_of):
        self.rate = rate_of(self.settings.learning_rate)

    def choose(self, state, generator):
        beta, kappa = self.settings.inverse_temperature, self.settings.perseveration
        values = self.wanted(state)
        return softly(
            [
                beta * (value - max(values)) + kappa * (self.last.get(state) == action)
                for action, value in enumerate(values)
            ],
            generator,
        )

    def learn(self, state, action, reward, next_state, ended):
        target = reward + self.future(next_state, ended)
        for other in set(self.actions) - {action}:
            lost = self.settings.unchosen_decay * (
                self.settings.initial_value - self.q[state, other]
            )
            self.q[state, other] += lost
        self.q[state, action] += self.rate * (target - self.q[state, action])
        self.last[state] = action


class ActorCritic(Learner):
    def __init__(self, *given):
        super().__init__(*given)
        self.q = self.table(0.0)  # the preferences
        self.v = {(state,): float(self.settings.initial_value) for state in self.states}
        self.so_far = 1.0

    def begin(self, rate_of):
        self.actor = rate_of(self.settings.actor_rate)
        self.critic = rate_of(self.settings.critic_rate)
        self.so_far = 1.0

    def choose(self, state, generator):
        preferences = self.wanted(state)
        return softly([p - max(preferences) for p in preferences], generator)

    def learn(self, state, action, reward, next_state, ended):
        delta = reward - self.v[state,]
        if not ended:
            delta = reward + self.settings.discount * self.v[next_state,] - self.v[state,]
        self.v[state,] += self.critic * delta
        preferences = self.wanted(state)
        weights = [math.exp(p - max(preferences)) for p in preferences]
        for b in self.actions:
            gradient = (b == action) - weights[b] / sum(weights)
            self.q[state, b] += self.actor * self.so_far * delta * gradient
        self.so_far *= self.settings.discount

    def remembered(self):
        return [(self.q, 0.0), (self.v, self.settings.initial_value)]


class ModelBased(Learner):
    """Forgets no outcome: for tasks with no more of them than it may remember."""

    def __init__(self, *given):
        super().__init__(*given)
        self.tried, self.turn = [], 0
        self.trials, self.rewards, self.led = self.table(0.0), self.table(0.0), {}

    def learn(self, state, action, reward, next_state, ended):
        pair = state, action
        if pair not in self.tried:
            self.tried.append(pair)
        self.trials[pair] += 1
        self.rewards[pair] += reward
        where = (state, action, None if ended else next_state)
        self.led[where] = self.led.get(where, 0.0) + 1
        self.plan(pair)
        for _ in range(min(self.settings.backups, len(self.tried))):
            self.turn = (self.turn or len(self.tried)) - 1
            self.plan(self.tried[self.turn])

    def plan(self, pair):
        outcomes = {end: n for (s, a, end), n in self.led.items() if (s, a) == pair}
        if sum(outcomes.values()) == 0:
            return
        worth = 0.0
        for end, times in outcomes.items():
            if end is not None:
                worth += times * max(self.wanted(end))
        mean = self.rewards[pair] / self.trials[pair]
        self.q[pair] = mean + self.settings.discount * (worth / sum(outcomes.values()))

    def remembered(self):
        return [*super().remembered(), (self.trials, 0.0), (self.rewards, 0.0), (self.led, 0.0)]


class Imitator(Learner):
    """What it thinks of an action is how often it saw it."""

    def learn(self, state, action, reward, next_state, ended):
        self.q[state, action] += 1


class TwoRate(Learner):
    def __init__(self, *given):
        super().__init__(*given)
        self.fast, self.slow = self.table(0.0), self.table(0.0)

    def wanted(self, state):
        return [self.fast[state, action] + self.slow[state, action] for action in self.actions]

    def learn(self, state, action, reward, next_state, ended):
        pair, s = (state, action), self.settings
        error = reward + self.future(next_state, ended) - self.wanted(state)[action]
        self.fast[pair] = s.fast_retention * self.fast[pair] + s.fast_learning * error
        self.slow[pair] = s.slow_retention * self.slow[pair] + s.slow_learning * error

    def remembered(self):
        return [(self.fast, 0.0), (self.slow, 0.0)]


LEARNERS = {
    kind.__name__: kind for kind in (SoftmaxQLearner, ActorCritic, ModelBased, Imitator, TwoRate)
}
