"""Q* of a task with vector observations, learned unassisted by Double DQN (Section 4.3)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from qbumpers.compilation import compiled_apart, entered
from qbumpers.errors import RequestError
from qbumpers.experts.exploring import (
    HeldActions,
    Snapshots,
    for_plain_observations,
    observed_spread,
)
from qbumpers.experts.normalisation import Normalisation
from qbumpers.learners.double_dqn import DoubleDQN, DQNMemory, choose, learn, make_memory
from qbumpers.learners.interface import Rates, Transition
from qbumpers.learners.schedules import scheduled
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw, trial_streams
from qbumpers.registration import as_numbers
from qbumpers.tasks.dynamics import TERMINATED, TRUNCATED, finite
from qbumpers.tasks.stepping import Stepper
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues

_REPORT_EVERY = 2_000  # steps
_OLD_PENALTY = 1.0  # a learner had one when the seeds of published experts were drawn


class Recipe(NamedTuple):
    """How an expert is trained; the defaults are the paper's.

    Attributes:
        learner: the Double DQN; its schedule of epsilon runs over steps here, not episodes.
        steps: environment steps of training.
        random_start: random actions that every episode of training begins with.
        general: whether it explores by random actions that go on for a while, learns from
            standardised observations, and keeps the best of 20 snapshots of the second half, by 20
            greedy episodes each; else single random actions, plain observations, the last step.
    """

    learner: DoubleDQN = DoubleDQN(learning_rate=5e-4)
    steps: int = 400_000
    random_start: int = 50
    general: bool = False

    def words(self, seed: int) -> str:
        """The recipe in a line, for the provenance of values."""
        network, epsilon = self.learner.network, self.learner.epsilon
        dueling = f", dueling {network.dueling}" if network.dueling else ""
        general = (
            ", held random actions, standardised, best of 20 snapshots" if self.general else ""
        )
        return (
            f"Double DQN, {network.activation} {'-'.join(map(str, network.hidden))}{dueling}, "
            f"learning rate {self.learner.learning_rate:g}, {self.steps} steps, epsilon "
            f"{epsilon.start:g} to {epsilon.end:g} over {epsilon.fraction:.0%}, "
            f"{self.random_start} random actions before each episode{general}, seed {seed}"
        )


GENERAL = Recipe(DoubleDQN(learning_rate=2.5e-4), steps=200_000, random_start=0, general=True)
"""For any other task than the paper's."""


def train_expert(
    task: Task,
    recipe: Recipe = Recipe(),  # noqa: B008 - immutable
    *,
    seed: int = 0,
    report: Callable[[int], None] = lambda steps: None,
) -> NetworkValues:
    """Train an expert.

    Args:
        task: what it is to be good at.
        recipe: how it is trained.
        seed: decides all chance of the training; not negative.
        report: called now and then with the steps done.

    Returns:
        The action values of the last step, or of the best snapshot of a general recipe.

    Raises:
        RequestError: if a number of the recipe is out of range, the task's states are numbered, or
            the environment gives a number that is not finite.
    """
    if recipe.steps < 1 or recipe.random_start < 0 or seed < 0:
        raise RequestError(
            f"steps = {recipe.steps}, random_start = {recipe.random_start}, seed = {seed}; at "
            "least 1, 0 and 0 are needed"
        )
    stepper, learner = task.make_stepper(), recipe.learner
    layout = learner.network.layout(task.observation_size, task.actions)
    asked = [[*learner, _OLD_PENALTY], recipe.steps, recipe.random_start]
    content = ["train_expert", task.digest(), asked + [True] * recipe.general]
    streams = trial_streams(seed, content, range(1))[0]
    memory = make_memory(learner, layout, streams[LEARNER])
    seen = observed_spread(task, streams[EVALUATION]) if recipe.general else None

    def now() -> NetworkValues:
        """The action values of the moment."""
        values = NetworkValues(
            network=learner.network,
            inputs=task.observation_size,
            actions=task.actions,
            parameters=memory.parameters,
            discount=learner.discount,
            task=task.name,
            method=recipe.words(seed),
            made_for=task.identity(),
        )
        return values if seen is None else for_plain_observations(values, seen)

    snapshots = Snapshots(task, recipe.steps, now) if recipe.general else None
    _train(task, stepper, recipe, memory, streams, report, seen, snapshots)
    return now() if snapshots is None or snapshots.best is None else snapshots.best.values


def _train(
    task: Task,
    stepper: Stepper,
    recipe: Recipe,
    memory: DQNMemory,
    streams: np.ndarray,
    report: Callable[[int], None],
    seen: Normalisation | None,
    snapshots: Snapshots | None,
) -> None:
    settings, schedule = as_numbers(recipe.learner), recipe.learner.epsilon
    rates = Rates(1.0, recipe.learner.learning_rate)
    held = HeldActions(task.actions, streams[LEARNER]) if recipe.general else None
    observation, length = _shown(stepper.reset(draw(streams[ENVIRONMENT])), seen), 0
    propose = entered(choose, settings, memory, observation, rates, streams[LEARNER])
    take = entered(
        _take, settings, memory, Transition(observation, 0, 0.0, observation, False, -1), rates,
        streams[EVALUATION],
    )  # fmt: skip
    for step in range(recipe.steps):
        epsilon = scheduled(schedule, step, recipe.steps)
        if length < recipe.random_start:
            epsilon = 1.0
        action = -1 if held is None else held.action(epsilon)
        if action < 0:
            chance = rates._replace(epsilon=0.0 if held else epsilon)
            action = propose(settings, memory, observation, chance, streams[LEARNER])
        next_observation, reward, event = stepper.step(action)
        next_observation = _shown(next_observation, seen)
        terminated = event & TERMINATED != 0
        happened = Transition(observation, action, reward, next_observation, terminated, -1)
        if not take(settings, memory, happened, rates, streams[EVALUATION]):
            raise RequestError(
                f"task {task.name}: step {step + 1}: observation {next_observation.tolist()}, "
                f"reward {reward}; every number must be finite"
            )
        observation, length = next_observation, length + 1
        if event & (TERMINATED | TRUNCATED) or length == task.episode_limit:
            observation, length = _shown(stepper.reset(draw(streams[ENVIRONMENT])), seen), 0
            if held is not None:
                held.begin()
        if snapshots is not None:
            snapshots.look(step + 1)
        if (step + 1) % _REPORT_EVERY == 0:
            report(step + 1)


def _shown(observation: np.ndarray, seen: Normalisation | None) -> np.ndarray:
    """An observation as the network sees it, float32 [D]."""
    return observation if seen is None else seen.normalised(observation).astype(np.float32)


@compiled_apart
def _take(
    settings: DoubleDQN, memory: DQNMemory, happened: Transition, rates: Rates, stream: np.ndarray
) -> bool:
    """Learn from a step; False if a number is not finite."""
    sound = finite(happened.reward, happened.next_state)
    if sound:
        learn(settings, memory, happened, rates, stream)
    return sound
