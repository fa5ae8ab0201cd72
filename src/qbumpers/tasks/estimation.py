"""Tables of transitions that are estimated from steps of an environment."""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from qbumpers.errors import RequestError, check_number, in_short
from qbumpers.tasks.announcing import Announced, Found, events_told, found_keys
from qbumpers.tasks.construction import endings
from qbumpers.tasks.dynamics import CRASH, SUCCESS
from qbumpers.tasks.wrapping import step_limit

FEW = 10
"""Tries of a pair below which a table is warned of."""

_SEEDS = 2**32  # as many as Gymnasium's environments are sure to take


class EstimateWarning(UserWarning):
    """A table was estimated from too few steps for some of its rows."""


class Estimate(NamedTuple):
    """What a table was estimated from; a pair is a state and an action.

    Attributes:
        steps: how many the environment was stepped.
        visits: int64 [S, A], how often each pair was tried.
        starts: int64 [S], how many episodes began in each state.
        met: bool [S], states in which an episode can go on, as far as was seen; the others were
            never seen, or only as the end of an episode.
        best: return of the best reward that was seen in every step of a whole episode, at least 0.
    """

    steps: int
    visits: np.ndarray
    starts: np.ndarray
    met: np.ndarray
    best: float

    @property
    def least(self) -> int:
        """Fewest tries of a pair of a state that was met."""
        return int(self.visits[self.met].min())

    @property
    def median(self) -> float:
        """Median of the tries of those pairs."""
        return float(np.median(self.visits[self.met]))

    @property
    def untried(self) -> int:
        """How many of those pairs were never tried; they count as the worst that could be."""
        return int((self.visits[self.met] == 0).sum())

    def words(self) -> str:
        """The estimate in a line, without uncertainty of values."""
        pairs = int(self.met.sum()) * self.visits.shape[1]
        return (
            f"estimated from {self.steps:,} steps: {pairs:,} pairs of a state and an action, tried "
            f"at least {self.least:,} times and {self.median:,.0f} in the median, {self.untried:,} "
            "never"
        )


def estimated_table(
    environment: Any,
    *,
    discount: float,
    steps: int,
    seed: int,
    episode_limit: int | None,
    success_key: str | None,
    crash_key: str | None,
) -> dict[str, Any]:
    """Fields of a tabular task, estimated; see `TabularTask.estimated`."""
    name = environment.spec.id if environment.spec else type(environment.unwrapped).__name__
    limit = step_limit(environment) if episode_limit is None else episode_limit
    _check(environment, name, steps, seed, limit, discount)
    told = found_keys(name, environment, success_key, crash_key)
    counts = _Counts(Announced(environment, told.keys))
    counts.count(steps, seed, int(limit or 1))
    whole = _steps_weighed(discount, int(limit or 1))
    best, worst = max(counts.rewards[1], 0.0) * whole, min(counts.rewards[0], 0.0) * whole
    estimate = Estimate(steps, counts.visits, counts.starts, counts.met, best)
    if estimate.least < FEW:
        few = int((counts.visits[counts.met] < FEW).sum())
        warnings.warn(
            f"task {name}: of its {int(counts.met.sum()) * counts.visits.shape[1]:,} pairs of a "
            f"state and an action {few:,} were tried fewer than {FEW} times, {estimate.untried:,} "
            f"of them never; give more than {steps:,} steps",
            EstimateWarning,
            stacklevel=3,
        )
    return {
        **counts.table(worst, told),
        "name": name,
        "start": counts.starts / counts.starts.sum(),
        "episode_limit": limit,
        "first_state": int(environment.observation_space.start),
        "first_action": int(environment.action_space.start),
        "estimate": estimate,
    }


def _check(
    environment: Any, name: str, steps: Any, seed: Any, limit: int | None, discount: Any
) -> None:
    for kind in ("observation", "action"):
        space = getattr(environment, f"{kind}_space")
        if not isinstance(space, spaces.Discrete):
            raise RequestError(
                f"environment {name}: its {kind} space is {space}; a table can be estimated of "
                "numbered ones (Discrete) only"
            )
    for field, value, allowed in (("steps", steps, 1), ("seed", seed, 0)):
        if not isinstance(value, int | np.integer) or value < allowed:
            raise RequestError(
                f"environment {name}: {field} = {in_short(value)}; a whole number of at least "
                f"{allowed} is needed"
            )
    if limit is None:
        raise RequestError(f"environment {name} has no step limit: give episode_limit")
    check_number(limit, "episode_limit", "of at least 1")
    check_number(discount, "discount", "in (0, 1]")
    if limit < 1 or not 0 < discount <= 1:
        raise RequestError(
            f"environment {name}: episode_limit = {limit!r}, discount = {discount!r}; at least 1, "
            "and a number in (0, 1], are needed"
        )


def _steps_weighed(discount: float, limit: int) -> float:
    """Return of an episode that brings 1 in every step."""
    return limit if discount == 1 else (1 - discount**limit) / (1 - discount)


class _Counts:
    """Outcomes of each pair, counted."""

    def __init__(self, environment: Any) -> None:
        self._environment = environment
        self._first_state = int(environment.observation_space.start)
        self._first_action = int(environment.action_space.start)
        shape = int(environment.observation_space.n), int(environment.action_space.n)
        self.visits = np.zeros(shape, np.int64)
        self.starts = np.zeros(shape[0], np.int64)
        self.met = np.zeros(shape[0], np.bool_)
        self.rewards = (np.inf, -np.inf)  # the least and the largest
        # By pair: (next state, terminated, events) -> number, sum, least and largest reward.
        self._outcomes: dict[tuple[int, int], dict[tuple[int, bool, int], list[float]]] = {}

    def count(self, steps: int, seed: int, limit: int) -> None:
        """Play episodes until so many steps are done."""
        generator, done = np.random.default_rng(seed), 0
        while done < steps:
            seed_of_episode = int(generator.integers(_SEEDS))
            state = self._number(self._environment.reset(seed=seed_of_episode)[0])
            self.starts[state] += 1
            self.met[state] = True
            for _ in range(min(limit, steps - done)):
                action = self._action(state, generator)
                state, over = self._step(state, action)
                done += 1
                if over:
                    break

    def _number(self, observation: Any) -> int:
        return int(observation) - self._first_state

    def _action(self, state: int, generator: np.random.Generator) -> int:
        """The one that was tried least; equal ones by chance (Kearns and Singh 2002)."""
        tried = self.visits[state]
        among = np.flatnonzero(tried == tried.min())
        return int(among[int(generator.random() * len(among))])

    def _step(self, state: int, action: int) -> tuple[int, bool]:
        observation, reward, terminated, truncated, info = self._environment.step(
            action + self._first_action
        )
        next_state, reward, terminated = self._number(observation), float(reward), bool(terminated)
        self.visits[state, action] += 1
        self.rewards = min(self.rewards[0], reward), max(self.rewards[1], reward)
        if not terminated:
            self.met[next_state] = True
        outcomes = self._outcomes.setdefault((state, action), {})
        found = outcomes.setdefault(
            (next_state, terminated, events_told(info)), [0, 0.0, np.inf, -np.inf]
        )
        found[:] = found[0] + 1, found[1] + reward, min(found[2], reward), max(found[3], reward)
        return next_state, terminated or bool(truncated)

    def table(self, worst: float, told: Found) -> dict[str, np.ndarray | None]:
        """The fields [S, A, K] of a tabular task."""
        width = max(len(outcomes) for outcomes in self._outcomes.values())
        shape = (*self.visits.shape, width)
        # What was never tried stays where it is, and ends the episode.
        next_state = np.broadcast_to(np.arange(shape[0])[:, None, None], shape).copy()
        probability, reward = np.zeros(shape), np.zeros(shape)
        events, terminated = np.zeros(shape, np.int64), np.ones(shape, np.bool_)
        probability[:, :, 0] = 1.0
        reward[self.met] = worst
        for pair, outcomes in self._outcomes.items():
            for k, ((to, ends, told_by_step), tally) in enumerate(outcomes.items()):
                place = (*pair, k)
                next_state[place], terminated[place], events[place] = to, ends, told_by_step
                probability[place], reward[place] = tally[0] / self.visits[pair], _mean(tally)
        known = {
            "success": (events & SUCCESS).astype(np.bool_) if told.success else None,
            "crash": (events & CRASH).astype(np.bool_) if told.crash else None,
        }
        if not told.success and not told.crash:
            tried = np.broadcast_to((self.visits > 0)[:, :, None], shape)
            known = endings(terminated & tried, reward, probability)
        return {
            "next_state": next_state, "probability": probability, "reward": reward,
            "terminated": terminated, **known,
        }  # fmt: skip


def _mean(tally: Sequence[float]) -> float:
    """Mean reward of an outcome; equal rewards keep their last bit."""
    number, total, least, most = tally
    return least if least == most else total / number
