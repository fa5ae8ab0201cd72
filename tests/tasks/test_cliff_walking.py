"""Cliff Walking against a description of its own, cell by cell, and against Gymnasium's."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.toy_text import CliffWalkingEnv
from gymnasium.utils.env_checker import check_env

import qbumpers  # noqa: F401 - registers the environment
from qbumpers.errors import RequestError
from qbumpers.tasks import CliffWalking, cliff_walking, make_task
from qbumpers.tasks.cliff_walking import larger_cliff
from qbumpers.tasks.drawing import picture
from qbumpers.values import solve
from tests.narrowing import of_kind, present
from tests.tasks.examples import outcomes

UP, RIGHT, DOWN, LEFT = range(4)
START, GOAL = (3, 0), (3, 11)
CLIFF = [(3, column) for column in range(1, 11)]
WALKABLE = [
    (row, column)
    for row in range(4)
    for column in range(12)
    if (row, column) not in CLIFF and (row, column) != GOAL
]


def described(cell: tuple[int, int], action: int) -> tuple[tuple[int, int], float, bool]:
    """Next cell, reward and end, as the game is described in words."""
    row, column = cell
    if action == UP and row > 0:
        row = row - 1
    elif action == DOWN and row < 3:
        row = row + 1
    elif action == LEFT and column > 0:
        column = column - 1
    elif action == RIGHT and column < 11:
        column = column + 1
    if (row, column) in CLIFF:
        return START, -100.0, False
    if (row, column) == GOAL:
        return GOAL, 99.0, True
    return (row, column), -1.0, False


def number(cell: tuple[int, int]) -> int:
    return 12 * cell[0] + cell[1]


def test_there_are_37_cells_to_walk_on():
    assert len(WALKABLE) == 37


@pytest.mark.parametrize("cell", WALKABLE, ids=str)
@pytest.mark.parametrize("action", range(4), ids=["up", "right", "down", "left"])
def test_every_move_does_what_the_description_says(cell, action):
    task = cliff_walking()
    to, reward, terminated = described(cell, action)
    assert outcomes(task, number(cell), action) == {(number(to), reward, terminated): 1.0}
    assert bool(present(task.success)[number(cell), action, 0]) == (to == GOAL)
    assert bool(present(task.crash)[number(cell), action, 0]) == (reward == -100)


def test_it_is_gymnasiums_cliff_walking_plus_100_at_the_goal():
    table = of_kind(CliffWalkingEnv, gymnasium.make("CliffWalking-v1").unwrapped).P
    task = cliff_walking()
    for cell in WALKABLE:
        for action in range(4):
            ((probability, to, reward, terminated),) = table[number(cell)][action]
            expected = (int(to), reward + 100 * terminated, bool(terminated))
            assert outcomes(task, number(cell), action) == {expected: probability}


def test_the_start_the_discount_and_the_limit():
    task = cliff_walking()
    assert np.flatnonzero(task.start).tolist() == [number(START)]
    assert (task.discount, task.episode_limit, task.grid) == (1.0, 100, (4, 12))


def test_the_environment_passes_gymnasiums_checks():
    check_env(gymnasium.make("qbumpers/CliffWalking-v0", render_mode="rgb_array").unwrapped)


def test_an_episode_along_the_cliff_returns_87():
    environment = gymnasium.make("qbumpers/CliffWalking-v0")
    observation, info = environment.reset(seed=0)
    assert (observation, info) == (number(START), {"success": False, "crash": False})
    total = 0.0
    for action in [UP, *[RIGHT] * 11]:
        _, reward, terminated, truncated, info = environment.step(action)
        assert not terminated
        assert not truncated
        total += float(reward)
    observation, reward, terminated, truncated, info = environment.step(DOWN)
    assert (observation, reward, terminated, truncated) == (number(GOAL), 99.0, True, False)
    assert info == {"success": True, "crash": False}
    assert total + float(reward) == 87.0


def test_a_fall_is_a_crash_and_the_episode_goes_on():
    environment = gymnasium.make("qbumpers/CliffWalking-v0")
    environment.reset(seed=0)
    assert environment.step(RIGHT) == (
        number(START), -100.0, False, False, {"success": False, "crash": True},
    )  # fmt: skip
    assert environment.step(UP)[0] == number((2, 0))


def test_an_episode_is_truncated_at_its_hundredth_step():
    environment = gymnasium.make("qbumpers/CliffWalking-v0")
    environment.reset(seed=0)
    ends = [environment.step(LEFT)[2:4] for _ in range(100)]
    assert ends == [(False, False)] * 99 + [(False, True)]


def test_ansi_shows_the_grid_and_the_walker():
    environment = gymnasium.make("qbumpers/CliffWalking-v0", render_mode="ansi")
    environment.reset(seed=0)
    assert environment.render() == (
        ". . . . . . . . . . . .\n"
        ". . . . . . . . . . . .\n"
        ". . . . . . . . . . . .\n"
        "o C C C C C C C C C C G\n"
    )
    environment.step(UP)
    environment.step(RIGHT)
    assert environment.render() == (
        ". . . . . . . . . . . .\n"
        ". . . . . . . . . . . .\n"
        ". o . . . . . . . . . .\n"
        "S C C C C C C C C C C G\n"
    )


def orange_cells(picture: np.ndarray) -> set[tuple[int, int]]:
    """Cells of 64 x 64 pixels with any clearly orange pixel."""
    red, green, blue = (picture[:, :, channel].astype(int) for channel in range(3))
    orange = (red > 200) & (green > 100) & (green < 170) & (blue < 60)
    return {(int(y) // 64, int(x) // 64) for y, x in np.argwhere(orange)}


def test_the_picture_has_an_orange_walker_that_moves():
    environment = gymnasium.make("qbumpers/CliffWalking-v0", render_mode="rgb_array")
    environment.reset(seed=0)
    picture = of_kind(np.ndarray, environment.render())
    assert picture.shape == (256, 768, 3)
    assert picture.dtype == np.uint8
    assert orange_cells(picture) == {START}
    environment.step(UP)
    assert orange_cells(of_kind(np.ndarray, environment.render())) == {(2, 0)}
    environment.step(RIGHT)
    assert orange_cells(of_kind(np.ndarray, environment.render())) == {(2, 1)}


def test_without_a_render_mode_nothing_is_drawn():
    environment = CliffWalking()
    environment.reset(seed=0)
    assert environment.render() is None


def test_a_larger_cliff_of_the_papers_size_is_the_papers():
    assert larger_cliff(4, 12).digest() == cliff_walking().digest()
    assert larger_cliff(4, 12).identity() == cliff_walking().identity()


@pytest.mark.parametrize(("rows", "columns"), [(2, 3), (5, 7), (8, 24), (30, 12)])
def test_the_shortest_path_along_a_larger_cliff_returns_87(rows, columns):
    """Up, along the cliff, down: one step more than there are columns."""
    task = make_task("larger-cliff", rows=rows, columns=columns)
    state, total, terminated = columns * (rows - 1), 0.0, False
    for action in [UP, *[RIGHT] * (columns - 1), DOWN]:
        ((state, reward, terminated),) = outcomes(task, state, action)  # type: ignore[arg-type]
        total += reward
    assert (state, terminated, total) == (rows * columns - 1, True, 87.0)
    assert solve(task)(columns * (rows - 1)).max() == 87.0


def test_a_larger_cliff_has_the_rules_of_the_small_one():
    task = larger_cliff(6, 9)
    first, last = 45, 53
    for state, action in np.ndindex(last, 4):
        row, column = divmod(state, 9)
        row += {UP: -1, DOWN: 1}.get(action, 0)
        column += {LEFT: -1, RIGHT: 1}.get(action, 0)
        to = 9 * min(max(row, 0), 5) + min(max(column, 0), 8)
        fallen, arrived = first < to < last, to == last
        reward = -100.0 if fallen else -1.0 + arrived * (100 - 3)
        expected = {(first if fallen else to, reward, arrived): 1.0}
        assert outcomes(task, state, action) == expected
        assert bool(present(task.crash)[state, action, 0]) == fallen


def test_the_limit_of_a_larger_cliff_grows_with_its_cells():
    limits = [larger_cliff(*size).episode_limit for size in ((4, 12), (8, 12), (8, 24), (2, 3))]
    assert limits == [100, 200, 400, 13]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rows": 1}, r"rows = 1; it must lie in \[2, 100\]"),
        ({"columns": 101}, r"columns = 101; it must lie in \[3, 100\]"),
        ({"rows": "8"}, r"rows = '8'; a whole number in \[2, 100\] is needed"),
    ],
)
def test_a_size_out_of_range_is_named(arguments, message):
    with pytest.raises(RequestError, match=f"task 'larger-cliff': {message}"):
        make_task("larger-cliff", **arguments)


def test_the_picture_of_a_larger_cliff_has_its_cells():
    shown = picture(larger_cliff(3, 5).display, 7)
    assert shown.shape == (3 * 64, 5 * 64, 3)
    assert orange_cells(shown) == {(1, 2)}
