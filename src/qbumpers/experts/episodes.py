"""Episodes of a task with vector observations, played by any policy, as arrays."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.choice import best_value, pick
from qbumpers.compilation import uncompiled
from qbumpers.errors import RequestError
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from qbumpers.tasks.vector import Stepper, VectorTask
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


def play(task: VectorTask, stepper: Stepper, policy: Policy, chance: float) -> Episode:
    """Play an episode.

    Args:
        task: the task.
        stepper: its environment.
        policy: chooses the actions.
        chance: in [0, 1), for the environment; equal chance and actions give equal episodes.

    Returns:
        The episode, up to the task's step limit.

    Raises:
        RequestError: where an observation or a reward is not finite.
    """
    observation = stepper.reset(chance)
    observations, actions, rewards, events = [observation], [], [], 0
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


def _check_finite(task: VectorTask, episode: Episode) -> None:
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
        The policy; it raises RequestError where values are not one finite number an action.
    """

    def policy(observation: np.ndarray, step: int) -> int:
        row = check_width(values(observation), actions, f"at step {step}")
        return _pick(row, _best_value(row), generator.random())

    return policy


def wavering(
    policy: Policy, epsilon: float, actions: int, generator: np.random.Generator, opening: int = 0
) -> Policy:
    """A policy whose actions are replaced by random ones now and then.

    Args:
        policy: the policy.
        epsilon: probability of a random action.
        actions: A.
        generator: of the random actions.
        opening: steps at the beginning of an episode that are all random.

    Returns:
        The policy.
    """

    def wavered(observation: np.ndarray, step: int) -> int:
        if step < opening or generator.random() < epsilon:
            return int(generator.integers(actions))
        return policy(observation, step)

    return wavered


def following(prefix: Sequence[int] | np.ndarray, then: Policy) -> Policy:
    """Repeats the actions of a prefix and goes on by another policy."""
    recorded = np.asarray(prefix).tolist()

    def policy(observation: np.ndarray, step: int) -> int:
        return recorded[step] if step < len(recorded) else then(observation, step)

    return policy


def play_several(
    task: VectorTask,
    values: QValues,
    episodes: int,
    *,
    epsilon: float = 0.0,
    opening: int = 0,
    seed: int = 0,
) -> list[Episode]:
    """Greedy episodes, each with random numbers of its own.

    Args:
        task: the task.
        values: Q* that decide.
        episodes: how many, at least 1.
        epsilon: probability of a random action instead.
        opening: random actions at the beginning of each episode.
        seed: of the random numbers, not negative.

    Returns:
        The episodes; the first ones do not depend on how many follow.

    Raises:
        RequestError: where a number is out of range, or values or observations are wrong.
    """
    if episodes < 1 or opening < 0 or seed < 0 or not 0 <= epsilon <= 1:
        raise RequestError(
            f"episodes = {episodes}, opening = {opening}, seed = {seed}, epsilon = {epsilon}; at "
            "least 1, 0, 0 and a number in [0, 1] are needed"
        )
    stepper = task.make_stepper()
    played = []
    for number in range(episodes):
        generator = np.random.default_rng([seed, number])
        chance = generator.random()
        policy = greedy(values, task.actions, generator)
        policy = wavering(policy, epsilon, task.actions, generator, opening)
        played.append(play(task, stepper, policy, chance))
    return played


def discounted_return(rewards: np.ndarray, discount: float) -> float:
    """Sum of discount**t r_t over rewards [T]."""
    return float(rewards @ discount ** np.arange(len(rewards)))
