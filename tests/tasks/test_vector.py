"""Tasks with vector observations, from any Gymnasium environment that has them."""

import dataclasses
import functools
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers
from gymnasium.envs.registration import EnvSpec

from qbumpers import RequestError, make_task
from qbumpers.tasks import VectorTask
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, TRUNCATED
from tests.narrowing import of_kind, present


class Corridor(gymnasium.Env):
    """Actions 5 and 6 go left and right: success at 2, crash at -2, cut off after `patience`."""

    def __init__(self, patience=100, observations=None, actions=None):
        self.observation_space = observations or spaces.Box(-9, 9, (2,), np.float64)
        self.action_space = actions or spaces.Discrete(2, start=5)
        self.patience = patience

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place, self.steps = 0, 0
        return np.array([self.place, self.np_random.random()]), {}

    def step(self, action):
        self.place += {5: -1, 6: 1}[int(action)]
        self.steps += 1
        info = {"success": self.place == 2, "crash": self.place == -2}
        observation = np.array([self.place, 0.1])
        return observation, 1, abs(self.place) == 2, self.steps >= self.patience, info


@pytest.fixture
def corridor():
    """The name of a registered environment of the tests."""
    gymnasium.register("Corridor-v0", entry_point=f"{__name__}:Corridor")
    yield "Corridor-v0"
    del gymnasium.registry["Corridor-v0"]


@pytest.mark.parametrize("name", ["CartPole-v1", "Acrobot-v1", "LunarLander-v3"])
def test_a_stepper_is_the_environment_itself(name):
    stepper = VectorTask.from_gymnasium(name, discount=0.99).make_stepper()
    environment = gymnasium.make(name)
    actions = of_kind(spaces.Discrete, environment.action_space).n
    generator = np.random.default_rng(0)
    for chance in generator.random(5):
        observation, _ = environment.reset(seed=int(chance * 2**32))
        mine, ended = stepper.reset(chance), False
        while not ended:
            assert mine.dtype == np.float32
            assert np.array_equal(mine, observation)
            action = int(generator.integers(actions))
            observation, reward, terminated, truncated, _ = environment.step(action)
            mine, my_reward, events = stepper.step(action)
            assert (my_reward, events) == (reward, TERMINATED * terminated)
            ended = terminated or truncated


def test_sizes_and_limits_are_the_environments():
    task = VectorTask.from_gymnasium("CartPole-v1", discount=0.9)
    assert (task.observation_size, task.actions, task.episode_limit) == (4, 2, 500)
    assert not task.has_success
    assert not task.has_crash
    shorter = VectorTask.from_gymnasium("CartPole-v1", discount=0.9, episode_limit=30)
    assert shorter.episode_limit == 30
    assert present(shorter.make_environment().spec).max_episode_steps == 30


def test_the_step_limit_is_left_to_the_simulator():
    stepper = VectorTask.from_gymnasium("MountainCar-v0", discount=1.0).make_stepper()
    stepper.reset(0.25)
    assert not any(stepper.step(1)[2] for _ in range(300))


def test_every_chance_has_its_episode():
    stepper = VectorTask.from_gymnasium("CartPole-v1", discount=0.9).make_stepper()
    first, second = stepper.reset(0.1), stepper.reset(0.7)
    assert not np.array_equal(first, second)
    assert np.array_equal(stepper.reset(0.1), first)
    assert np.array_equal(stepper.reset(np.nextafter(1, 0)), stepper.reset(np.nextafter(1, 0)))


def test_events_are_told_and_actions_count_from_zero(corridor):
    task = VectorTask.from_gymnasium(corridor, discount=0.9, episode_limit=50, patience=3)
    assert (task.has_success, task.has_crash) == (True, True)
    stepper = task.make_stepper()
    assert stepper.reset(0.5).dtype == np.float32
    assert [stepper.step(a)[2] for a in (1, 1)] == [0, TERMINATED | SUCCESS]
    stepper.reset(0.5)
    assert [stepper.step(a)[2] for a in (0, 0)] == [0, TERMINATED | CRASH]
    stepper.reset(0.5)
    assert [stepper.step(a)[2] for a in (0, 1, 0)] == [0, 0, TRUNCATED]
    observation, reward, _ = stepper.step(1)
    assert observation.tolist() == [0.0, np.float32(0.1)]
    assert type(reward) is float


def test_a_task_travels_to_other_processes():
    task = VectorTask.from_gymnasium("Acrobot-v1", discount=0.95)
    travelled = pickle.loads(pickle.dumps(task))
    assert travelled.digest() == task.digest()
    first = task.make_stepper().reset(0.3)
    assert np.array_equal(travelled.make_stepper().reset(0.3), first)


def test_the_digest_covers_what_decides_the_numbers(corridor):
    make = functools.partial(VectorTask.from_gymnasium, corridor, episode_limit=9)
    task = make(discount=0.9)
    assert make(discount=0.9).digest() == task.digest()
    others = [
        make(discount=0.8),
        make(discount=0.9, patience=7),
        dataclasses.replace(task, name="other"),
        dataclasses.replace(task, episode_limit=10),
        dataclasses.replace(task, observation_size=3),
        dataclasses.replace(task, actions=3),
    ]
    assert len({task.digest(), *(other.digest() for other in others)}) == 7


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Pendulum-v1", r"'Pendulum-v1': its action space is Box.*numbered actions"),
        ("CartPol-v1", r"'CartPol-v1': .*doesn't exist"),
    ],
)
def test_other_environments_are_refused(name, message):
    with pytest.raises(RequestError, match=message):
        VectorTask.from_gymnasium(name, discount=0.9)


def test_an_observation_that_its_space_does_not_hold_is_refused(corridor):
    pictures = spaces.Box(0, 255, (4, 4, 3), np.uint8)
    with pytest.raises(
        RequestError, match=r"space is Box.*uint8\); FlattenObservation .* no vector"
    ):
        make_task(corridor, discount=0.9, observations=pictures)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"discount": 1.5}, r"discount = 1\.5; it must lie in \(0, 1\]"),
        ({"discount": 0.9, "episode_limit": 0}, "episode_limit = 0; at least 1 is needed"),
        ({"discount": 0.9, "sutton": 3}, "'CartPole-v1': .*'sutton'"),
    ],
)
def test_wrong_numbers_are_named(arguments, message):
    with pytest.raises(RequestError, match=message):
        VectorTask.from_gymnasium("CartPole-v1", **arguments)


def test_an_environment_without_a_limit_needs_one(corridor):
    with pytest.raises(RequestError, match="Corridor-v0 has no step limit: give episode_limit"):
        VectorTask.from_gymnasium(corridor, discount=0.9)


def test_arguments_that_no_file_can_keep_are_refused(corridor):
    with pytest.raises(RequestError, match=r"Corridor-v0: settings = .*can be kept"):
        VectorTask.from_gymnasium(
            corridor, discount=0.9, episode_limit=9, actions=spaces.Discrete(2, start=5)
        )


NORMALISING = {
    "NormalizeObservation": wrappers.NormalizeObservation.wrapper_spec(),
    "NormalizeReward": wrappers.NormalizeReward.wrapper_spec(),
}


def made_from(kind: Any) -> Any:
    """An entry point, by any name that the type checker takes."""
    return kind


@pytest.fixture
def wrapped(corridor):
    """Registers the corridor with a wrapper, and forgets it."""

    def register(spec, **arguments):
        gymnasium.register(
            "Wrapped-v0", entry_point=made_from(Corridor), max_episode_steps=9,
            additional_wrappers=(spec,), kwargs=arguments,
        )  # fmt: skip
        return "Wrapped-v0"

    yield register
    del gymnasium.registry["Wrapped-v0"]


@pytest.mark.parametrize("name", NORMALISING)
def test_a_wrapper_that_remembers_earlier_episodes_is_refused(wrapped, name):
    message = f"'Wrapped-v0': an episode went another way when .*is it wrapper {name}"
    with pytest.raises(RequestError, match=message):
        make_task(wrapped(NORMALISING[name]), discount=0.9)


def test_a_wrapper_that_remembers_nothing_is_part_of_the_environment(wrapped):
    tenfold = wrappers.TransformReward.wrapper_spec(func=lambda reward: 10 * reward)
    stepper = make_task(wrapped(tenfold), discount=0.9).make_stepper()
    stepper.reset(0.5)
    assert stepper.step(1)[1] == 10.0


class Unseeded(Corridor):
    """Draws from a generator that no seed reaches."""

    def reset(self, *, seed=None, options=None):
        observation, info = super().reset(seed=seed)
        return observation + np.random.default_rng().random(), info


def test_chance_that_no_seed_reaches_is_refused(monkeypatch):
    spec = EnvSpec("Unseeded-v0", made_from(Unseeded), max_episode_steps=9)
    monkeypatch.setitem(gymnasium.registry, "Unseeded-v0", spec)
    with pytest.raises(RequestError, match="'Unseeded-v0': an episode went another way") as caught:
        make_task("Unseeded-v0", discount=0.9)
    assert "wrapper" not in str(caught.value)


def test_its_actions_are_numbered_as_the_environments(corridor):
    task = make_task(corridor, discount=0.9, episode_limit=5)
    assert task.action_space == spaces.Discrete(2, start=5)
