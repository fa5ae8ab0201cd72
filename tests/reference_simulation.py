"""Learners and trial a second time: plain Python, one number after the other.

Written from Section 4.2 of the paper and from Sutton and Barto, to be compared
with the package. It takes from the package only its containers of data (task, learner, situation)
and the names of conditions.
"""

import hashlib
import json
from types import SimpleNamespace
from typing import Any

import numpy as np

from qbumpers.decisions import Noise, Situation
from qbumpers.learners import PowerLaw
from tests.learners.textbook_tables import LEARNERS, Table
from tests.reference_rules import one_of


class _Words(np.random.bit_generator.ISeedSequence):
    """Seed words that are handed to NumPy's generator as they are."""

    def __init__(self, words):
        self.words = words

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> np.ndarray:
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
    seeds: list[Any] = [_Words(state[first : first + 3]) for first in (0, 3, 6, 9)]
    return [np.random.SFC64(words) for words in seeds]


def scheduled(schedule, episode, episodes):
    decaying = int(schedule.fraction * episodes)
    if episode >= decaying:
        return schedule.start + (schedule.end - schedule.start)
    return schedule.start + episode / decaying * (schedule.end - schedule.start)


PERCEPTIONS = {
    "transition": (0, "proposed", False),
    "observant": (1, "executed", False),
    "interruption": (1, "nothing", False),
    "disruption": (1, "executed", True),
    "transition-disruption": (1, "proposed", True),
}
"""Probability of noticing an override, what is credited then, and whether it is disliked."""


def perceived(perception, penalty):
    """(notices, credits, penalty) of a perception or of the name of one."""
    if isinstance(perception, str):
        notices, credit, disliked = PERCEPTIONS[perception]
        return notices, credit, penalty if disliked else 0.0
    return perception.notices, perception.credits, perception.penalty


def learned_from(perception, proposed, executed, undone, reward, coin):
    """(action, reward, whether it seemed to lead back) taken from a step; None for nothing."""
    notices, credit, penalty = perception
    if proposed == executed and not undone:
        return proposed, reward, False
    if not coin < notices:  # it looks like the learner's own doing
        return proposed, reward, undone
    return {
        "executed": (executed, reward - penalty, False),
        "proposed": (proposed, reward - penalty, undone),
        "nothing": None,
    }[credit]


def draw_index(probabilities, generator):
    """Index of the outcome that happens; nothing is drawn if there is but one."""
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

    `rule(situation, noise) -> (action, probability[, undo])` decides; if it remembers,
    `observe(step)` is called after every assisted step. After `run`, `episodes`, `steps` and
    `counts` are filled.
    """

    def __init__(self, condition, rule, *, seed, trial, observe=None):
        self.condition, self.task, self.learner = condition, condition.task, condition.learner
        self.rule, self.observe = rule, observe
        self.seed, self.trial = seed, trial
        self.draw_from(seeded_bit_generators(seed, condition.learning(), trial))
        self.perception = perceived(condition.perception, condition.penalty)
        first = float(getattr(self.learner, "initial_value", 0.0))
        self.own_values = [[first] * self.task.actions for _ in range(self.task.states)]
        kind = LEARNERS.get(type(self.learner).__name__)
        self.other = kind and kind(self.learner, self.task.states, self.task.actions)
        self.practised = {}  # (state, action): number of the episode of its last practice
        self.ahead = None  # (state, action) that a learner of SARSA has chosen already
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
            if episode > 0:
                self.forget(self.condition.forgetting, episode)
            is_assisted = episode < self.condition.episodes
            assisted = self.training_episode(episode, is_assisted)
            unassisted = self.greedy_episode(is_assisted)
            self.episodes.append(
                {f"assisted_{name}": value for name, value in assisted.items()}
                | {f"unassisted_{name}": value for name, value in unassisted.items()}
            )
        return self

    def remembered(self):
        """Everything that can be forgotten, as (dictionary by (state, action, ...), its origin)."""
        if self.other:
            return self.other.remembered()
        return [(Table(self.own_values), self.learner.initial_value)]

    def forget(self, forgetting, episode):
        """Before an episode: a share of what there is, or what a power law of its age asks for."""
        if forgetting == 0:
            return
        for table, origin in self.remembered():
            for place, value in list(table.items()):
                aged = isinstance(forgetting, PowerLaw)
                share = self.lost(place, episode) if aged else forgetting
                table[place] = value + share * (origin - value)

    def lost(self, place, episode):
        """Share of what was left in the last episode that is gone by this one.

        What was never practised is as old as the trial.
        """
        pairs = [place[:2]] if len(place) > 1 else [(*place, a) for a in range(self.task.actions)]
        last = max(self.practised.get(pair, 0) for pair in pairs)
        decay = self.condition.forgetting.decay
        before, now = ((1 + t) ** -decay for t in (episode - 1 - last, episode - last))
        return 1 - now / before

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

    def seen(self, state):
        """What the assistant sees of a state."""
        return state if self.task.seen is None else int(self.task.seen[state])

    def greedy_episode(self, counted):
        state, total, length, events, ended = self.first_state(self.greedy), 0.0, 0, 0, False
        action = None
        while length < self.task.episode_limit and not ended:
            self.counts["unassisted"][state] += counted
            own = self.wanted(state)
            action = self.hand(one_of(own, max(own), self.greedy.random()), action, self.greedy)
            state, reward, ended, happened = self.outcome(state, action, self.greedy)
            total, length, events = total + reward, length + 1, events | happened
        return {"return": total, "length": length, "events": events if ended else events | 16}

    def hand(self, meant, last, generator):
        """What is done instead of what was meant; `last` is None on the first step."""
        slip, lag = self.condition.motor
        done = meant
        if slip > 0 and generator.random() < slip:
            others = [action for action in range(self.task.actions) if action != meant]
            done = others[int(generator.random() * len(others))]
        if lag > 0 and last is not None and generator.random() < lag:
            done = last
        return done

    def explored(self, state, epsilon):
        """An epsilon-greedy action."""
        coin, tie = self.explore.random(), self.explore.random()
        own = self.own_values[state]
        if coin < epsilon:
            return int(tie * len(own))
        return one_of(own, max(own), tie)

    def wanted(self, state):
        return self.other.wanted(state) if self.other else self.own_values[state]

    def mean(self, state, epsilon):
        """What the action is chosen for."""
        if self.other:
            return self.other.choose(state, self.explore)
        if self.ahead is not None and self.ahead[0] == state:
            return self.ahead[1]
        return self.explored(state, epsilon)

    def decided(self, situation, noise, is_assisted):
        """(executed, probability, undone)."""
        if not is_assisted:
            return situation.proposed, 0.0, False
        return (*self.rule(situation, noise), False)[:3]

    def rates(self, episode):
        """Exploration and step size; other learners look for theirs themselves."""

        def rate_of(schedule):
            return scheduled(schedule, episode, self.condition.episodes)

        if self.other:
            self.other.begin(rate_of)
            return None, None
        return rate_of(self.learner.epsilon), rate_of(self.learner.learning_rate)

    def training_episode(self, episode, is_assisted):
        epsilon, rate = self.rates(episode)
        state, self.ahead = self.first_state(self.nature), None
        start_value = max(self.condition.values[state].tolist())
        earned, discount, first_step = 0.0, 1.0, len(self.steps)
        total, events, ended, last, limit = 0.0, 0, False, None, self.task.episode_limit
        while len(self.steps) - first_step < limit and not ended:
            values = self.condition.values[state].tolist()
            proposed = self.hand(self.mean(state, epsilon), last, self.explore)
            noise = Noise(self.noise.random(), self.noise.random())
            situation = Situation(
                state=self.seen(state), values=np.array(values),
                others=self.condition.others[state], proposed=proposed, earned=earned,
                discount=discount, start_value=start_value, episode=episode,
                step=len(self.steps) - first_step,
            )  # fmt: skip
            executed, probability, undone = self.decided(situation, noise, is_assisted)
            next_state, reward, would_end, happened = self.outcome(state, executed, self.nature)
            ended = would_end and not undone
            happened -= would_end - ended
            if not ended and len(self.steps) - first_step == limit - 1:
                happened += 16
            credited = self.learn(
                state, proposed, executed, undone, reward, next_state, would_end, epsilon, rate
            )
            self.practised[state, credited] = episode
            step = SimpleNamespace(
                episode=episode, state=state, next_state=next_state, events=happened,
                proposed=proposed, executed=executed, undone=undone, credited=credited,
                overridden=executed != proposed or undone, probability=probability,
                coin=noise.coin, tie=noise.tie, values=values,
                projected_return=earned + discount * values[proposed], reward=reward,
            )  # fmt: skip
            self.steps.append(step)
            if self.observe and is_assisted:
                self.observe(self.as_seen(step))
            self.counts["assisted"][state] += is_assisted
            self.counts["overridden"][state] += step.overridden
            earned = earned + discount * reward
            discount = discount * self.condition.discount
            total, events, last = total + reward, events | happened, proposed
            state = state if undone else next_state
        steps = self.steps[first_step:]
        return {
            "return": total,
            "length": len(steps),
            "events": events,
            "overrides": sum(step.overridden for step in steps),
        }

    def as_seen(self, step):
        """A step as the assistant's rule is shown it."""
        seen = {name: self.seen(getattr(step, name)) for name in ("state", "next_state")}
        return SimpleNamespace(**{**vars(step), **seen})

    def learn(
        self, state, proposed, executed, undone, reward, next_state, would_end, epsilon, rate
    ):
        """One update; returns the credited action, -1 if nothing is learned."""
        self.ahead = None
        coin, overridden = 0.0, executed != proposed or undone
        if overridden and 0 < self.perception[0] < 1:
            coin = self.explore.random()
        learned = learned_from(self.perception, proposed, executed, undone, reward, coin)
        if learned is None:
            return -1
        action, believed_reward, back = learned
        if self.other:
            led_to, ends = (state, False) if back else (next_state, would_end)
            self.other.learn(state, action, believed_reward, led_to, ends)
            return action
        future = 0.0
        if back or not would_end:
            led_to = state if back else next_state
            future = self.learner.discount * self.value(led_to, epsilon)
        old = self.own_values[state][action]
        self.own_values[state][action] = old + rate * (believed_reward + future - old)
        return action

    def value(self, state, epsilon):
        """What a state is worth: to SARSA the next action's value, chosen here and now."""
        own, kind = self.own_values[state], type(self.learner).__name__
        if kind == "Sarsa":
            self.ahead = state, self.explored(state, epsilon)
            return own[self.ahead[1]]
        if kind == "ExpectedSarsa":
            total = 0.0
            for value in own:
                total += value
            return (1 - epsilon) * max(own) + epsilon * total / len(own)
        return max(own)
