"""Pictures against where things must be, pixel by pixel."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from qbumpers.tasks.display import (
    Display,
    circle,
    line,
    polygon,
    rectangle,
    text,
    unassisted_step,
)
from qbumpers.tasks.displays.by_environment import display_maker
from qbumpers.tasks.drawing import Painter, picture
from tests.tasks.shown import ENVIRONMENTS, display_of, environment_of, middle, near

RED, BLUE, WHITE = "#ff0000", "#0000ff", "#ffffff"


def drawn(*shapes, height=None) -> np.ndarray:
    """Shapes on black, 100 wide and 80 high."""
    display = Display(100, 80, (), {}, 0, -1, [], lambda state, step: shapes)
    return picture(display, None, height=height)


def test_a_picture_is_bytes_of_the_displays_size_or_of_the_height_asked_for():
    assert drawn().shape == (80, 100, 3)
    assert drawn().dtype == np.uint8
    assert drawn(height=40).shape == (40, 50, 3)
    assert not drawn().any()


def test_a_rectangle_covers_its_pixels_and_no_others():
    covered = near(drawn(rectangle((20, 10), (30, 40), RED)), RED, 70)
    expected = np.zeros((80, 100), bool)
    expected[10:50, 20:50] = True
    assert np.array_equal(covered, expected)


def test_shapes_grow_with_the_picture():
    covered = near(drawn(rectangle((20, 10), (30, 40), RED), height=160), RED, 70)
    assert covered.sum() == pytest.approx(60 * 80, rel=0.01)
    assert middle(covered) == pytest.approx((70, 60), abs=0.6)


def test_a_polygon_has_the_area_that_geometry_gives():
    seen = drawn(polygon([(10, 10), (90, 10), (10, 70)], RED))[:, :, 0] / 255
    assert seen.sum() == pytest.approx(80 * 60 / 2, rel=0.02)


def test_a_circle_has_its_centre_and_its_area_and_a_border_outside_and_inside():
    plain = near(drawn(circle((40, 30), 20, RED)), RED, 127)
    assert middle(plain) == pytest.approx((40, 30), abs=0.3)
    assert plain.sum() == pytest.approx(np.pi * 20**2, rel=0.03)
    bordered = drawn(circle((40, 30), 20, RED, BLUE, 4))
    assert near(bordered, RED, 127).sum() == pytest.approx(np.pi * 18**2, rel=0.03)
    assert near(bordered, BLUE, 127).sum() == pytest.approx(np.pi * (22**2 - 18**2), rel=0.05)


def test_a_line_is_as_wide_as_it_says_and_centred():
    seen = near(drawn(line([(10, 40), (90, 40)], RED, 6)), RED, 127)
    assert np.flatnonzero(seen[:, 50]).tolist() == [37, 38, 39, 40, 41, 42]


def test_the_border_of_a_polygon_goes_all_the_way_round():
    seen = near(drawn(rectangle((20, 20), (40, 40), RED, BLUE, 4)), BLUE, 127)
    for y, x in ((20, 40), (59, 40), (40, 20), (40, 59), (20, 20), (59, 59)):
        assert seen[y, x]
    assert not seen[24:56, 24:56].any()


def test_a_text_is_written_around_its_point_and_grows_with_its_size():
    small, large = (near(drawn(text((50, 40), "8", WHITE, size)), WHITE, 127) for size in (20, 40))
    assert middle(large) == pytest.approx((50, 40), abs=4)
    assert large.sum() > 3 * small.sum() > 0


def test_later_shapes_lie_over_earlier_ones_and_over_the_backdrop():
    ground = rectangle((0, 0), (100, 80), RED)
    display = Display(100, 80, (), {}, 0, -1, [ground], lambda state, step: [
        circle((50, 40), 20, WHITE), circle((50, 40), 10, BLUE)
    ])  # fmt: skip
    seen = picture(display, None)
    assert [seen[40, x].tolist() for x in (5, 35, 50)] == [[255, 0, 0], [255] * 3, [0, 0, 255]]


@pytest.mark.parametrize("height", [None, 90])
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_pictures_over_a_kept_backdrop_are_those_drawn_all_at_once(name, height):
    display, environment = display_of(name), environment_of(name)
    at_once = display._replace(
        backdrop=[], scene=lambda *shown: [*display.backdrop, *display.scene(*shown)]
    )
    painter = Painter(display, height)
    environment.action_space.seed(0)
    state, _ = environment.reset(seed=0)
    step = None
    for _ in range(5):
        assert np.array_equal(painter.picture(state, step), picture(at_once, state, step, height))
        before, action = state, environment.action_space.sample()
        state, reward, *_ = environment.step(action)
        step = unassisted_step(before, int(action), float(reward), state)


@pytest.mark.parametrize("name", ["qbumpers/CliffWalking-v0", "qbumpers/LunarLander-v0"])
def test_an_environment_shows_where_it_is_now(name):
    environment = gymnasium.make(name, render_mode="rgb_array")
    state, _ = environment.reset(seed=0)
    assert np.array_equal(np.asarray(environment.render()), picture(display_of(name), state))
    for action in (0, 2, 1):
        before = state
        state, reward, *_ = environment.step(action)
        step = unassisted_step(before, action, float(reward), state)
        assert np.array_equal(
            np.asarray(environment.render()), picture(display_of(name), state, step)
        )


@pytest.mark.parametrize("state", [0, 17, 26, 36, 47])
def test_the_walker_stands_in_the_middle_of_its_cell(state):
    seen = picture(display_of("CliffWalking-v1"), state)
    row, column = divmod(state, 12)
    assert middle(near(seen, "#e8890c")) == pytest.approx((64 * column + 32, 64 * row + 32), abs=1)


def test_the_cliff_is_dark_where_falls_happen():
    seen = picture(display_of("CliffWalking-v1"), 0)
    table = environment_of("CliffWalking-v1").unwrapped.P
    dark = near(seen, "#4d5359")
    below = [(column, table[24 + column][2][0][2] == -100) for column in range(12)]
    assert [dark[198, 64 * column + 32] for column, _ in below] == [falls for _, falls in below]
    assert not dark[:188].any()


LAKES = [
    {"map_name": "4x4"},
    {"map_name": "8x8"},
    {"desc": ["SFFHF", "FHFFF", "HFFFG"], "is_slippery": False},
]


@pytest.mark.parametrize("arguments", LAKES, ids=["4x4", "8x8", "own"])
def test_holes_are_where_the_lake_ends_without_a_reward(arguments):
    environment: Any = gymnasium.make("FrozenLake-v1", **arguments)
    inner = environment.unwrapped
    make = display_maker(environment)
    assert make is not None
    seen = near(picture(make(None), 0), "#33648c")
    holes = np.zeros((inner.nrow, inner.ncol), bool)
    for actions in inner.P.values():
        for outcomes in actions.values():
            for _, to, reward, done in outcomes:
                holes.flat[to] |= done and reward == 0 and to != inner.nrow * inner.ncol - 1
    centres = seen[32::64, 32::64]
    assert np.array_equal(centres, holes)
    assert seen.shape == (64 * inner.nrow, 64 * inner.ncol)


def test_walls_stand_where_a_taxi_cannot_go_right():
    inner = environment_of("Taxi-v4").unwrapped
    seen = near(picture(display_of("Taxi-v4"), inner.encode(0, 0, 1, 1)), "#3a3f44", 30)
    for row in range(5):
        for column in range(4):
            state = inner.encode(row, column, 0, 1)
            ((_, to, _, _),) = inner.P[state][2]
            edge = seen[8 + 64 * row + 50, 8 + 64 * (column + 1)]
            assert edge == (to == state), (row, column)


@pytest.mark.parametrize(("row", "column"), [(0, 1), (2, 2), (4, 4)])
def test_the_taxi_is_drawn_in_its_cell(row, column):
    inner = environment_of("Taxi-v4").unwrapped
    seen = picture(display_of("Taxi-v4"), inner.encode(row, column, 1, 2))
    expected = 8 + 64 * column + 32, 8 + 64 * row + 32
    assert middle(near(seen, "#f2c230", 5)) == pytest.approx(expected, abs=6)


STANDS = [(0, 0), (0, 4), (4, 0), (4, 3)]


@pytest.mark.parametrize("place", range(4))
def test_passenger_and_flag_stand_at_the_numbered_stands(place):
    inner = environment_of("Taxi-v4").unwrapped
    row, column = STANDS[place]
    display = display_of("Taxi-v4")
    other = (place + 1) % 4
    passenger = near(picture(display, inner.encode(2, 2, place, other)), "#7b4fa3")
    x, y = middle(passenger)
    assert ((y - 8) // 64, (x - 8) // 64) == (row, column)
    with_flag = picture(display, inner.encode(2, 2, 4, place)).astype(int)
    elsewhere = picture(display, inner.encode(2, 2, 4, other)).astype(int)
    top, left = 8 + 64 * row, 8 + 64 * column
    here = (with_flag - elsewhere)[top : top + 64, left : left + 64]
    assert (here > 0).any()  # white cloth
    assert near(with_flag, "#ffffff")[top + 10 : top + 14, left + 48 : left + 52].any()


def test_a_passenger_who_rides_is_in_the_taxi():
    inner = environment_of("Taxi-v4").unwrapped
    riding = near(picture(display_of("Taxi-v4"), inner.encode(3, 1, 4, 0)), "#7b4fa3")
    x, y = middle(riding)
    assert ((y - 8) // 64, (x - 8) // 64) == (3, 1)


@pytest.mark.parametrize("position", [-1.0, -0.5, 0.2, 0.5])
def test_the_car_and_the_cart_are_where_gymnasium_draws_them(position):
    car = picture(display_of("MountainCar-v0"), np.array([position, 0.0], np.float32))
    x, y = middle(near(car, "#d9534f"))
    height = np.sin(3 * position) * 0.45 + 0.55
    assert x == pytest.approx((position + 1.2) / 1.8 * 600, abs=22)  # it leans with the hill
    assert y == pytest.approx(400 - height * 600 / 1.8 - 18, abs=10)
    observation = np.array([position, 0, 0, 0], np.float32)
    cart = picture(display_of("CartPole-v1"), observation)
    assert middle(near(cart, "#3a3f44"))[0] == pytest.approx((position + 2.4) / 4.8 * 600, abs=1)


def test_a_pole_leans_to_the_right_by_its_angle():
    observation = np.array([0, 0, 0.2, 0], np.float32)
    pole = near(picture(display_of("CartPole-v1"), observation), "#ca9865")
    y, x = np.nonzero(pole[:270])
    slope = np.polyfit(-y, x, 1)[0]
    assert np.arctan(slope) == pytest.approx(0.2, abs=0.01)
