"""Mountain Car against Gymnasium's, and what its expert's values make of moving away."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from qbumpers import make_assistant, shipped_expert
from qbumpers.decisions import Noise, Situation
from qbumpers.experts.checking import mean_with_error
from qbumpers.experts.episodes import play_several
from qbumpers.tasks import make_task
from qbumpers.tasks.dynamics import SUCCESS, TERMINATED
from tests.tasks.shown import near

LEFT, NOTHING, RIGHT = range(3)
BOTTOM = -np.pi / 6  # of the valley, where sin(3 x) is least


def with_the_motion(observation):
    """Push where the car is going: solves the task (Sutton and Barto 2018, Example 10.1)."""
    return RIGHT if observation[1] >= 0 else LEFT


def test_its_steps_are_those_of_gymnasium():
    stepper = make_task("mountain-car").make_stepper()
    original = gymnasium.make("MountainCar-v0")
    for chance in (0.1, 0.9):
        observation = stepper.reset(chance)
        expected, _ = original.reset(seed=int(chance * 2**32))
        ended = False
        while not ended:
            assert np.array_equal(observation, expected)
            action = with_the_motion(observation)
            observation, reward, events = stepper.step(action)
            expected, cost, ended, _, _ = original.step(action)
            assert (reward, events) == (cost, (TERMINATED | SUCCESS) * ended)


def test_the_environment_passes_gymnasiums_checks_and_tells_its_success():
    environment = gymnasium.make("qbumpers/MountainCar-v0", render_mode="rgb_array")
    check_env(environment.unwrapped, skip_render_check=True)
    observation, info = environment.reset(seed=0)
    told = [info]
    ended = False
    while not ended:
        action = with_the_motion(observation)
        observation, _, ended, truncated, info = environment.step(action)
        assert not truncated
        told.append(info)
    assert told == [{"success": False, "crash": False}] * (len(told) - 1) + [
        {"success": True, "crash": False}
    ]


def test_it_is_drawn_with_its_car():
    environment = gymnasium.make("qbumpers/MountainCar-v0", render_mode="rgb_array")
    environment.reset(seed=0)
    shown = environment.render()
    assert isinstance(shown, np.ndarray)
    assert shown.shape == (400, 600, 3)
    x = np.argwhere(near(shown, "#d9534f"))[:, 1].mean()
    assert 0.25 < x / 600 < 0.5  # in the valley, which lies left of the middle


def test_its_steps_can_be_undone():
    stepper = make_task("mountain-car").make_stepper()
    stepper.reset(0.3)
    stepper.step(LEFT)
    place = stepper.snapshot()  # type: ignore[attr-defined]
    first = [stepper.step(action)[0] for action in (RIGHT, RIGHT, NOTHING)]
    stepper.restore(place)  # type: ignore[attr-defined]
    again = [stepper.step(action)[0] for action in (RIGHT, RIGHT, NOTHING)]
    assert np.array_equal(first, again)


def test_the_expert_that_ships_solves_it():
    """Gymnasium counts -110 and more as solved; the mean of 100 episodes has an error below 2."""
    task, expert = make_task("mountain-car"), shipped_expert("mountain-car")
    assert expert.made_for == task.identity()
    episodes = play_several(task, expert, 100, seed=11)
    found = mean_with_error(np.array([episode.rewards.sum() for episode in episodes]))
    assert found.error < 2
    assert found.mean - 3 * found.error > -110
    assert all(episode.success for episode in episodes)


def overriding(name: str, options: dict, observation: list[float], proposed: int) -> float:
    """Probability that an assistant overrides an action at the beginning of an episode."""
    values = shipped_expert("mountain-car")(np.array(observation, np.float32))
    situation = Situation(
        state=np.array(observation, np.float32), values=values, others=np.zeros((0, 3)),
        proposed=proposed, earned=0.0, discount=1.0, start_value=float(values.max()),
        episode=0, step=0,
    )  # fmt: skip
    assistant = make_assistant(name, **options)
    return assistant.decide(situation, Noise(coin=0.5, tie=0.5)).probability


@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.9])
def test_at_rest_in_the_valley_thresholding_forbids_moving_away_and_bumpers_do_not(alpha):
    """Of the expert's values; moving away costs less than a step there, but nothing is worse."""
    for place in (BOTTOM, -0.5):
        at_rest = [place, 0.0]
        assert overriding("local-q-thresholding", {"alpha": alpha}, at_rest, LEFT) == 1.0
        bumpers = {"alpha": 0.5, "v_min": -87.0}
        assert overriding("stochastic-q-bumpers", bumpers, at_rest, LEFT) < 0.01


@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.9])
def test_once_it_rolls_back_thresholding_forbids_pushing_to_the_goal(alpha):
    rolling = [BOTTOM, -0.01]
    options = {"alpha": alpha}
    assert overriding("local-q-thresholding", options, rolling, LEFT) == 0.0
    assert overriding("local-q-thresholding", options, rolling, RIGHT) == 1.0
