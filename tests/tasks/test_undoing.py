"""Steps taken back: what follows is as if they had never been."""

import functools

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers
from gymnasium.envs.registration import EnvSpec, WrapperSpec

from qbumpers import RequestError, make_task
from qbumpers.tasks import TabularEnvironment, VectorTask, cliff_walking
from qbumpers.tasks.stepping import GymnasiumStepper
from qbumpers.tasks.undoing import reached_limit, undo_of
from tests.narrowing import of_kind
from tests.tasks.examples import random_task

LANDER = "qbumpers/LunarLander-v0"


class Counter(gymnasium.Env):
    """Counts the steps; the only state is the count."""

    observation_space = spaces.Box(-9, 9, (1,), np.float32)
    action_space = spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        return self._observation(), {}

    def step(self, action):
        self.count += 1
        return self._observation(), 1.0, False, False, {}

    def _observation(self):
        return np.array([self.count], np.float32)


class UndoableCounter(Counter):
    """A counter whose steps can be taken back."""

    def snapshot(self):
        return self.count

    def restore(self, snapshot):
        self.count = snapshot


class Echo(gymnasium.Wrapper):
    """Adds the observation before to every observation: it has a state of its own."""

    def reset(self, **arguments):
        observation, info = self.env.reset(**arguments)
        self.before = observation
        return observation, info

    def step(self, action):
        observation, reward, terminated, truncated, info = self.env.step(action)
        echoed, self.before = observation + self.before, observation
        return echoed, reward, terminated, truncated, info


class UndoableEcho(Echo):
    """Puts its own state back too."""

    def snapshot(self):
        return self.before, undo_of(self.env)[0]()

    def restore(self, snapshot):
        self.before = snapshot[0]
        undo_of(self.env)[1](snapshot[1])


class HalfEcho(Echo):
    """Forgot one of the two methods."""

    def snapshot(self):
        return self.before


class RunningSum(wrappers.TransformObservation):
    """A wrapper of a user, derived from one of Gymnasium's, with a state of its own."""

    def __init__(self, env):
        super().__init__(env, self._added, env.observation_space)
        self.sum = np.zeros(1, np.float32)

    def _added(self, observation):
        self.sum = self.sum + observation
        return self.sum


class UndoableRunningSum(RunningSum):
    """The same with the two methods."""

    def snapshot(self):
        return self.sum, undo_of(self.env)[0]()

    def restore(self, snapshot):
        self.sum = snapshot[0]
        undo_of(self.env)[1](snapshot[1])


HARMLESS = [
    wrappers.PassiveEnvChecker,
    wrappers.OrderEnforcing,
    functools.partial(wrappers.TimeLimit, max_episode_steps=50),
    wrappers.RecordEpisodeStatistics,
    functools.partial(wrappers.TransformReward, func=lambda reward: 2 * float(reward)),
    functools.partial(wrappers.ClipReward, min_reward=0),
    functools.partial(
        wrappers.TransformAction, func=lambda action: 1 - action, action_space=spaces.Discrete(2)
    ),
    functools.partial(
        wrappers.TransformObservation,
        func=lambda observation: -observation,
        observation_space=Counter.observation_space,
    ),
    UndoableRunningSum,
    UndoableEcho,
]


@pytest.mark.parametrize("wrap", HARMLESS)
def test_a_step_is_taken_back_through_wrappers(wrap):
    environment, same = wrap(UndoableCounter()), wrap(UndoableCounter())
    snapshot, restore = undo_of(environment)
    environment.reset(seed=0)
    same.reset(seed=0)
    for _ in range(3):
        before = snapshot()
        environment.step(0)
        restore(before)
        assert environment.step(1)[:2] == same.step(1)[:2]


def test_a_step_is_taken_back_through_several_wrappers():
    environment = UndoableCounter()
    for wrap in HARMLESS:
        environment = wrap(environment)
    snapshot, restore = undo_of(environment)
    environment.reset(seed=0)
    before = snapshot()
    observation = environment.step(0)[0]
    environment.step(0)
    restore(before)
    assert np.array_equal(environment.step(1)[0], observation)


@pytest.mark.parametrize(
    ("wrap", "name"),
    [
        (Echo, "Echo"),
        (RunningSum, "RunningSum"),
        (HalfEcho, "HalfEcho"),
        (functools.partial(wrappers.DelayObservation, delay=1), "DelayObservation"),
        (functools.partial(wrappers.FrameStackObservation, stack_size=2), "FrameStackObservation"),
        (wrappers.NormalizeReward, "NormalizeReward"),
    ],
)
def test_a_wrapper_that_may_keep_something_is_named(wrap, name):
    environment = wrappers.OrderEnforcing(wrap(UndoableCounter()))
    with pytest.raises(RequestError, match=f"wrapper {name} may keep something"):
        undo_of(environment)


def test_an_environment_without_the_methods_is_named():
    for environment in (Counter(), gymnasium.make("CartPole-v1")):
        name = type(environment.unwrapped).__name__
        with pytest.raises(RequestError, match=f"environment {name} has no methods snapshot and"):
            undo_of(environment)


def test_an_undone_step_counts_towards_the_limit():
    environment = wrappers.OrderEnforcing(
        wrappers.TimeLimit(UndoableCounter(), max_episode_steps=3)
    )
    assert not reached_limit(environment)
    environment.reset()
    snapshot, restore = undo_of(environment)
    reached, truncated = [], []
    for _ in range(3):
        before = snapshot()
        truncated.append(environment.step(0)[3])
        restore(before)
        reached.append(reached_limit(environment))
    assert reached == truncated == [False, False, True]
    environment.reset()
    assert not reached_limit(environment)


def test_an_environment_without_a_limit_never_reaches_one():
    environment = UndoableCounter()
    environment.reset()
    environment.step(0)
    assert not reached_limit(environment)


def test_the_state_of_a_table_is_put_back():
    environment = cliff_walking().make_environment()
    snapshot, restore = undo_of(environment)
    start, _ = environment.reset(seed=0)
    up, right = 0, 1
    before = snapshot()
    assert environment.step(right)[1] == -100
    restore(before)
    assert snapshot() == start
    environment.step(up)
    before = snapshot()
    environment.step(right)
    restore(before)
    assert environment.step(up)[0] == start - 24


def test_chance_goes_on_after_an_undone_step_of_a_table():
    task = random_task(1, 6, 2)
    environment = TabularEnvironment(task)
    environment.reset(seed=0)
    before = environment.snapshot()
    reached = set()
    for _ in range(200):
        reached.add(environment.step(0)[0])
        environment.restore(before)
    possible = task.probability[before, 0] > 0
    assert reached == set(task.next_state[before, 0][possible].tolist())


@pytest.fixture
def counters():
    """Names of registered environments of the tests: one whose steps can be undone, one not."""
    names = {"Counter-v0": Counter, "UndoableCounter-v0": UndoableCounter}
    for name, make in names.items():
        gymnasium.register(name, entry_point=make, max_episode_steps=9)
    yield
    for name in names:
        del gymnasium.registry[name]


@pytest.mark.usefixtures("counters")
def test_a_task_finds_out_whether_its_steps_can_be_undone():
    plain = VectorTask.from_gymnasium("Counter-v0", discount=0.9)
    assert not plain.undoable
    with pytest.raises(RequestError, match="environment Counter has no methods snapshot"):
        of_kind(GymnasiumStepper, plain.make_stepper()).snapshot()
    task = VectorTask.from_gymnasium("UndoableCounter-v0", discount=0.9)
    assert task.undoable
    stepper = of_kind(GymnasiumStepper, task.make_stepper())
    stepper.reset(0.5)
    stepper.step(0)
    before = stepper.snapshot()
    stepper.step(0)
    stepper.restore(before)
    assert stepper.step(1)[0].tolist() == [2.0]


@pytest.mark.usefixtures("counters")
def test_steps_cannot_be_undone_if_a_wrapper_of_the_environment_keeps_something():
    spec = gymnasium.spec("UndoableCounter-v0")
    echo = WrapperSpec("Echo", f"{__name__}:Echo", {})
    gymnasium.registry["Counter-v0"] = EnvSpec(
        "Counter-v0", spec.entry_point, max_episode_steps=9, additional_wrappers=(echo,)
    )
    assert not VectorTask.from_gymnasium("Counter-v0", discount=0.9).undoable


def test_steps_of_the_lander_can_be_undone():
    assert make_task("lunar-lander").undoable
    assert make_task(LANDER, discount=0.99).undoable
    assert not make_task("LunarLander-v3", discount=0.99).undoable
