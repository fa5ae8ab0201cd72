"""The experts that ship: how often the lander's lands, and where each comes from.

`tests/tasks/test_mountain_car.py` lets the other one drive.
"""

import gymnasium
import numpy as np
import pytest

import qbumpers
from qbumpers.experts import train_expert
from qbumpers.experts.selecting import make_recipe
from qbumpers.tasks.remapping import remapped
from qbumpers.values import shipped_expert, shipped_values

LANDER = "qbumpers/LunarLander-v0"


def lands(expert, environment, generator, epsilon):
    """Whether an episode in the environment for participants ends in a landing."""
    observation, _ = environment.reset()
    while True:
        action = int(np.argmax(expert(observation)))
        if generator.random() < epsilon:
            action = int(generator.integers(4))
        observation, _, terminated, truncated, info = environment.step(action)
        if terminated or truncated:
            return info["success"]


@pytest.mark.slow
def test_it_lands_nearly_always_with_some_random_actions():
    """True rate at least 0.98 if it is as good as its record; 200 episodes then rarely miss 10."""
    expert, generator = shipped_expert("lunar-lander"), np.random.default_rng(5)
    environment = gymnasium.make(LANDER)
    landed = [lands(expert, environment, generator, 0.02) for _ in range(200)]
    assert np.mean(landed) >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), [("lunar-lander", 7), ("mountain-car", 6)])
def test_the_command_that_made_it_makes_it_again(name, seed):
    shipped, task = shipped_expert(name), qbumpers.make_task(name)
    assert f"seed {seed}; the best of seeds 0, 1, 2, 3, 4, 5, 6, 7, 8, 9;" in shipped.method
    again = train_expert(task, make_recipe(task), seed=seed)
    assert np.array_equal(again.parameters, shipped.parameters)


def test_a_remapped_task_has_the_expert_of_the_other_one_and_others_their_own():
    task = qbumpers.make_task("mountain-car")
    observation = np.array([-0.6, 0.01], np.float32)
    expert = shipped_expert("mountain-car")(observation)
    assert np.array_equal(shipped_values(task)(observation), expert)
    turned = shipped_values(remapped(task, (2, 1, 0)))(observation)
    assert turned == pytest.approx(expert[::-1], rel=1e-6)
