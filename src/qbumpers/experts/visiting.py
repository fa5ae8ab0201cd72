"""States that learners see: episodes of people who learn alone, and of an expert that wavers."""

import numpy as np

from qbumpers.experts.episodes import Episode, greedy, play, wavering
from qbumpers.learners.double_dqn import Brain, DoubleDQN, learn, make_brain, rates, remember
from qbumpers.learners.q_learning import choose, scheduled
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw, trial_streams
from qbumpers.tasks.dynamics import TERMINATED
from qbumpers.tasks.vector import Stepper, VectorTask
from qbumpers.values.network import NetworkValues

_EPISODES = 100  # of each learner
_WAVERING = (0.1, 0.3, 0.6)  # shares of random actions


def visit(task: VectorTask, values: NetworkValues, learners: int, seed: int) -> list[Episode]:
    """Episodes of learners without help, and as many of the wavering expert, shuffled.

    Args:
        task: the task.
        values: of the expert.
        learners: how many, each from its first episode on.
        seed: of the random numbers, not negative.

    Returns:
        The episodes.
    """
    generator = np.random.default_rng([seed, 0])
    visited = []
    for number in range(learners):
        streams = trial_streams(seed, ["evaluated", task.digest()], range(number, number + 1))[0]
        visited += _practise(task, values.discount, streams)
    stepper, best = task.make_stepper(), greedy(values, task.actions, generator)
    for number in range(len(visited)):
        share = _WAVERING[number % len(_WAVERING)]
        opening = int(generator.integers(100)) if number % 2 else 0
        policy = wavering(best, share, task.actions, generator, opening)
        visited.append(play(task, stepper, policy, generator.random()))
    return [visited[place] for place in generator.permutation(len(visited))]


class _Practice:
    """An environment that a learner learns in as it is stepped through."""

    def __init__(self, stepper: Stepper, layout: Layout, brain: Brain, learner: DoubleDQN) -> None:
        self._stepper, self._layout, self._brain = stepper, layout, brain
        self._rates = rates(learner)
        self.streams: np.ndarray

    def reset(self, chance: float) -> np.ndarray:
        self._observation = self._stepper.reset(chance)
        return self._observation

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        observation, reward, event = self._stepper.step(action)
        ended = event & TERMINATED != 0
        remember(self._brain, self._observation, action, reward, observation, ended)
        learn(self._layout, self._brain, self._rates, self.streams[EVALUATION])
        self._observation = observation
        return observation, reward, event


def _practise(task: VectorTask, discount: float, streams: np.ndarray) -> list[Episode]:
    """Episodes of a learner from its first on."""
    learner = DoubleDQN(discount=discount)
    layout = learner.network.layout(task.observation_size, task.actions)
    brain = make_brain(learner, layout, streams[LEARNER])
    network = (tuple(layout), brain.parameters, np.zeros(layout.room(1), np.float32))
    practice = _Practice(task.make_stepper(), layout, brain, learner)
    practice.streams = streams
    episodes = []
    for number in range(_EPISODES):
        epsilon = scheduled(learner.epsilon, number, _EPISODES)

        def policy(observation: np.ndarray, _: int, epsilon: float = epsilon) -> int:
            row = values_of(network, observation)
            return choose(row, epsilon, draw(streams[LEARNER]), draw(streams[LEARNER]))

        episodes.append(play(task, practice, policy, draw(streams[ENVIRONMENT])))
    return episodes
