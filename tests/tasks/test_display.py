"""Displays are plain data, and their names and keys do what they say."""

import json
import pickle
import re
from typing import Any

import gymnasium
import numpy as np
import pytest

from qbumpers.tasks import TabularEnvironment, make_task
from qbumpers.tasks.display import Display, unassisted_step
from qbumpers.tasks.displays.by_environment import display_maker
from qbumpers.tasks.displays.plain import plain_display
from tests.tasks.examples import random_task
from tests.tasks.shown import ENVIRONMENTS, display_of, environment_of

PLAIN = "a table"
ALL = [*ENVIRONMENTS, PLAIN]


def shown(name: str) -> tuple[Display, Any]:
    if name == PLAIN:
        task = random_task(1, 7, 36)
        return plain_display(task), TabularEnvironment(task)
    return display_of(name), environment_of(name)


def walk(name: str, steps: int = 30):
    """States of random actions, each with the step that led there."""
    _, environment = shown(name)
    chance = np.random.default_rng(0)
    state, _ = environment.reset(seed=0)
    yield state, None
    for _ in range(steps):
        action = int(chance.integers(environment.action_space.n))
        following, reward, terminated, truncated, _ = environment.step(action)
        yield following, unassisted_step(state, action, float(reward), following)
        state = environment.reset()[0] if terminated or truncated else following


def colours(shape):
    return [shape[field] for field in ("colour", "outline") if field in shape]


@pytest.mark.parametrize("name", ALL)
def test_every_shape_is_json_of_a_known_kind_and_survives_being_sent(name):
    display, _ = shown(name)
    assert json.loads(json.dumps(display.backdrop)) == list(display.backdrop)
    for state, step in walk(name):
        shapes = display.scene(state, step)
        assert json.loads(json.dumps(shapes)) == list(shapes)
        for shape in (*display.backdrop, *shapes):
            assert shape["kind"] in {"polygon", "line", "circle", "text"}
            assert all(re.fullmatch("#[0-9a-f]{6}", colour) for colour in colours(shape))
            assert all(len(point) == 2 for point in shape["points"])
            assert np.isfinite(shape["points"]).all()
            one_point = shape["kind"] in {"circle", "text"}
            assert (len(shape["points"]) == 1) == one_point
            assert ("size" in shape) == one_point
            assert ("text" in shape) == (shape["kind"] == "text")


@pytest.mark.parametrize("name", ALL)
def test_every_action_has_a_name_of_its_own_and_a_key(name):
    display, environment = shown(name)
    assert len(set(display.actions)) == len(display.actions) == environment.action_space.n
    assert set(display.keys.values()) == set(range(environment.action_space.n))


@pytest.mark.parametrize("name", ALL)
def test_real_time_displays_have_an_idle_action_and_others_none(name):
    display, _ = shown(name)
    alone = display.idle in range(len(display.actions))  # an action leaves the task alone
    assert alone == (display.rate > 0 and name != "CartPole-v1")
    assert display.rate in {0, 25, 30, 50}


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_what_makes_a_display_can_be_pickled_and_makes_the_same(name):
    display = display_of(name)
    again = pickle.loads(pickle.dumps(display_maker(environment_of(name))))(None)
    assert again._replace(scene=display.scene, words=display.words) == display


def test_an_environment_that_nobody_drew_has_no_display_of_its_own():
    assert display_maker(gymnasium.make("Acrobot-v1")) is None


GRIDS = ["CliffWalking-v1", "qbumpers/CliffWalking-v0", "FrozenLake8x8-v1", "Taxi-v4"]
MOVES = {
    "up": (["ArrowUp", "KeyW"], (-1, 0)),
    "right": (["ArrowRight", "KeyD"], (0, 1)),
    "down": (["ArrowDown", "KeyS"], (1, 0)),
    "left": (["ArrowLeft", "KeyA"], (0, -1)),
}


def cell(name: str, state: int) -> tuple[int, int]:
    if name == "Taxi-v4":
        row, column, *_ = environment_of(name).unwrapped.decode(state)
        return row, column
    row, column = divmod(state, 8 if "8x8" in name else 12)
    return row, column


@pytest.mark.parametrize("direction", MOVES)
@pytest.mark.parametrize("name", GRIDS)
def test_arrows_and_wasd_move_the_way_they_point(name, direction):
    environment: Any = gymnasium.make(name, **({"is_slippery": False} if "Lake" in name else {}))
    display = display_of(name)
    keys, (down, right) = MOVES[direction]
    for key in keys:
        assert display.actions[display.keys[key]] == direction
        state = {"Taxi-v4": environment.unwrapped.encode(2, 2, 0, 1)} if "Taxi" in name else {}
        environment.reset(seed=0)
        inner = environment.unwrapped
        before = state.get(name, 18 if "8x8" in name else 17)
        setattr(inner, "_state" if name.startswith("qbumpers") else "s", before)
        after, *_ = environment.step(display.keys[key])
        row, column = cell(name, before)
        assert cell(name, int(after)) == (row + down, column + right)


def test_p_picks_the_passenger_up_and_o_drops_them_off():
    environment = environment_of("Taxi-v4")
    keys = display_of("Taxi-v4").keys
    for pick, drop in (("KeyP", "KeyO"), ("Space", "Enter")):
        environment.reset(seed=0)
        environment.unwrapped.s = environment.unwrapped.encode(0, 0, 0, 1)
        state, *_ = environment.step(keys[pick])
        assert environment.unwrapped.decode(state) == (0, 0, 4, 1)
        state, *_ = environment.step(keys[drop])
        assert environment.unwrapped.decode(state) == (0, 0, 0, 1)


@pytest.mark.parametrize(
    ("name", "velocity"),
    [("CartPole-v1", 1), ("MountainCar-v0", 1), ("qbumpers/LunarLander-v0", 2)],
)
def test_left_and_right_push_left_and_right(name, velocity):
    display, environment = display_of(name), environment_of(name)

    def pushed(key: str) -> float:
        observation, _ = environment.reset(seed=0)
        for _ in range(5):
            observation, *_ = environment.step(display.keys[key])
        return float(observation[velocity])

    for left, right in (("ArrowLeft", "ArrowRight"), ("KeyA", "KeyD")):
        assert pushed(left) < pushed(right)


def test_the_main_engine_pushes_up_and_idle_falls():
    environment, display = (
        environment_of("qbumpers/LunarLander-v0"),
        display_of("qbumpers/LunarLander-v0"),
    )

    def rising(action: int) -> float:
        observation, _ = environment.reset()
        for _ in range(10):
            observation, *_ = environment.step(action)
        return float(observation[3])

    assert display.actions[display.idle] == "nothing"
    for key in ("ArrowUp", "KeyW"):
        assert rising(display.keys[key]) > rising(display.idle) + 0.1


def test_a_plain_display_has_digits_and_numbered_names():
    display = plain_display(random_task(1, 5, 3))
    assert display.actions == ("action 0", "action 1", "action 2")
    assert display.keys == {"Digit1": 0, "Digit2": 1, "Digit3": 2}


def test_a_plain_display_tells_the_state_and_what_the_last_step_brought():
    display = plain_display(random_task(1, 5, 3))
    assert [shape.get("text") for shape in display.scene(4, None)] == ["state 4"]
    texts = [shape.get("text") for shape in display.scene(2, unassisted_step(4, 1, -0.5, 2))]
    assert texts == ["state 2", "action 1, reward -0.5"]


def test_a_plain_display_of_cells_numbers_them_row_by_row():
    class Cells:
        states, actions, grid = 6, 2, (2, 3)

    numbers = [shape for shape in plain_display(Cells()).backdrop if shape["kind"] == "text"]
    places = {shape.get("text"): shape["points"][0] for shape in numbers}
    assert places == {
        str(3 * row + column): [64 * column + 32, 64 * row + 32]
        for row in range(2)
        for column in range(3)
    }


@pytest.mark.parametrize("name", ALL)
def test_a_state_is_said_in_a_few_plain_words(name):
    display, _ = shown(name)
    said = [display.words(state) for state, _ in walk(name)]
    assert all(0 < len(words) < 160 and "\n" not in words for words in said)
    assert len(set(said)) > 1


@pytest.mark.parametrize(
    ("task", "state", "words"),
    [
        ("cliff-walking", 36, "row 4 of 4, column 1 of 12, the start"),
        ("cliff-walking", 47, "row 4 of 4, column 12 of 12, the goal"),
        ("frozen-lake", 5, "row 2 of 4, column 2 of 4, a hole"),
        ("inventory", 3, "3 of 9 in stock"),
        (
            "lunar-lander",
            [0.5, 1.25, 0.1, -0.4, -0.1, 0, 0, 0],
            "height 1.2, to the right of the pad, falling at 0.4, drifting right at 0.1, "
            "leaning 6 degrees right",
        ),
        (
            "lunar-lander",
            [0.0, 0.0, -0.2, 0.3, 0.2, 0, 1, 0],
            "1 of 2 legs on the ground, above the pad, rising at 0.3, drifting left at 0.2, "
            "leaning 11 degrees left",
        ),
        ("mountain-car", [-0.5, 0.01], "car 1.0 left of the flag, rolling right"),
    ],
)
def test_words_say_where_things_are(task, state, words):
    given = state if isinstance(state, int) else np.array(state, np.float32)
    assert make_task(task).display.words(given) == words


def test_words_of_the_taxi_and_of_the_pole():
    # ((row 5 + column) 5 + passenger) 4 + destination: in row 1, column 2, riding, to stand Y.
    assert display_of("Taxi-v4").words(((0 * 5 + 1) * 5 + 4) * 4 + 2) == (
        "taxi in row 1, column 2; the passenger is in the taxi and wants to go to stand Y"
    )
    assert display_of("CartPole-v1").words(np.array([-1.0, 0, 0.1, 0])) == (
        "cart 1.0 m left of the middle, pole 6 degrees to the right"
    )
