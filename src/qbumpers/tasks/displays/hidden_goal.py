"""The hidden goal: three goals and pits; that of the episode is ringed for the learner."""

from collections.abc import Sequence

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Shape, circle, move_keys, text
from qbumpers.tasks.displays.cliff_walking import ACTIONS
from qbumpers.tasks.displays.grid import CELL, grid_display

MAP = (
    "G..G..G",
    ".......",
    ".H.H.H.",
    ".......",
    "...S...",
)
ROWS, COLUMNS = len(MAP), len(MAP[0])
GOALS = tuple(column for column in range(COLUMNS) if MAP[0][column] == "G")
"""Columns of the goals, which lie in the first row."""


def hidden_goal_display() -> Display:
    """The grid, the walker an orange dot, and a ring around the goal of this episode."""
    plain = grid_display(MAP, ACTIONS, move_keys(ACTIONS))

    def scene(state: int, step: Step | None) -> Sequence[Shape]:
        """The ring, and the walker."""
        cell, goal = divmod(int(state), len(GOALS))
        centre = ((GOALS[goal] + 0.5) * CELL, 0.5 * CELL)
        ring = circle(centre, 0.42 * CELL, "#d9ecd6", "#2f7031", 6.0)
        letter = text(centre, "G", "#2f7031", 0.45 * CELL)
        return [ring, letter, *plain.scene(cell, step)]

    def words(state: int) -> str:
        """The cell, and which goal it is."""
        cell, goal = divmod(int(state), len(GOALS))
        return f"{plain.words(cell)}; your goal is in row 1, column {GOALS[goal] + 1}"

    return plain._replace(scene=scene, words=words)
