"""The picture of the lander beside Gymnasium's own of the same episode."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.box2d import lunar_lander as original

import qbumpers  # noqa: F401 - registers the environment
from qbumpers.errors import RequestError
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.displays.lunar_lander import HULL, lunar_lander_display
from qbumpers.tasks.drawing import picture
from tests.tasks.shown import middle, near

NOTHING, LEFT, MAIN, RIGHT = range(4)
FLAME = "#e8542c"


def flown(seed: int | None, steps: int, noise: float = 0.3) -> tuple[Any, np.ndarray]:
    """Gymnasium's environment, drawable, after some steps of its heuristic with random ones."""
    environment: Any = gymnasium.make(
        "qbumpers/LunarLander-v0", seed=seed, render_mode="rgb_array"
    ).unwrapped
    chance = np.random.default_rng(1)
    observation, _ = environment.reset()
    for _ in range(steps):
        action = int(original.heuristic(environment, observation))
        if chance.random() < noise:
            action = int(chance.integers(4))
        observation, *_ = environment.step(action)
    return environment, observation


def gymnasiums(environment: Any) -> np.ndarray:
    """Gymnasium's own picture, [400, 600, 3], without the sparks of the engines."""
    environment._clean_particles(True)
    seen: Any = original.LunarLander.render(environment)
    return seen


def ours(seed: int | None, observation: np.ndarray, action: int = NOTHING) -> np.ndarray:
    step = unassisted_step(observation, action, 0.0, observation)
    return picture(lunar_lander_display(seed), observation, step)


def body(seen: np.ndarray) -> np.ndarray:
    """Hull, legs and window."""
    return near(seen, HULL) | near(seen, "#bfe0f5")


@pytest.mark.parametrize("steps", [50, 65, 80, 100, 130])
@pytest.mark.parametrize("seed", [None, 3])
def test_the_lander_is_within_two_pixels_of_gymnasiums(seed, steps):
    environment, observation = flown(seed, steps)
    theirs, mine = near(gymnasiums(environment), HULL), body(ours(seed, observation))
    assert theirs.sum() > 500
    assert middle(mine) == pytest.approx(middle(theirs), abs=2)


def test_the_hull_turns_as_gymnasiums_does():
    environment, observation = flown(None, 60, noise=0.9)
    assert abs(observation[4]) > 0.2
    theirs = near(gymnasiums(environment), HULL)

    def shared(turned: float) -> float:
        """Pixels in both bodies as a share of those in either, ours turned by so much."""
        mine = observation.copy()
        mine[4] += turned
        seen = body(ours(None, mine))
        return (theirs & seen).sum() / (theirs | seen).sum()

    assert shared(0) > 0.7  # feet and borders are only in one
    assert shared(0) > max(shared(-0.2), shared(0.2)) + 0.1


@pytest.mark.parametrize("seed", [None, 0, 3])
def test_the_terrain_is_gymnasiums(seed):
    environment, observation = flown(seed, 1)
    white = near(gymnasiums(environment), "#ffffff")
    grey = np.all(ours(seed, observation) > 170, axis=2)
    for x in range(0, 600, 7):
        if not 210 < x < 390:  # pad and flags
            assert surface(grey, x) == pytest.approx(surface(white, x), abs=3)


def surface(ground: np.ndarray, x: int) -> int:
    """The row in which the sky above the ground ends: the lowest one that is sky, or the pad."""
    sky = np.flatnonzero(~ground[:, x])
    return int(sky[-1])


def test_flags_stand_at_both_ends_of_the_pad():
    environment, observation = flown(None, 1)
    flags = [
        near(seen, "#cccc00", 20) for seen in (gymnasiums(environment), ours(None, observation))
    ]
    theirs, mine = ((middle(flag[:, :300]), middle(flag[:, 300:])) for flag in flags)
    for place in range(2):
        assert mine[place] == pytest.approx(theirs[place], abs=3)


@pytest.mark.parametrize("action", range(4))
def test_there_is_a_flame_if_and_only_if_an_engine_fired(action):
    observation = np.array([0.1, 0.6, 0, 0, 0, 0, 0, 0], np.float32)
    seen = ours(None, observation, action)
    flame = near(seen, FLAME)
    assert flame.any() == (action != NOTHING)
    if action == NOTHING:
        return
    (x, y), (hull_x, hull_y) = middle(flame), middle(near(seen, HULL))
    # An engine pushes away from its flame.
    beside = {LEFT: x > hull_x + 15, MAIN: y > hull_y + 15, RIGHT: x < hull_x - 15}
    assert [name for name, there in beside.items() if there] == [action]


def test_nothing_burns_before_the_first_step():
    observation = np.array([0, 0.6, 0, 0, 0, 0, 0, 0], np.float32)
    seen = picture(lunar_lander_display(), observation)
    assert not near(seen, FLAME).any()


@pytest.mark.parametrize("leg", [0, 1])
def test_the_foot_that_touches_the_ground_is_lit(leg):
    observation = np.array([0, 0.5, 0, 0, 0, 0, 0, 0], np.float32)
    observation[6 + leg] = 1
    environment, _ = flown(None, 1)
    lit = middle(near(ours(None, observation), "#ffd24a", 20))[0]
    # Gymnasium numbers the legs; where it puts them tells which is on which side.
    side = environment.legs[leg].position.x - environment.lander.position.x
    assert np.sign(lit - 300) == np.sign(side)


def test_a_seed_that_is_no_seed_is_refused():
    with pytest.raises(RequestError, match="seed = -1"):
        lunar_lander_display(-1)


def test_legs_spread_when_the_hull_comes_down_between_them():
    observation = np.array([0, -0.04, 0, 0, 0, 0, 1, 1], np.float32)  # as low as a hard landing
    high = observation + np.array([0, 0.5, 0, 0, 0, 0, 0, 0], np.float32)
    low, free = (near(ours(None, seen), "#ffd24a", 20) for seen in (observation, high))
    assert np.nonzero(low)[0].max() <= 301 + 2  # the surface of the pad
    assert width(low) > width(free) + 2


def width(mask: np.ndarray) -> int:
    """Columns from the first to the last of a mask."""
    columns = np.nonzero(mask)[1]
    return int(columns.max() - columns.min())
