"""A display for any tabular task: numbered states and actions."""

from typing import Any, Protocol

from qbumpers.decisions import Step
from qbumpers.tasks.display import Display, Shape, rectangle, text
from qbumpers.tasks.displays.grid import grid_display

_WIDTH, _HEIGHT = 480.0, 240.0
_KEYS = (
    *(f"Digit{digit}" for digit in "1234567890"),
    *(f"Key{letter}" for letter in "QWERTYUIOPASDFGHJKLZXCVBNM"),
)


class Table(Protocol):
    """What of a tabular task is shown."""

    @property
    def states(self) -> int:
        """S."""
        ...

    @property
    def actions(self) -> int:
        """A."""
        ...

    @property
    def grid(self) -> tuple[int, int] | None:
        """(rows, columns) if states are cells; else None."""
        ...


def plain_display(task: Table) -> Display:
    """A grid of numbered cells if states are cells, else the state's number in words.

    Actions are "action 0", "action 1", ...; their keys are 1 to 9, 0, and then the letters as they
    lie on a keyboard, so that the first 36 actions have one.

    Args:
        task: any tabular one.
    """
    actions = tuple(f"action {action}" for action in range(task.actions))
    keys = {key: action for action, key in enumerate(_KEYS[: task.actions])}
    if task.grid is not None:
        rows, columns = task.grid
        cells = [[str(row * columns + column) for column in range(columns)] for row in range(rows)]
        return grid_display(cells, actions, keys)
    return Display(
        width=_WIDTH, height=_HEIGHT, actions=actions, keys=keys, rate=0.0, idle=-1,
        backdrop=[rectangle((0, 0), (_WIDTH, _HEIGHT), "#f7f7f4")], scene=_scene,
    )  # fmt: skip


def _scene(state: Any, step: Step | None) -> list[Shape]:
    shapes = [text((_WIDTH / 2, 0.42 * _HEIGHT), f"state {int(state)}", "#2c5f8f", 56)]
    if step is not None:
        words = f"action {int(step.executed)}, reward {float(step.reward):g}"
        shapes.append(text((_WIDTH / 2, 0.75 * _HEIGHT), words, "#60645f", 24))
    return shapes
