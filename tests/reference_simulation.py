"""Rules, learner and trial a second time: plain Python, one number after the other.

Written from Algorithm 1 and Section 4.2 of the paper, to be compared with the package. It takes
from the package only its containers of data (task, learner, situation) and the names of conditions.
"""

import hashlib
import json
from types import SimpleNamespace

import numpy as np

from qbumpers.decisions import Noise, Situation


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
    values, proposed, earned, discount, start_value = situation
    values = list(values)
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


RULES = {
    "none": none,
    "maximal": maximal,
    "local-q-thresholding": local_q_thresholding,
    "stochastic-q-bumpers": stochastic_q_bumpers,
}


class _Words(np.random.bit_generator.ISeedSequence):
    """Seed words that are handed to NumPy's generator as they are."""

    def __init__(self, words):
        self.words = words

    def generate_state(self, n_words, dtype=np.uint32):
        assert (n_words, dtype) == (len(self.words), np.uint64)
        return self.words


def seeded_bit_generators(seed, content, trial):
    """NumPy's SFC64 four times: exploration, override noise, transitions, the greedy episode."""
    philox = np.random.Philox(_seed_sequence(seed, content))
    return _four(philox.random_raw(12 * (trial + 1)))  # one after another up to this trial


def bit_generators_of_episode(seed, content, trial, episode):
    """The same four, begun anew: trials lie 2**64 blocks apart, episodes follow one another."""
    key = _seed_sequence(seed, content).generate_state(2, np.uint64)
    philox = np.random.Philox(key=key, counter=[0, trial, 0, 0])
    return _four(philox.random_raw(12 * (episode + 1)))


def _seed_sequence(seed, content):
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    digest = hashlib.sha256(text.encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4)]
    return np.random.SeedSequence([seed, *words])


def _four(drawn):
    state = drawn[-12:]
    return [np.random.SFC64(_Words(state[first : first + 3])) for first in (0, 3, 6, 9)]


def scheduled(schedule, episode, episodes):
    decaying = int(schedule.fraction * episodes)
    if episode >= decaying:
        return schedule.start + (schedule.end - schedule.start)
    return schedule.start + episode / decaying * (schedule.end - schedule.start)


def learned_from(perception, proposed, executed, reward, penalty):
    """(action, reward) that a learner takes from a step; None where it learns nothing."""
    if proposed == executed:
        return proposed, reward
    return {
        "transition": (proposed, reward),
        "observant": (executed, reward),
        "interruption": None,
        "disruption": (executed, reward - penalty),
        "transition-disruption": (proposed, reward - penalty),
    }[perception]


def draw_index(probabilities, generator):
    """Index of the outcome that happens; nothing is drawn where there is but one."""
    if len(probabilities) == 1:
        return 0
    chance, sum_so_far = generator.random(), 0.0
    for index, probability in enumerate(probabilities):
        sum_so_far += probability
        if chance < sum_so_far:
            return index
    return max(index for index, probability in enumerate(probabilities) if probability > 0)


class ReferenceTrial:
    """One trial of a condition.

    `rule(situation, noise) -> (action, probability)` decides; where it remembers, `observe(step)`
    is called after every assisted step. After `run`, `episodes`, `steps` and `counts` are filled.
    """

    def __init__(self, condition, rule, *, seed, trial, observe=None):
        self.condition, self.task, self.learner = condition, condition.task, condition.learner
        self.rule, self.observe = rule, observe
        self.seed, self.trial = seed, trial
        self.draw_from(seeded_bit_generators(seed, condition.learning(), trial))
        table = np.full(condition.values.shape, float(self.learner.initial_value))
        self.own_values = table.tolist()
        self.episodes, self.steps = [], []
        self.counts = {
            name: np.zeros(self.task.states, np.int64)
            for name in ("assisted", "overridden", "unassisted")
        }

    def draw_from(self, bit_generators):
        generators = map(np.random.Generator, bit_generators)
        self.explore, self.noise, self.nature, self.greedy = generators

    def run(self):
        for episode in range(self.condition.episodes + self.condition.retention):
            if self.condition.common_random_numbers:
                common = {"common_random_numbers": True}
                self.draw_from(bit_generators_of_episode(self.seed, common, self.trial, episode))
            helped = episode < self.condition.episodes
            assisted = self.training_episode(episode, helped)
            unassisted = self.greedy_episode(helped)
            self.episodes.append(
                {f"assisted_{name}": value for name, value in assisted.items()}
                | {f"unassisted_{name}": value for name, value in unassisted.items()}
            )
        return self

    def first_state(self, generator):
        starts = np.flatnonzero(self.task.start)
        return int(starts[draw_index(self.task.start[starts].tolist(), generator)])

    def outcome(self, state, action, generator):
        """What the environment does: next state, reward, whether it ends, and its event bits."""
        task, place = self.task, (state, action)
        index = draw_index(task.probability[place].tolist(), generator)
        ends = bool(task.terminated[place][index])
        succeeds = task.success is not None and task.success[place][index]
        crashes = task.crash is not None and task.crash[place][index]
        events = 1 * ends + 2 * bool(succeeds) + 4 * bool(crashes)
        next_state = int(task.next_state[place][index])
        return next_state, float(task.reward[place][index]), ends, events

    def greedy_episode(self, counted):
        state, total, length, events, ended = self.first_state(self.greedy), 0.0, 0, 0, False
        while length < self.task.episode_limit and not ended:
            self.counts["unassisted"][state] += counted
            own = self.own_values[state]
            action = one_of(own, max(own), self.greedy.random())
            state, reward, ended, happened = self.outcome(state, action, self.greedy)
            total, length, events = total + reward, length + 1, events | happened
        return {"return": total, "length": length, "events": events}

    def propose(self, state, epsilon):
        coin, tie = self.explore.random(), self.explore.random()
        own = self.own_values[state]
        if coin < epsilon:
            return int(tie * len(own))
        return one_of(own, max(own), tie)

    def training_episode(self, episode, helped):
        epsilon = scheduled(self.learner.epsilon, episode, self.condition.episodes)
        rate = scheduled(self.learner.learning_rate, episode, self.condition.episodes)
        state = self.first_state(self.nature)
        start_value = max(self.condition.values[state].tolist())
        earned, discount, first_step = 0.0, 1.0, len(self.steps)
        total, events, ended = 0.0, 0, False
        while len(self.steps) - first_step < self.task.episode_limit and not ended:
            values = self.condition.values[state].tolist()
            proposed = self.propose(state, epsilon)
            noise = Noise(self.noise.random(), self.noise.random())
            situation = Situation(values, proposed, earned, discount, start_value)
            executed, probability = self.rule(situation, noise) if helped else (proposed, 0.0)
            next_state, reward, ended, happened = self.outcome(state, executed, self.nature)
            credited = self.learn(state, proposed, executed, reward, next_state, ended, rate)
            step = SimpleNamespace(
                episode=episode, state=state, next_state=next_state, events=happened,
                proposed=proposed, executed=executed,
                credited=credited, overridden=executed != proposed, probability=probability,
                coin=noise.coin, tie=noise.tie, values=values,
                projected_return=earned + discount * values[proposed], reward=reward,
            )  # fmt: skip
            self.steps.append(step)
            if self.observe and helped:
                self.observe(step)
            self.counts["assisted"][state] += helped
            self.counts["overridden"][state] += step.overridden
            earned = earned + discount * reward
            discount = discount * self.condition.discount
            total, events, state = total + reward, events | happened, next_state
        steps = self.steps[first_step:]
        return {
            "return": total,
            "length": len(steps),
            "events": events,
            "overrides": sum(step.overridden for step in steps),
        }

    def learn(self, state, proposed, executed, reward, next_state, ended, rate):
        """The Q-learning update; returns the credited action, -1 where nothing is learned."""
        learned = learned_from(
            self.condition.perception, proposed, executed, reward, self.learner.penalty
        )
        if learned is None:
            return -1
        action, believed_reward = learned
        future = 0.0 if ended else self.learner.discount * max(self.own_values[next_state])
        old = self.own_values[state][action]
        self.own_values[state][action] = old + rate * (believed_reward + future - old)
        return action
