"""Trials of learners that observe vectors, held against the same trial written plainly."""

import dataclasses
import math

import numpy as np
import pytest

from qbumpers.decisions import Noise, Situation
from qbumpers.errors import RequestError
from qbumpers.learners import PERCEPTIONS, QLearner, Schedule
from qbumpers.learners.double_dqn import make_memory
from qbumpers.networks.network import named_parameters
from qbumpers.random_streams import ASSISTANT, ENVIRONMENT, EVALUATION, LEARNER, draw, trial_streams
from qbumpers.simulation import Script, record, run, simulate
from qbumpers.tasks.dynamics import CRASH, LIMIT, SUCCESS, TERMINATED, TRUNCATED
from tests.simulation.corridors import LEARNER as SETTINGS
from tests.simulation.corridors import Corridor, corridor, guide, in_the_corridor

BUMPERS = ("stochastic-q-bumpers", {"alpha": 0.8, "v_min": -2.0, "p_max": 0.9})


def assert_same(first, second):
    for field, array in first._asdict().items():
        np.testing.assert_array_equal(array, getattr(second, field), err_msg=field)


class PlainTrial:
    """The trial of `qbumpers.simulation`, in NumPy and float64, for the corridor."""

    def __init__(self, condition, trial):
        self.condition, self.learner = condition, condition.learner
        self.streams = trial_streams(0, condition.learning(), range(trial, trial + 1))[0]
        layout = self.learner.network.layout(3, 2)
        memory = make_memory(self.learner, layout, self.streams[LEARNER], np.float64)
        named = named_parameters(layout, memory.parameters)
        self.weights = {name: array.copy() for name, array in named.items()}
        self.target = {name: array.copy() for name, array in named.items()}
        self.mean = {name: np.zeros_like(array) for name, array in named.items()}
        self.square = {name: np.zeros_like(array) for name, array in named.items()}
        self.replay, self.seen, self.updates = [], 0, 0

    @staticmethod
    def hidden(weights, observations):
        return np.maximum(observations @ weights["hidden_1.weight"] + weights["hidden_1.bias"], 0)

    def values(self, weights, observations):
        below = self.hidden(weights, observations)
        return below @ weights["values.weight"] + weights["values.bias"]

    def learn(self):
        if self.seen < self.learner.learning_starts:
            return
        among = len(self.replay)
        size = self.learner.batch_size
        batch = [self.replay[int(draw(self.streams[LEARNER]) * among)] for _ in range(size)]
        now, action, reward, later, goes_on = (np.array(part) for part in zip(*batch, strict=True))
        preferred = self.values(self.weights, later).argmax(axis=1)
        future = self.values(self.target, later)[np.arange(size), preferred]
        wanted = reward + self.learner.discount * goes_on * future
        deltas = np.zeros((size, 2))
        missed = self.values(self.weights, now)[np.arange(size), action] - wanted
        deltas[np.arange(size), action] = np.clip(missed, -1, 1) / size
        below = self.hidden(self.weights, now)
        down = deltas @ self.weights["values.weight"].T * (below > 0)
        gradient = {
            "hidden_1.weight": now.T @ down,
            "hidden_1.bias": down.sum(axis=0),
            "values.weight": below.T @ deltas,
            "values.bias": deltas.sum(axis=0),
        }
        norm = math.sqrt(sum((g**2).sum() for g in gradient.values()))
        shorter = min(1.0, self.learner.gradient_limit / norm) if norm else 1.0
        self.updates += 1
        for name, slope in gradient.items():
            self.mean[name] += 0.1 * (shorter * slope - self.mean[name])
            self.square[name] += 0.001 * ((shorter * slope) ** 2 - self.square[name])
            mean = self.mean[name] / (1 - 0.9**self.updates)
            square = self.square[name] / (1 - 0.999**self.updates)
            self.weights[name] -= self.learner.learning_rate * mean / (np.sqrt(square) + 1e-8)
        if self.seen % self.learner.target_every == 0:
            self.target = {name: array.copy() for name, array in self.weights.items()}

    def assisted(self, episode):
        condition, streams = self.condition, self.streams
        decay = int(self.learner.epsilon.fraction * condition.episodes)
        epsilon = 1 + min(episode / decay, 1) * (0.02 - 1)
        place = Corridor()
        seen = place.reset(draw(streams[ENVIRONMENT]))
        earned, discount, start_value = 0.0, 1.0, condition.values(seen).max()
        rows = []
        for _ in range(condition.task.episode_limit):
            coin, tie = draw(streams[LEARNER]), draw(streams[LEARNER])
            proposed = int(self.values(self.weights, seen[None])[0].argmax())
            if coin < epsilon:
                proposed = int(tie * 2)
            noise = Noise(draw(streams[ASSISTANT]), draw(streams[ASSISTANT]))
            known = condition.values(seen)
            situation = Situation(
                seen, known, np.zeros((0, 2)), proposed, earned, discount, start_value, episode,
                len(rows),
            )  # fmt: skip
            executed = int(condition.assistant.decide(situation, noise, 0).action)
            later, reward, event = place.step(executed)
            if len(rows) == condition.task.episode_limit - 1 and not event & TERMINATED:
                event |= LIMIT
            rows.append((proposed, executed, reward, event))
            self.replay.append((seen, proposed, reward, later, not event & TERMINATED))
            self.replay = self.replay[-self.learner.replay_size :]
            self.seen += 1
            self.learn()
            earned, discount, seen = earned + discount * reward, discount * 0.9, later
            if event & TERMINATED:
                break
        return rows

    def greedy(self):
        stream, place = self.streams[EVALUATION], Corridor()
        seen, rows = place.reset(draw(stream)), []
        for _ in range(self.condition.task.episode_limit):
            draw(stream)
            seen, reward, event = place.step(int(self.values(self.weights, seen[None])[0].argmax()))
            if len(rows) == self.condition.task.episode_limit - 1 and not event & TERMINATED:
                event |= LIMIT
            rows.append((reward, event))
            if event & TERMINATED:
                break
        return rows


@pytest.mark.parametrize("assistant", [("none", {}), ("maximal", {}), BUMPERS])
def test_trials_are_those_of_a_plain_implementation(assistant):
    # float32 and float64 choose alike until values are nearly equal: the replay stays below its
    # size and the trial short.
    learner = SETTINGS._replace(epsilon=Schedule(1.0, 0.02, 0.5), replay_size=1000)
    condition = in_the_corridor(*assistant, learner=learner, episodes=30)
    found = run(condition, trials=3).outcomes
    for trial in range(3):
        plain = PlainTrial(condition, trial)
        for episode in range(30):
            rows, greedy = plain.assisted(episode), plain.greedy()
            assert found.assisted_length[trial, episode] == len(rows)
            assert found.assisted_return[trial, episode] == pytest.approx(sum(r[2] for r in rows))
            assert found.overrides[trial, episode] == sum(r[0] != r[1] for r in rows)
            assert found.assisted_events[trial, episode] == rows[-1][3]
            assert found.unassisted_length[trial, episode] == len(greedy)
            assert found.unassisted_return[trial, episode] == pytest.approx(
                sum(r[0] for r in greedy)
            )
            assert found.unassisted_events[trial, episode] == greedy[-1][1]


def test_learners_find_the_way_unassisted_and_events_say_so():
    condition = in_the_corridor(episodes=150)
    found = run(condition, trials=4).outcomes
    late = found.unassisted_events[:, -30:]
    assert (late & SUCCESS > 0).mean() > 0.9
    assert (found.assisted_events & CRASH > 0).any()
    assert found.overrides.sum() == 0


def test_trials_do_not_depend_on_their_company_or_on_processes():
    condition = in_the_corridor(*BUMPERS)
    whole = run(condition, trials=4).outcomes
    assert_same(run(condition, trials=4, workers=2).outcomes, whole)
    for trial in range(4):
        alone = run(condition, trials=range(trial, trial + 1)).outcomes
        np.testing.assert_array_equal(alone.assisted_return[0], whole.assisted_return[trial])
    assert not np.array_equal(whole.assisted_return[0], whole.assisted_return[1])


def test_common_random_numbers_begin_every_episode_alike():
    settings = {"common_random_numbers": True, "episodes": 6}
    none = in_the_corridor(**settings)
    assisted = in_the_corridor("maximal", **settings)
    first, second = (record(c) for c in (none, assisted))
    for episode in range(6):
        begins = [np.argmax(steps.episode == episode) for steps in (first, second)]
        np.testing.assert_array_equal(first.state[begins[0]], second.state[begins[1]])
        assert first.coin[begins[0]] == second.coin[begins[1]]


def test_in_retention_episodes_learners_go_on_unassisted():
    condition = in_the_corridor("maximal", episodes=8, retention=5)
    found = run(condition, trials=2).outcomes
    assert found.assisted_return.shape == (2, 13)
    assert found.overrides[:, :8].sum() > 0
    assert found.overrides[:, 8:].sum() == 0
    trained = run(in_the_corridor("maximal", episodes=8), trials=2).outcomes
    for field, array in trained._asdict().items():  # what follows does not change the training
        np.testing.assert_array_equal(getattr(found, field)[:, :8], array, err_msg=field)
    late = found.assisted_events[:, 8:]
    assert (late & (TERMINATED | LIMIT) > 0).all()


@pytest.mark.parametrize("perception", PERCEPTIONS)
def test_overridden_steps_are_credited_as_the_perception_says(perception):
    exploring = SETTINGS._replace(epsilon=Schedule(1.0, 1.0, 1.0))
    steps = record(in_the_corridor("maximal", perception=perception, learner=exploring))
    overridden = steps.overridden
    assert 0 < overridden.sum() < len(overridden)
    credited = {
        "transition": steps.proposed,
        "transition-disruption": steps.proposed,
        "interruption": np.full(len(overridden), -1),
    }.get(perception, steps.executed)
    np.testing.assert_array_equal(steps.credited[overridden], credited[overridden])
    np.testing.assert_array_equal(steps.credited[~overridden], steps.proposed[~overridden])


def test_records_tell_the_decisions_by_the_assistants_rule():
    condition = in_the_corridor(*BUMPERS, episodes=20)
    steps = record(condition)
    assert steps.state.shape == steps.next_state.shape == (len(steps.episode), 3)
    earned, discount, start_value = 0.0, 1.0, 0.0
    for i in range(len(steps.episode)):
        if i == 0 or steps.episode[i] != steps.episode[i - 1]:
            earned, discount, start_value = 0.0, 1.0, condition.values(steps.state[i]).max()
        known = condition.values(steps.state[i])
        np.testing.assert_allclose(steps.values[i], known, rtol=1e-6)
        first = int(np.argmax(steps.episode == steps.episode[i]))
        situation = Situation(
            steps.state[i], steps.values[i], np.zeros((0, 2)), int(steps.proposed[i]), earned,
            discount, start_value, int(steps.episode[i]), i - first,
        )  # fmt: skip
        decision = condition.assistant.decide(situation, Noise(steps.coin[i], steps.tie[i]), 0)
        assert decision.action == steps.executed[i]
        assert decision.probability == pytest.approx(steps.probability[i], abs=1e-6)
        assert steps.projected_return[i] == pytest.approx(
            earned + discount * steps.values[i, steps.proposed[i]]
        )
        earned, discount = earned + discount * steps.reward[i], discount * 0.9
    assert ((steps.probability > 0) & (steps.probability < 1)).any()


def test_a_script_is_played_again():
    condition = in_the_corridor(*BUMPERS, episodes=5)
    steps = record(condition)
    again = record(condition, script=Script(steps.proposed, steps.coin, steps.tie))
    assert_same(again, steps)


def test_a_truncation_is_no_end():
    """The last transition of an episode that stops by itself is bootstrapped through."""
    stopping = in_the_corridor(task=corridor(stops=True), episodes=40)
    steps = record(stopping)
    stopped = steps.events & TRUNCATED > 0
    assert stopped.any()
    assert not (steps.events[stopped] & TERMINATED).any()
    lengths = run(stopping, trials=1).outcomes.assisted_length
    assert lengths.max() == 6


@pytest.mark.parametrize("step", [1, 4])
def test_a_reward_that_is_no_number_is_named_with_its_episode_and_step(step):
    condition = in_the_corridor(task=corridor(broken=step))
    with pytest.raises(RequestError, match=rf"corridor: trial 2, episode \d+, step {step}: .*nan"):
        run(condition, trials=range(2, 3))


def test_values_must_suit_the_task():
    with pytest.raises(RequestError, match="no expert ships for task 'corridor'"):
        in_the_corridor(values=None)
    with pytest.raises(RequestError, match="corridor are vectors: give a network's values"):
        in_the_corridor(values=lambda observation: np.zeros(2))
    wide = dataclasses.replace(guide(), inputs=2, parameters=np.zeros(6))
    with pytest.raises(
        RequestError, match="of 2 inputs and 2 actions; task corridor needs a network of 3"
    ):
        in_the_corridor(values=wide)


def test_learners_must_suit_the_task():
    with pytest.raises(RequestError, match="observes states, and task corridor has vectors"):
        in_the_corridor(learner=QLearner())
    with pytest.raises(RequestError, match=r"batch_size = 0"):
        in_the_corridor(learner=SETTINGS._replace(batch_size=0))


def test_a_floor_above_the_start_is_refused_where_the_episode_starts():
    condition = in_the_corridor("stochastic-q-bumpers", {"alpha": 0.5, "v_min": 50.0})
    with pytest.raises(RequestError, match="v_min"):
        run(condition, trials=1)


def test_simulate_takes_names():
    found = simulate(corridor(), "none", values=guide(), learner=SETTINGS, episodes=3, trials=2)
    assert found.counts is None
    assert found.steps == (
        found.outcomes.assisted_length.sum() + found.outcomes.unassisted_length.sum()
    )
