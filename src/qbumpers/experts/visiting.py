"""States that learners see: episodes of unassisted learners and of an epsilon-greedy expert."""

import numpy as np

from qbumpers.compilation import entered
from qbumpers.experts.episodes import Episode, epsilon_greedy, greedy, play
from qbumpers.learners.double_dqn import DoubleDQN, DQNMemory, choose, learn, make_memory
from qbumpers.learners.interface import Rates, Transition
from qbumpers.learners.schedules import scheduled
from qbumpers.random_streams import ENVIRONMENT, EVALUATION, LEARNER, draw, trial_streams
from qbumpers.registration import as_numbers
from qbumpers.tasks.dynamics import TERMINATED
from qbumpers.tasks.stepping import Stepper
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues

_EPISODES = 100  # of each learner
_EPSILONS = (0.1, 0.3, 0.6)  # of the expert's episodes, in turn
_LONGEST_START = 100  # random actions that every other one of them may begin with


def visited_episodes(task: Task, values: NetworkValues, learners: int, seed: int) -> list[Episode]:
    """Episodes of unassisted learners, and as many epsilon-greedy ones of the expert, shuffled.

    Args:
        task: what is learned.
        values: Q* of the expert, of which greedy actions are taken.
        learners: how many, each from its first episode on.
        seed: decides all that learners and policies draw; not negative.

    Returns:
        The episodes.
    """
    generator = np.random.default_rng([seed, 0])
    visited: list[Episode] = []
    for number in range(learners):
        streams = trial_streams(seed, ["evaluated", task.digest()], range(number, number + 1))[0]
        visited += _learning_episodes(task, values.discount, streams)
    stepper, best = task.make_stepper(), greedy(values, task.actions, generator)
    for number in range(len(visited)):
        epsilon = _EPSILONS[number % len(_EPSILONS)]
        random_start = int(generator.integers(_LONGEST_START)) if number % 2 else 0
        policy = epsilon_greedy(best, epsilon, task.actions, generator, random_start)
        visited.append(play(task, stepper, policy, generator.random()))
    return [visited[place] for place in generator.permutation(len(visited))]


class _LearningStepper:
    """An environment whose every step a learner learns from.

    Args:
        stepper: what is stepped.
        settings: how the learner learns, as numbers.
        memory: what the learner knows, changed in place after every step.
        stream: uint64 [4], random stream of its batches.
    """

    def __init__(
        self, stepper: Stepper, settings: DoubleDQN, memory: DQNMemory, stream: np.ndarray
    ) -> None:
        self._stepper, self._learner = stepper, (settings, memory)
        self._rest = (Rates(0.0, settings.learning_rate), stream)
        nothing = np.zeros(memory.layout.sizes[0], np.float32)
        example = Transition(nothing, 0, 0.0, nothing, False, -1)
        self._learn = entered(learn, *self._learner, example, *self._rest)

    def reset(self, chance: float) -> np.ndarray:
        """Begin an episode."""
        self._observation = self._stepper.reset(chance)
        return self._observation

    def step(self, action: int) -> tuple[np.ndarray, float, int]:
        """Take a step, from which the learner learns."""
        observation, reward, event = self._stepper.step(action)
        terminated = event & TERMINATED != 0
        happened = Transition(self._observation, action, reward, observation, terminated, -1)
        self._learn(*self._learner, happened, *self._rest)
        self._observation = observation
        return observation, reward, event


def _learning_episodes(task: Task, discount: float, streams: np.ndarray) -> list[Episode]:
    """Episodes of a learner from its first on."""
    learner = DoubleDQN(discount=discount)
    layout = learner.network.layout(task.observation_size, task.actions)
    memory = make_memory(learner, layout, streams[LEARNER])
    settings, rates = as_numbers(learner), Rates(1.0, learner.learning_rate)
    stepper = _LearningStepper(task.make_stepper(), settings, memory, streams[EVALUATION])
    nothing = np.zeros(task.observation_size, np.float32)
    propose = entered(choose, settings, memory, nothing, rates, streams[LEARNER])
    episodes: list[Episode] = []
    for number in range(_EPISODES):
        now = rates._replace(epsilon=scheduled(learner.epsilon, number, _EPISODES))

        def policy(observation: np.ndarray, _: int, now: Rates = now) -> int:
            return propose(settings, memory, observation, now, streams[LEARNER])

        episodes.append(play(task, stepper, policy, draw(streams[ENVIRONMENT])))
    return episodes
