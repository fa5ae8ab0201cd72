"""Models of Stable-Baselines3 as action values: those of the model itself."""

import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces, wrappers
from gymnasium.envs.registration import EnvSpec
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    SubprocVecEnv,
    VecFrameStack,
    VecMonitor,
    VecNormalize,
)

from qbumpers.errors import RequestError
from qbumpers.experts import ExpertWarning, from_stable_baselines
from qbumpers.experts.episodes import play_several
from qbumpers.tasks import make_task
from qbumpers.values import load_values
from tests.values.networks import constant

NOT_KNOWN = "it is not known whether it saw normalised observations or rewards"


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
    with pytest.warns(ExpertWarning, match=NOT_KNOWN):
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


def pole(*around):
    """CartPole in wrappers, the first inside."""
    environment = gymnasium.make("CartPole-v1")
    for wrap in around:
        environment = wrap(environment)
    return environment


def normalised(**options):
    """CartPole whose observations are normalised."""
    inner = VecMonitor(DummyVecEnv([pole, pole]))
    return VecNormalize(inner, **{"norm_reward": False, **options})


SHORT = {"steps": 600, "learning_rate": 2e-3, "learning_starts": 100, "target_update_interval": 100}


@pytest.fixture(scope="module")
def normalised_model():
    return trained(environment=normalised(), **SHORT)


@pytest.fixture
def statistics(normalised_model):
    """Those of its environment, which a test may change."""
    found = normalised_model.get_vec_normalize_env()
    before = found.obs_rms, found.clip_obs
    yield found
    found.obs_rms, found.clip_obs = before


@pytest.fixture(scope="module")
def observations(task):
    """Of random play and of a policy that falls at once."""
    values = constant(1, 4, 2)
    played = [e for chance in (1.0, 0.0) for e in play_several(task, values, 9, epsilon=chance)]
    return np.concatenate([episode.observations for episode in played])


def assert_values_are_those_of(model, statistics, values, observations):
    expected = values_of_model(model, statistics.normalize_obs(observations))
    assert values(observations) == pytest.approx(expected, abs=1e-3)
    assert (values(observations).argmax(1) == expected.argmax(1)).mean() > 0.99
    unaware = values_of_model(model, observations)
    assert np.abs(unaware - expected).max() > 0.05  # so the test could fail


def test_statistics_of_the_models_own_environment_become_part_of_the_network(
    task, normalised_model, statistics, observations
):
    values = from_stable_baselines(normalised_model, task)
    assert_values_are_those_of(normalised_model, statistics, values, observations)
    assert values.method.endswith("600 steps, with the statistics of its observations")


def test_so_do_those_of_a_file(task, normalised_model, statistics, observations, tmp_path):
    normalised_model.save(tmp_path / "model.zip")
    statistics.save(tmp_path / "statistics.pkl")
    for given in (statistics, tmp_path / "statistics.pkl", str(tmp_path / "statistics.pkl")):
        values = from_stable_baselines(tmp_path / "model.zip", task, given)
        assert_values_are_those_of(normalised_model, statistics, values, observations)


def test_what_a_models_own_file_does_not_say_is_said(task, normalised_model, tmp_path):
    normalised_model.save(tmp_path / "model.zip")
    with pytest.warns(ExpertWarning, match=rf"model .*model\.zip: {NOT_KNOWN}"):
        from_stable_baselines(tmp_path / "model.zip", task)
    # An environment that was given to it afterwards says nothing of its training.
    later = DQN.load(tmp_path / "model.zip", env=pole())
    with pytest.warns(ExpertWarning, match=NOT_KNOWN):
        from_stable_baselines(later, task)


def test_environments_in_other_processes_cannot_be_looked_at(task):
    environments = SubprocVecEnv([pole], start_method="fork")
    try:
        with pytest.warns(ExpertWarning, match=NOT_KNOWN):
            from_stable_baselines(trained(environment=environments), task)
    finally:
        environments.close()


def test_statistics_of_gymnasium_become_part_too(task, observations):
    environment: Any = pole(wrappers.NormalizeObservation)
    model = trained(environment=environment, **SHORT)
    values = from_stable_baselines(model, task)
    environment.update_running_mean = False
    seen = np.stack([environment.observation(each) for each in observations])
    assert values(observations) == pytest.approx(values_of_model(model, seen), abs=1e-3)


@pytest.mark.parametrize("options", [{}, {"norm_obs": False}])
def test_normalised_rewards_are_refused(task, options):
    model = trained(environment=normalised(norm_reward=True, **options))
    with pytest.raises(RequestError, match=r"rewards were normalised .*norm_reward=False"):
        from_stable_baselines(model, task)


def test_observations_that_were_not_normalised_are_left_alone(task, observations):
    model = trained(environment=normalised(norm_obs=False))
    found = from_stable_baselines(model, task)(observations)
    assert found == pytest.approx(values_of_model(model, observations), abs=1e-5)


def test_statistics_that_clip_what_the_task_shows_are_refused(task, normalised_model, statistics):
    statistics.clip_obs = 1.0
    message = r"clipped what it saw at 1, and \d+\.\d+% of [\d,]+ observations.*would differ there"
    with pytest.raises(RequestError, match=message):
        from_stable_baselines(normalised_model, task)


@pytest.fixture
def registered_pole(monkeypatch):
    """Registers CartPole with a wrapper, and forgets it; its id."""

    def register(wrapper):
        spec = EnvSpec(
            "WrappedPole-v0", "gymnasium.envs.classic_control:CartPoleEnv", max_episode_steps=500,
            additional_wrappers=(wrapper,),
        )  # fmt: skip
        monkeypatch.setitem(gymnasium.registry, spec.id, spec)
        return spec.id

    return register


def test_a_spread_too_small_for_the_network_is_refused(registered_pole):
    everywhere = spaces.Box(-np.inf, np.inf, (4,), np.float32)
    far = wrappers.TransformObservation.wrapper_spec(
        func=lambda seen: (seen + np.float32(1e6)).astype(np.float32), observation_space=everywhere
    )
    name = registered_pole(far)
    inner = DummyVecEnv([lambda: gymnasium.make(name)])
    model = trained(environment=VecNormalize(inner, norm_reward=False, clip_obs=1e9), **SHORT)
    model.get_vec_normalize_env().obs_rms.var = np.full(4, 0.25)  # as after a long training
    with pytest.raises(RequestError, match="too small beside its mean for numbers of 32 bits"):
        from_stable_baselines(model, make_task(name, discount=0.99))


UNIT = spaces.Box(-1, 1, (4,), np.float32)
OTHER = {
    "TransformObservation": lambda env: wrappers.TransformObservation(env, np.tanh, UNIT),
    "TransformReward": lambda env: wrappers.TransformReward(
        env, lambda reward: float(reward) / 100
    ),
    "NormalizeReward": wrappers.NormalizeReward,
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.1),
}


@pytest.mark.parametrize("name", OTHER)
def test_another_wrapper_of_the_training_is_refused_by_name(task, name):
    with pytest.raises(RequestError, match=f"model: the environment .* differ by wrapper {name},"):
        from_stable_baselines(trained(environment=pole(OTHER[name])), task)


def test_a_wrapper_of_stable_baselines_is_refused_by_name(task):
    environment = VecFrameStack(DummyVecEnv([pole]), 1)
    with pytest.raises(RequestError, match="differ by wrapper VecFrameStack"):
        from_stable_baselines(trained(environment=environment), task)


def test_a_file_whose_model_saw_other_bounds_is_refused(task, tmp_path):
    trained(environment=pole(OTHER["TransformObservation"])).save(tmp_path / "model.zip")
    with (
        pytest.warns(ExpertWarning, match=NOT_KNOWN),
        pytest.raises(RequestError, match=r"trained on observations in Box\(-1\.0, 1\.0"),
    ):
        from_stable_baselines(tmp_path / "model.zip", task)


def test_a_task_with_the_same_wrappers_needs_nothing(registered_pole):
    name = registered_pole(wrappers.TransformReward.wrapper_spec(func=lambda reward: 10 * reward))
    task = make_task(name, discount=0.99)
    assert from_stable_baselines(trained(environment=gymnasium.make(name)), task).task == name
    with pytest.raises(RequestError, match="differ by wrapper TransformReward"):
        from_stable_baselines(trained(environment=pole()), task)


def acrobot_statistics():
    return VecNormalize(DummyVecEnv([lambda: gymnasium.make("Acrobot-v1")]), norm_reward=False)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: path / "absent.pkl", r"statistics .*absent\.pkl: not a file of VecNormalize"),
        (lambda path: path / "text.pkl", r"statistics .*text\.pkl: not a file of VecNormalize"),
        (lambda path: 5, "model: a int holds no statistics"),
        (
            lambda path: acrobot_statistics(),
            r"its statistics are of observations \(6,\); \(4,\) is needed",
        ),
    ],
)
def test_other_statistics_are_refused(task, tmp_path, make, message):
    (tmp_path / "text.pkl").write_text("no statistics")
    with pytest.raises(RequestError, match=message) as caught:
        from_stable_baselines(trained(), task, make(tmp_path))
    assert "\n" not in str(caught.value)
