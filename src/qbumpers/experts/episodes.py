"""Episodes of a task with vector observations, played by any policy, as arrays."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.choice import best_value, pick
from qbumpers.compilation import uncompiled
from qbumpers.errors import RequestError
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.tasks.stepping import Stepper
from qbumpers.tasks.task import Task
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.tabular import QValues, check_width

Policy = Callable[[np.ndarray, int], int]
"""An action from an observation, float32 [D], and the number of the step, from 0."""

_pick, _best_value = uncompiled(pick), uncompiled(best_value)


class Episode(NamedTuple):
    """What happened in an episode of T steps.

    Attributes:
        observations: float32 [T + 1, D], before each step and after the last.
        actions: int64 [T].
        rewards: float64 [T].
        events: bits of `qbumpers.tasks.dynamics` that occurred.
        chance: in [0, 1), what the environment was reset with.
    """

    observations: np.ndarray
    actions: np.ndarray
    rewards: np.ndarray
    events: int
    chance: float

    @property
    def terminated(self) -> bool:
        """Whether it ended for good; otherwise it was truncated."""
        return bool(self.events & TERMINATED)

    @property
    def success(self) -> bool:
        """Whether the task was solved."""
        return bool(self.events & SUCCESS)

    @property
    def crash(self) -> bool:
        """Whether it ended badly."""
        return bool(self.events & CRASH)


def play(task: Task, stepper: Stepper, policy: Policy, chance: float) -> Episode:
    """Play an episode.

    Args:
        task: what is played.
        stepper: the environment of the task, reset by this call.
        policy: chooses the actions.
        chance: in [0, 1), for the environment; equal chance and actions give equal episodes.

    Returns:
        The episode, up to the task's step limit.

    Raises:
        RequestError: if an observation or a reward is not finite.
    """
    actions: list[int] = []
    rewards: list[float] = []
    observation, events = stepper.reset(chance), 0
    observations = [observation]
    while len(actions) < task.episode_limit:
        action = policy(observation, len(actions))
        observation, reward, event = stepper.step(action)
        observations.append(observation)
        actions.append(action)
        rewards.append(reward)
        events |= event
        if event & (TERMINATED | TRUNCATED):
            break
    episode = Episode(
        np.array(observations, np.float32), np.array(actions), np.array(rewards), events, chance
    )
    _check_finite(task, episode)
    return episode


def _check_finite(task: Task, episode: Episode) -> None:
    rewards = np.concatenate([[0.0], episode.rewards])
    broken = np.flatnonzero(~np.isfinite(episode.observations.sum(axis=1) + rewards))
    if len(broken):
        step = int(broken[0])
        raise RequestError(
            f"task {task.name}: step {step}: observation {episode.observations[step].tolist()}, "
            f"reward {rewards[step]}; every number must be finite"
        )


def greedy(values: QValues, actions: int, generator: np.random.Generator) -> Policy:
    """Takes an action of the largest value, equally good ones at random.

    Args:
        values: Q*.
        actions: A.
        generator: for ties.

    Returns:
        The policy; it raises RequestError if values are not one finite number per action.
    """

    def policy(observation: np.ndarray, step: int) -> int:
        """The best action, whatever the step."""
        row = check_width(values(observation), actions, f"at step {step}")
        return _pick(row, _best_value(row), generator.random())

    return policy


def epsilon_greedy(
    greedy: Policy,
    epsilon: float,
    actions: int,
    generator: np.random.Generator,
    random_start: int = 0,
) -> Policy:
    """A policy whose actions are replaced by random ones now and then.

    Args:
        greedy: decides otherwise.
        epsilon: probability of a random action.
        actions: A.
        generator: draws the coins and the random actions.
        random_start: steps at the beginning of an episode that are all random.

    Returns:
        The policy.
    """

    def policy(observation: np.ndarray, step: int) -> int:
        """A random action, surely at first and later by chance; else the greedy one."""
        if step < random_start or generator.random() < epsilon:
            return int(generator.integers(actions))
        return greedy(observation, step)

    return policy


def replay_then(recorded: Sequence[int] | np.ndarray, policy: Policy) -> Policy:
    """Repeats recorded actions, from the first step on, and goes on by a policy."""
    actions = np.asarray(recorded).tolist()

    def replaying(observation: np.ndarray, step: int) -> int:
        """The recorded action of the step while there is one, then the policy's."""
        return actions[step] if step < len(actions) else policy(observation, step)

    return replaying


def play_several(
    task: Task,
    values: QValues,
    episodes: int,
    *,
    epsilon: float = 0.0,
    random_start: int = 0,
    seed: int = 0,
) -> list[Episode]:
    """Greedy episodes, each with random numbers of its own.

    Args:
        task: what is played.
        values: Q* that decide.
        episodes: how many, at least 1.
        epsilon: probability of a random action instead.
        random_start: random actions at the beginning of each episode.
        seed: decides chance of the environment and random actions; not negative.

    Returns:
        The episodes; the first ones do not depend on how many follow.

    Raises:
        RequestError: if a number is out of range, or values or observations are wrong.
    """
    if episodes < 1 or random_start < 0 or seed < 0 or not 0 <= epsilon <= 1:
        raise RequestError(
            f"episodes = {episodes}, random_start = {random_start}, seed = {seed}, epsilon = "
            f"{epsilon}; at least 1, 0, 0 and a number in [0, 1] are needed"
        )
    check_fit(values, use_at(task))
    stepper = task.make_stepper()
    played: list[Episode] = []
    for number in range(episodes):
        generator = np.random.default_rng([seed, number])
        chance = generator.random()
        policy = greedy(values, task.actions, generator)
        policy = epsilon_greedy(policy, epsilon, task.actions, generator, random_start)
        played.append(play(task, stepper, policy, chance))
    return played


def discounted_return(rewards: np.ndarray, discount: float) -> float:
    """Sum of discount**t r_t over rewards [T]."""
    return float(rewards @ discount ** np.arange(len(rewards)))
