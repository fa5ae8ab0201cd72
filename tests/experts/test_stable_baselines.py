"""Models of Stable-Baselines3 as action values: those of the model itself."""

import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import DQN, PPO

from qbumpers.errors import RequestError
from qbumpers.experts import from_stable_baselines
from qbumpers.tasks import make_task
from qbumpers.values import load_values


@pytest.fixture(scope="module")
def task():
    return make_task("CartPole-v1", discount=0.99)


@pytest.fixture(autouse=True, scope="module")
def single_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def trained(
    steps=0, environment: Any = "CartPole-v1", algorithm: Any = DQN, policy="MlpPolicy", **fields
):
    shape = fields.pop("policy_kwargs", {"net_arch": [16, 8]})
    model = algorithm(policy, environment, device="cpu", seed=0, policy_kwargs=shape, **fields)
    return model.learn(steps) if steps else model


def values_of_model(model, observations):
    with torch.no_grad():
        return model.q_net(torch.as_tensor(observations)).numpy()


@pytest.mark.parametrize("hidden", [[16, 8], [], [12], [8, 8, 8]])
@pytest.mark.parametrize("activation", [torch.nn.ReLU, torch.nn.Tanh])
def test_values_are_those_of_the_model(task, hidden, activation):
    model = trained(policy_kwargs={"net_arch": hidden, "activation_fn": activation})
    observations = np.random.default_rng(0).normal(0, 2, (100, 4)).astype(np.float32)
    found = from_stable_baselines(model, task)(observations)
    assert found == pytest.approx(values_of_model(model, observations), abs=1e-5)


def test_a_trained_model_is_read_from_its_file_with_its_discount(task, tmp_path):
    model = trained(
        600, learning_rate=2e-3, learning_starts=200, gamma=0.97, target_update_interval=200
    )
    model.save(tmp_path / "model.zip")
    values = from_stable_baselines(tmp_path / "model.zip", task)
    observations = np.random.default_rng(0).normal(0, 1, (100, 4)).astype(np.float32)
    assert values(observations) == pytest.approx(values_of_model(model, observations), abs=1e-4)
    assert (values.discount, values.task) == (0.97, "CartPole-v1")
    assert values.method == "DQN of Stable-Baselines3, 600 steps"
    values.save(tmp_path / "values.npz")
    assert load_values(tmp_path / "values.npz").digest() == values.digest()


class Pictures(gymnasium.Env):
    observation_space = spaces.Box(0, 255, (36, 36, 3), np.uint8)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return np.zeros((36, 36, 3), np.uint8), {}


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: trained(environment="Acrobot-v1"), r"model: it sees Box.*\(6,\).*vectors of 4"),
        (lambda: trained(environment="MountainCar-v0"), "CartPole-v1 shows vectors of 4 numbers"),
        (
            lambda: trained(environment=Pictures(), policy="CnnPolicy", buffer_size=10),
            r"model: it sees Box\(0, 255, \(3, 36, 36\)",
        ),
        (
            lambda: trained(policy_kwargs={"activation_fn": torch.nn.ELU}),
            "FlattenExtractor, Linear, ELU.*Tanh or ReLU is needed",
        ),
        (lambda: trained(algorithm=PPO), "a PPO; a DQN is needed"),
        (lambda: 5, "a int; a DQN is needed"),
    ],
)
def test_another_model_is_refused(task, make, message):
    with pytest.raises(RequestError, match=message):
        from_stable_baselines(make(), task)


def test_a_file_of_another_algorithm_is_refused(task, tmp_path):
    trained(algorithm=PPO).save(tmp_path / "model.zip")
    with pytest.raises(RequestError, match=r"model\.zip: not a DQN of Stable-Baselines3"):
        from_stable_baselines(str(tmp_path / "model.zip"), task)


@pytest.mark.parametrize("content", [b"", b"not a model", b"PK\x03\x04 nearly"])
def test_another_kind_of_file_is_refused(task, tmp_path, content):
    (tmp_path / "model.zip").write_bytes(content)
    with pytest.raises(RequestError, match=r"model\.zip: not a DQN of Stable-Baselines3"):
        from_stable_baselines(tmp_path / "model.zip", task)


def test_a_missing_file_is_named(task, tmp_path):
    with pytest.raises(RequestError, match=r"absent\.zip: there is no such file"):
        from_stable_baselines(tmp_path / "absent.zip", task)


def test_where_stable_baselines_is_missing_the_extra_is_named(task, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(RequestError, match=r"pip install 'qbumpers\[sb3\]'"):
        from_stable_baselines("model.zip", task)
