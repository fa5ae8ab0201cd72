"""Double DQN as textbooks write it, in float64 by PyTorch's automatic differentiation."""

import numpy as np
import torch

from qbumpers.networks.network import named_parameters
from tests.narrowing import present

ACTIVATIONS = {"tanh": torch.tanh, "relu": torch.relu}


class TextbookNetwork:
    """A network with the parameters of a compiled one."""

    def __init__(self, network, layout, parameters):
        self.network = network
        self.parameters = {
            name: torch.tensor(array, dtype=torch.float64, requires_grad=True)
            for name, array in named_parameters(layout, parameters).items()
        }

    def layer(self, name, units):
        return units @ self.parameters[f"{name}.weight"] + self.parameters[f"{name}.bias"]

    def __call__(self, observations):
        activate = ACTIVATIONS[self.network.activation]
        units = torch.as_tensor(observations, dtype=torch.float64)
        for number in range(1, len(self.network.hidden) + 1):
            units = activate(self.layer(f"hidden_{number}", units))
        if not self.network.dueling:
            return self.layer("values", units)
        value = self.layer("value", activate(self.layer("value_units", units)))
        advantages = self.layer("advantages", activate(self.layer("advantage_units", units)))
        return value + advantages - advantages.mean(dim=1, keepdim=True)

    def flat(self):
        """All parameters in a row, as the compiled network keeps them."""
        return np.concatenate([p.detach().numpy().ravel() for p in self.parameters.values()])

    def gradient(self):
        return np.concatenate([present(p.grad).numpy().ravel() for p in self.parameters.values()])

    def copy_from(self, other):
        with torch.no_grad():
            for name, parameter in self.parameters.items():
                parameter.copy_(other.parameters[name])


def double_dqn_loss(online, target, transitions, discount):
    """Mean Huber loss of width 1; transitions are rows as the replay of a `DQNMemory` has them."""
    rows = torch.as_tensor(np.asarray(transitions, np.float64))
    width = (rows.shape[1] - 3) // 2
    observations, next_observations = rows[:, :width], rows[:, width : 2 * width]
    actions, rewards, going_on = rows[:, 2 * width].long(), rows[:, -2], rows[:, -1]
    with torch.no_grad():
        preferred = online(next_observations).argmax(dim=1, keepdim=True)
        future = target(next_observations).gather(1, preferred)[:, 0]
        targets = rewards + discount * going_on * future
    values = online(observations).gather(1, actions[:, None])[:, 0]
    return torch.nn.functional.smooth_l1_loss(values, targets)


class TextbookLearner:
    """Adam steps on batches of the replay, with a target network renewed now and then."""

    def __init__(self, learner, layout, parameters):
        self.learner = learner
        self.online = TextbookNetwork(learner.network, layout, parameters)
        self.target = TextbookNetwork(learner.network, layout, parameters)
        self.adam = torch.optim.Adam(
            self.online.parameters.values(), learner.learning_rate, betas=(0.9, 0.999), eps=1e-8
        )

    def update(self, transitions):
        self.adam.zero_grad()
        double_dqn_loss(self.online, self.target, transitions, self.learner.discount).backward()
        self.clip()
        self.adam.step()

    def clip(self):
        limit = self.learner.gradient_limit
        parameters = list(self.online.parameters.values())
        groups = {"global": [parameters], "variable": [[p] for p in parameters], "none": []}
        for group in groups[self.learner.clip]:
            norm = torch.sqrt(
                sum(((p.grad**2).sum() for p in group), torch.zeros((), dtype=torch.float64))
            )
            for parameter in group:
                if norm > limit:
                    parameter.grad *= limit / norm


def transitions(generator, count, inputs, actions, spread=1.0):
    """Random rows of a replay, a fifth of them terminal; float32 [N, 2 D + 3]."""
    return np.column_stack(
        [
            generator.normal(0, 1, (count, 2 * inputs)),
            generator.integers(actions, size=count),
            generator.normal(0, spread, count),
            generator.random(count) > 0.2,
        ]
    ).astype(np.float32)
