"""Whether an environment's steps do what its transition table says: it is stepped, and compared."""

import copy
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from qbumpers.errors import RequestError, counted, in_short

_STEPS = (1_000, 6_000)  # at least and at most
_STEPS_A_PAIR = 64  # of a state and an action, if there are not too many of them
_LONGEST_EPISODE = 500  # steps: new places are more likely after another reset
_SWEEPS = 10  # of each plan of the way to what is new
_RESETS = 200  # whose first states are counted
_SEED = 2019
_CHANCE_OF_ERROR = 1e-6


class _Outcome(NamedTuple):
    """What an action can lead to, equal outcomes of a table taken together."""

    next_state: int
    reward: float
    terminated: bool
    probability: float

    def is_like(self, next_state: int, reward: float, terminated: bool) -> bool:
        """Whether this is what a step led to; rewards may differ by rounding."""
        return (
            self.next_state == next_state
            and self.terminated == terminated
            and math.isclose(self.reward, reward, rel_tol=1e-6, abs_tol=1e-6)
        )


def check_agreement(task: Any, environment: Any, reward: Callable[[float], float]) -> None:
    """Hold the table of a task to seeded steps of the environment that it was made from.

    The steps go where the table leads to states and actions that were tried least. Each must be
    one that the table has, and where chance decides, outcomes must be as frequent as it says: the
    first ones of each pair, and over all steps those that stand at the same place of its rows. A
    right table is refused with a probability below one in a million, by Agrawal's bound of the
    relative entropy of multinomials (IEEE Transactions on Information Theory, 2020) and by the
    Azuma-Hoeffding inequality. A difference that shows in none of at most 6,000 steps is not found.

    Args:
        task: with the table.
        environment: without wrappers. A copy of it is stepped, or it itself if it cannot be copied.
        reward: what wrappers make of its rewards.

    Raises:
        RequestError: at the first difference.
    """
    stepped = _copy_of(environment)
    shown, stepped.render_mode = stepped.render_mode, None  # nothing is drawn meanwhile
    try:
        _Comparison(task, stepped, reward).compare()
    finally:
        stepped.render_mode = shown


def _copy_of(environment: Any) -> Any:
    try:
        return copy.deepcopy(environment)
    except Exception:  # an open window, for instance, cannot be copied
        return environment


class _Comparison:
    def __init__(self, task: Any, environment: Any, reward: Callable[[float], float]) -> None:
        self._task, self._environment, self._reward = task, environment, reward
        pairs = task.states * task.actions
        self._steps = int(np.clip(_STEPS_A_PAIR * pairs, *_STEPS))
        self._tape = max(8, self._steps // (2 * pairs))  # outcomes of a pair that are counted
        self._visits = np.zeros((task.states, task.actions), np.int64)
        self._expected: dict[tuple[int, int], list[_Outcome]] = {}
        self._counts: dict[tuple[int, int], np.ndarray] = {}
        self._excess = np.zeros(task.next_state.shape[2])  # of outcomes over their probability
        self._ahead = np.zeros((task.states, task.actions))  # kept from plan to plan
        self._tie = np.random.default_rng(_SEED).random((task.states, task.actions)) * 1e-6

    def compare(self) -> None:
        """Step through the environment, and compare."""
        starts = [self._first_state(_SEED - number) for number in range(1, _RESETS + 1)]
        self._check_starts(np.bincount(starts, minlength=self._task.states))
        done, episode = 0, 0
        plan_every, planned = max(20, self._task.probability.size // 50), -1
        while done < self._steps:
            state = self._first_state(_SEED + episode)
            episode += 1
            for number in range(min(self._task.episode_limit, _LONGEST_EPISODE)):
                if done // plan_every != planned:
                    planned = done // plan_every
                    self._plan()
                state, over = self._step(state, self._action(state), number)
                done += 1
                if over or done >= self._steps:
                    break
        self._check_frequencies()

    def _first_state(self, seed: int) -> int:
        state = self._number_of(self._environment.reset(seed=seed)[0])
        if not self._task.start[state] > 0:
            raise self._differs(
                f"an episode began in state {state}, where by initial_state_distrib none begins"
            )
        return state

    def _step(self, state: int, action: int, number: int) -> tuple[int, bool]:
        """Take a step; the next state, and whether the episode is over."""
        task, pair = self._task, (state, action)
        observation, reward, terminated, truncated, _ = self._environment.step(
            action + task.first_action
        )
        reward, terminated = self._reward(float(reward)), bool(terminated)
        next_state = self._number_of(observation)
        expected = self._outcomes(pair)
        found = [k for k, each in enumerate(expected)
                 if each.is_like(next_state, reward, terminated)]  # fmt: skip
        if not found:
            raise self._differs(
                f"in state {state} action {action} led to {_shown(next_state, reward, terminated)};"
                f" the table has only {' or '.join(_shown(*each[:3]) for each in expected)}"
            )
        self._excess[: len(expected)] -= [each.probability for each in expected]
        self._excess[found[0]] += 1
        if self._visits[pair] < self._tape:
            self._counts[pair][found[0]] += 1
        self._visits[pair] += 1
        if truncated and number + 1 < task.episode_limit:
            raise self._differs(
                f"it truncated an episode after {counted(number + 1, 'step')}, and the step limit "
                f"is {task.episode_limit}: if it always does so, give episode_limit={number + 1}"
            )
        return next_state, terminated or bool(truncated)

    def _outcomes(self, pair: tuple[int, int]) -> list[_Outcome]:
        if pair not in self._expected:
            self._expected[pair] = _merged(self._task, *pair)
            self._counts[pair] = np.zeros(len(self._expected[pair]), np.int64)
        return self._expected[pair]

    def _number_of(self, observation: Any) -> int:
        """The number of an observed state, from 0."""
        found = np.asarray(observation)
        if found.ndim or found.dtype.kind not in "iu":
            raise self._differs(f"it shows {in_short(observation)}, which is no number of a state")
        number = int(found) - self._task.first_state
        if not 0 <= number < self._task.states:
            raise self._differs(
                f"it shows state {int(found)}; the table has {self._task.states}, from "
                f"{self._task.first_state} on"
            )
        return number

    def _plan(self) -> None:
        """How much that was tried little lies ahead of each pair, by the table."""
        task = self._task
        new, goes_on = 1 / (1 + self._visits), task.probability * ~task.terminated
        value = (new + self._ahead).max(axis=1)
        for _ in range(_SWEEPS):
            self._ahead = 0.95 * (goes_on * value[task.next_state]).sum(axis=2)
            value = (new + self._ahead).max(axis=1)

    def _action(self, state: int) -> int:
        """The action that leads most to what was tried little; it may have been tried since."""
        new = 1 / (1 + self._visits[state])
        return int((new + self._ahead[state] + self._tie[state]).argmax())

    def _check_starts(self, counts: np.ndarray) -> None:
        possible = self._task.start > 0
        distance = _relative_entropy(counts[possible], self._task.start[possible])
        if _log_bound(distance, int(possible.sum()) - 1) < math.log(_CHANCE_OF_ERROR / 3):
            raise self._differs("episodes do not begin as often in each state as it says")

    def _check_frequencies(self) -> None:
        # Every pair that could have been tried counts: which ones were depends on the outcomes.
        allowed = math.log(_CHANCE_OF_ERROR / 3 / self._visits.size)
        for pair, counts in self._counts.items():
            if counts.sum() < self._tape:
                continue
            expected = self._expected[pair]
            probability = np.array([each.probability for each in expected])
            if _log_bound(_relative_entropy(counts, probability), len(counts) - 1) < allowed:
                outcome = int(np.abs(counts / self._tape - probability).argmax())
                raise self._differs(
                    f"in state {pair[0]} action {pair[1]} led to "
                    f"{_shown(*expected[outcome][:3])} {counted(int(counts[outcome]), 'time')} of "
                    f"{self._tape}; by the table its probability is {probability[outcome]:.3g}"
                )
        most = math.sqrt(self._steps / 2 * math.log(3 * len(self._excess) / _CHANCE_OF_ERROR))
        place = int(self._excess.argmax())  # together they are 0
        if self._excess[place] > most:
            raise self._differs(
                f"in {self._steps:,} steps the outcomes that stand at place {place} of its rows "
                f"came {self._excess[place]:+.0f} times too often"
            )

    def _differs(self, what: str) -> RequestError:
        return RequestError(
            f"environment {self._task.name}: its steps do not do what its transition table says: "
            f"{what}"
        )


def _merged(task: Any, state: int, action: int) -> list[_Outcome]:
    """The possible outcomes of a pair, equal ones taken together."""
    found: list[_Outcome] = []
    for k in np.flatnonzero(task.probability[state, action]):
        place = state, action, k
        probability, rest = float(task.probability[place]), (
            int(task.next_state[place]), float(task.reward[place]), bool(task.terminated[place])
        )  # fmt: skip
        alike = next((i for i, each in enumerate(found) if each.is_like(*rest)), None)
        if alike is None:
            found.append(_Outcome(*rest, probability))
        else:
            found[alike] = _Outcome(*rest, found[alike].probability + probability)
    return found


def _relative_entropy(counts: np.ndarray, probability: np.ndarray) -> float:
    """Of frequencies from probabilities, times how many there are."""
    seen = counts > 0
    ratio = counts[seen] / (counts.sum() * probability[seen])
    return float((counts[seen] * np.log(ratio)).sum())


def _log_bound(distance: float, freedom: int) -> float:
    """Logarithm of a bound of the probability of such a relative entropy, or a larger one."""
    if distance <= freedom or not freedom:
        return 0.0
    return freedom - distance + freedom * math.log(distance / freedom)


def _shown(next_state: int, reward: float, terminated: bool) -> str:
    return f"state {next_state} with reward {reward:g}{' and the end' if terminated else ''}"
