"""Q* of a task with vector observations, learned by Double DQN without help (Section 4.3)."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from qbumpers.compilation import compiled_apart
from qbumpers.errors import RequestError
from qbumpers.learners.double_dqn import Brain, DoubleDQN, Rates, learn, make_brain, rates, remember
from qbumpers.learners.q_learning import choose, scheduled
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw, trial_streams
from qbumpers.tasks.dynamics import TERMINATED, TRUNCATED, finite
from qbumpers.tasks.vector import VectorTask
from qbumpers.values.network import NetworkValues

_REPORT_EVERY = 2_000  # steps


class Recipe(NamedTuple):
    """How an expert is trained; the defaults are the paper's.

    Attributes:
        learner: the Double DQN; its schedule of epsilon runs over steps here, not episodes.
        steps: of training.
        opening: random actions that every episode of training begins with.
    """

    learner: DoubleDQN = DoubleDQN(learning_rate=5e-4)
    steps: int = 400_000
    opening: int = 50

    def words(self, seed: int) -> str:
        """The recipe in a line, for the provenance of values."""
        network, epsilon = self.learner.network, self.learner.epsilon
        dueling = f", dueling {network.dueling}" if network.dueling else ""
        return (
            f"Double DQN, {network.activation} {'-'.join(map(str, network.hidden))}{dueling}, "
            f"learning rate {self.learner.learning_rate:g}, {self.steps} steps, epsilon "
            f"{epsilon.start:g} to {epsilon.end:g} over {epsilon.fraction:.0%}, "
            f"{self.opening} random actions before each episode, seed {seed}"
        )


def train_expert(
    task: VectorTask,
    recipe: Recipe = Recipe(),  # noqa: B008 - immutable
    *,
    seed: int = 0,
    report: Callable[[int], None] = lambda steps: None,
) -> NetworkValues:
    """Train an expert.

    Args:
        task: the task.
        recipe: how.
        seed: of all random streams, not negative.
        report: called now and then with the steps done.

    Returns:
        The action values of the last step.

    Raises:
        RequestError: where a number of the recipe is out of range, or the environment gives a
            number that is not finite.
    """
    if recipe.steps < 1 or recipe.opening < 0 or seed < 0:
        raise RequestError(
            f"steps = {recipe.steps}, opening = {recipe.opening}, seed = {seed}; at least 1, 0 "
            "and 0 are needed"
        )
    learner = recipe.learner
    layout = learner.network.layout(task.observation_size, task.actions)
    content = ["train_expert", task.digest(), recipe]
    streams = trial_streams(seed, content, range(1))[0]
    brain = make_brain(learner, layout, streams[LEARNER])
    _train(task, recipe, layout, brain, streams, report)
    return NetworkValues(
        network=learner.network,
        inputs=task.observation_size,
        actions=task.actions,
        parameters=brain.parameters,
        discount=learner.discount,
        task=task.name,
        method=recipe.words(seed),
    )


def _train(
    task: VectorTask,
    recipe: Recipe,
    layout: Layout,
    brain: Brain,
    streams: np.ndarray,
    report: Callable[[int], None],
) -> None:
    stepper = task.make_stepper()
    network = (tuple(layout), brain.parameters, np.zeros(layout.room(1), np.float32))
    numbers, plain = tuple(rates(recipe.learner)), tuple(brain)
    observation, length = stepper.reset(draw(streams[ENVIRONMENT])), 0
    for step in range(recipe.steps):
        epsilon = scheduled(recipe.learner.epsilon, step, recipe.steps)
        if length < recipe.opening:
            epsilon = 1.0
        action = _choose(network, observation, epsilon, streams[LEARNER])
        following, reward, event = stepper.step(action)
        learned = _take(
            network, plain, numbers, observation, action, reward, following, event, streams
        )
        if not learned:
            raise RequestError(
                f"task {task.name}: step {step + 1}: observation {following.tolist()}, reward "
                f"{reward}; every number must be finite"
            )
        observation, length = following, length + 1
        if event & (TERMINATED | TRUNCATED) or length == task.episode_limit:
            observation, length = stepper.reset(draw(streams[ENVIRONMENT])), 0
        if (step + 1) % _REPORT_EVERY == 0:
            report(step + 1)


@compiled_apart
def _choose(network: Any, observation: np.ndarray, epsilon: float, stream: np.ndarray) -> int:
    return choose(values_of(network, observation), epsilon, draw(stream), draw(stream))


@compiled_apart
def _take(
    network: Any, brain: Any, numbers: Any, observation: np.ndarray, action: int, reward: float,
    following: np.ndarray, event: int, streams: np.ndarray,
) -> bool:  # fmt: skip
    """Learn from a step; False where a number is not finite."""
    sound = finite(reward, following)
    if sound:
        terminated = event & TERMINATED != 0
        remember(Brain(*brain), observation, action, reward, following, terminated)
        learn(Layout(*network[0]), Brain(*brain), Rates(*numbers), streams[EVALUATION])
    return sound
