"""Lunar Lander for Gymnasium and as a task."""

import pickle
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from qbumpers import RequestError, make_task
from qbumpers.tasks import VectorTask
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.drawing import picture
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED
from qbumpers.tasks.lunar_lander.stepper import Lander
from tests.narrowing import present
from tests.tasks.landing import actions_of

NAME = "qbumpers/LunarLander-v0"


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
@pytest.mark.parametrize("seed", [None, 5])
@pytest.mark.parametrize("policy", ["random", "landing"])
def test_people_and_simulators_have_the_same_episode(seed, policy, render_mode):
    environment = gymnasium.make(NAME, seed=seed, render_mode=render_mode)
    stepper, choose = Lander(seed), actions_of(policy, 0)
    for episode in range(3):
        observation, info = environment.reset(seed=episode)
        mine, ended = stepper.reset(0.0), False
        assert info == {"success": False, "crash": False}
        while not ended:
            assert mine.tobytes() == observation.tobytes()
            action = choose(observation)
            observation, reward, ended, truncated, info = environment.step(action)
            mine, my_reward, events = stepper.step(action)
            assert (reward, truncated) == (my_reward, False)
            assert events == TERMINATED * ended | SUCCESS * info["success"] | CRASH * info["crash"]
        assert info == {"success": policy == "landing", "crash": policy == "random"}
        assert mine.tobytes() == observation.tobytes()
    environment.close()


def test_its_picture_is_that_of_its_display():
    environment = gymnasium.make(NAME, render_mode="rgb_array", seed=3)
    observation, _ = environment.reset(seed=3)
    for action in (2, 2, 3, 0, 1):
        before = observation
        observation, reward, *_ = environment.step(action)
    shown = make_task("lunar-lander", seed=3).display
    step = unassisted_step(before, 1, float(reward), observation)
    found: Any = environment.render()
    assert found.shape == (400, 600, 3)
    assert np.array_equal(found, picture(shown, observation, step))
    assert not np.array_equal(found, picture(shown, before, None))


@pytest.mark.parametrize("seed", [None, 0])
def test_gymnasium_finds_nothing_wrong(seed):
    environment = gymnasium.make(NAME, seed=seed)
    check_env(environment.unwrapped, skip_render_check=True)
    assert present(environment.spec).max_episode_steps == 1000


def test_the_task():
    task = make_task("lunar-lander")
    assert isinstance(task, VectorTask)
    assert (task.name, task.observation_size, task.actions) == ("lunar-lander", 8, 4)
    assert (task.discount, task.episode_limit) == (0.99, 1000)
    assert task.has_success
    assert task.has_crash
    assert make_task("lunar-lander").digest() == task.digest()
    assert make_task("lunar-lander", seed=0).digest() != task.digest()


@pytest.mark.parametrize("seed", [None, 2])
def test_the_task_travels_to_other_processes(seed):
    task = make_task("lunar-lander", seed=seed)
    travelled = pickle.loads(pickle.dumps(task))
    assert travelled.digest() == task.digest()
    assert travelled.make_stepper().reset(0.0).tobytes() == Lander(seed).reset(0.0).tobytes()
    environment = travelled.make_environment(render_mode="rgb_array")
    assert environment.reset()[0].tobytes() == Lander(seed).reset(0.0).tobytes()
    environment.close()


def test_wrong_arguments_are_named():
    with pytest.raises(RequestError, match=r"'lunar-lander': .*'wind'; its arguments are: seed"):
        make_task("lunar-lander", wind=3)
    with pytest.raises(RequestError, match=r"'lunar-lander': .*'discount'"):
        make_task("lunar-lander", discount=0.9)
    with pytest.raises(RequestError, match="seed = -3"):
        make_task("lunar-lander", seed=-3)
    with pytest.raises(RequestError, match="seed = -3"):
        gymnasium.make(NAME, seed=-3)


@pytest.mark.parametrize(
    "make",
    [
        f"gymnasium.make('{NAME}')",
        "make_task('lunar-lander')",
        "make_task('LunarLander-v3', discount=0.99)",
    ],
)
def test_without_box2d_the_extra_is_named(make):
    printed = run(
        "import sys, gymnasium",
        "sys.modules['Box2D'] = None",
        "from qbumpers import RequestError, make_task",
        f"try: {make}",
        "except RequestError as error: print(error)",
    )
    assert "Box2D" in printed
    assert "pip install 'qbumpers[lunar]'" in printed


def test_box2d_loads_when_it_is_used():
    printed = run(
        "import sys, qbumpers.tasks, qbumpers",
        "qbumpers.make_task('cliff-walking')",
        "print(sorted({'Box2D', 'pygame'} & set(sys.modules)))",
    )
    assert printed.strip() == "[]"


def run(*lines):
    """What another process prints."""
    finished = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True
    )
    return finished.stdout
