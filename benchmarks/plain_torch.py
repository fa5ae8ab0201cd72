"""The lunar lander's learner in plain PyTorch, the way one would first write it.

Environment and networks are Gymnasium's and PyTorch's; learner and loop are written here anew. The
decision rule is the package's, run from its Python source.
"""

import copy
import itertools
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from stable_baselines3 import DQN
from torch import nn

from qbumpers.assistants import Assistant
from qbumpers.decisions import Noise, begin, settle, situate
from qbumpers.learners import DoubleDQN
from qbumpers.values import NetworkValues

ENVIRONMENT = "LunarLander-v3"

_NO_OTHERS = np.zeros((0, 4))  # further rows of values, of which the rule names none


class Times(NamedTuple):
    """Seconds of the processor, resets not counted, and steps of both kinds."""

    training: float
    training_steps: int
    evaluation: float
    evaluation_steps: int


class Replay:
    """The transitions that a learner remembers, drawn from at random.

    Args:
        size: how many.
        width: numbers of an observation.
    """

    def __init__(self, size: int, width: int) -> None:
        self._columns = (
            np.zeros((size, width), np.float32),
            np.zeros(size, np.int64),
            np.zeros(size, np.float32),
            np.zeros((size, width), np.float32),
            np.zeros(size, np.float32),
        )
        self.seen = 0

    def add(self, *transition: Any) -> None:
        """Keep observation, action, reward, next observation and whether it goes on."""
        place = self.seen % len(self._columns[0])
        for column, value in zip(self._columns, transition, strict=True):
            column[place] = value
        self.seen += 1

    def sample(self, number: int, generator: np.random.Generator) -> list[torch.Tensor]:
        """A batch, a tensor for each part of a transition."""
        among = min(self.seen, len(self._columns[0]))
        places = generator.integers(among, size=number)
        return [torch.from_numpy(column[places]) for column in self._columns]


class PlainLearner:
    """A simulated learner that learns to land by Double DQN, assisted.

    Args:
        settings: of the learner; its exploration is the last of the schedule throughout.
        assistant: the assistant.
        expert: Q* of the assistant.
        seed: of the environment at every reset, and of the random numbers.
    """

    def __init__(
        self, settings: DoubleDQN, assistant: Assistant, expert: NetworkValues, seed: int
    ) -> None:
        torch.set_num_threads(1)  # more would only get in each other's way on so small a network
        torch.manual_seed(seed)
        self._settings, self._assistant, self._seed = settings, assistant, seed
        self._generator = np.random.default_rng(seed)
        self._environment = gymnasium.make(ENVIRONMENT)
        sizes = (expert.inputs, *settings.network.hidden, expert.actions)
        self._network = network(sizes)
        self._target = copy.deepcopy(self._network)
        self._expert = as_torch(expert, sizes)
        self._optimiser = torch.optim.Adam(self._network.parameters(), lr=settings.learning_rate)
        self._replay = Replay(settings.replay_size, expert.inputs)

    def run(self, steps: int) -> Times:
        """Assisted episodes with learning, each followed by a greedy one, for so many steps."""
        times = Times(0.0, 0, 0.0, 0)
        while times.training_steps < steps:
            trained, length = self._timed(self._assisted_episode)
            played, greedy_length = self._timed(self._greedy_episode)
            times = Times(
                times.training + trained,
                times.training_steps + length,
                times.evaluation + played,
                times.evaluation_steps + greedy_length,
            )
        return times

    def _timed(self, episode: Callable[[np.ndarray], int]) -> tuple[float, int]:
        observation, _ = self._environment.reset(seed=self._seed)
        begin = time.process_time()
        length = episode(observation)
        return time.process_time() - begin, length

    def _assisted_episode(self, observation: np.ndarray) -> int:
        length, ended = 0, False
        account = begin(values_of(self._expert, observation), 0)
        while not ended:
            values, proposed = values_of(self._expert, observation), self._propose(observation)
            situation = situate(account, observation, values, _NO_OTHERS, proposed)
            noise = Noise(self._generator.random(), self._generator.random())
            executed = int(self._assistant.decide(situation, noise).action)
            next_observation, reward, terminated, truncated, _ = self._environment.step(executed)
            reward = float(reward)
            self._replay.add(observation, proposed, reward, next_observation, 1.0 - terminated)
            self._learn()
            account = settle(account, reward, self._settings.discount)
            observation, length = next_observation, length + 1
            ended = terminated or truncated
        return length

    def _greedy_episode(self, observation: np.ndarray) -> int:
        length, ended = 0, False
        while not ended:
            action = int(values_of(self._network, observation).argmax())
            observation, _, terminated, truncated, _ = self._environment.step(action)
            length, ended = length + 1, terminated or truncated
        return length

    def _propose(self, observation: np.ndarray) -> int:
        if self._generator.random() < self._settings.epsilon.end:
            return int(self._generator.integers(4))
        return int(values_of(self._network, observation).argmax())

    def _learn(self) -> None:
        settings, seen = self._settings, self._replay.seen
        if seen < settings.learning_starts:
            return
        observations, actions, rewards, next_observations, goes_on = self._replay.sample(
            settings.batch_size, self._generator
        )
        with torch.no_grad():
            preferred = self._network(next_observations).argmax(1, keepdim=True)
            future = self._target(next_observations).gather(1, preferred)[:, 0]
            targets = rewards + settings.discount * goes_on * future
        found = self._network(observations).gather(1, actions[:, None])[:, 0]
        loss = nn.functional.huber_loss(found, targets)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), settings.gradient_limit)
        self._optimiser.step()
        if seen % settings.target_every == 0:
            self._target.load_state_dict(self._network.state_dict())


def network(sizes: tuple[int, ...]) -> nn.Sequential:
    """A perceptron with tanh units between layers of so many units."""
    layers: list[nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), nn.Tanh()]
    return nn.Sequential(*layers[:-1])


def as_torch(values: NetworkValues, sizes: tuple[int, ...]) -> nn.Sequential:
    """The network of values, without dueling heads, in PyTorch."""
    copied, place = network(sizes), 0
    with torch.no_grad():
        for layer in copied:
            if isinstance(layer, nn.Linear):
                end = place + layer.weight.numel()
                weights = torch.tensor(values.parameters[place:end])
                layer.weight.copy_(weights.reshape(layer.in_features, layer.out_features).T)
                place = end + layer.out_features
                layer.bias.copy_(torch.tensor(values.parameters[end:place]))
    return copied


def values_of(module: nn.Module, observation: np.ndarray) -> np.ndarray:
    """Action values of one observation, float64 [A]."""
    with torch.no_grad():
        return module(torch.from_numpy(observation)).numpy().astype(np.float64)


def stable_baselines3(settings: DoubleDQN, seed: int) -> DQN:
    """Stable-Baselines3's DQN with the settings of a learner: no double estimate, no assistant."""
    torch.set_num_threads(1)
    return DQN(
        "MlpPolicy", gymnasium.make(ENVIRONMENT), learning_rate=settings.learning_rate,
        buffer_size=settings.replay_size, learning_starts=settings.learning_starts,
        batch_size=settings.batch_size, gamma=settings.discount, train_freq=1, gradient_steps=1,
        target_update_interval=settings.target_every, max_grad_norm=settings.gradient_limit,
        exploration_initial_eps=settings.epsilon.end, exploration_final_eps=settings.epsilon.end,
        policy_kwargs={"net_arch": [*settings.network.hidden], "activation_fn": nn.Tanh},
        device="cpu", seed=seed,
    )  # fmt: skip
