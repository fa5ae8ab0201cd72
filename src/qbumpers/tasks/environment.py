"""Any tabular task as a Gymnasium environment."""

import functools
from typing import Any

import gymnasium

from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.drawing import Painter
from qbumpers.tasks.dynamics import CRASH, SUCCESS, TERMINATED, first_state, transition
from qbumpers.tasks.task import Task


class TabularEnvironment(gymnasium.Env[Any, Any]):
    """A tabular task to be stepped through; states and actions are numbers, as its spaces count.

    `info` of every step has `success` and `crash`, false if the task does not know them. The step
    limit belongs to Gymnasium's TimeLimit (see `TabularTask.make_environment`), not to this class.

    Args:
        task: a task with a table.
        render_mode: one that its class has; None for no pictures.

    Raises:
        RequestError: if there is no such mode.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}  # noqa: RUF012

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            known = ", ".join(self.metadata["render_modes"]) or "there are none"
            raise RequestError(f"task {task.name}: render_mode = {render_mode!r}; known: {known}")
        self.task = task
        self.render_mode = render_mode
        space: Any = task.observation_space
        self.observation_space, self._first_state = space, int(space.start)
        self.action_space, self._first_action = task.action_space, int(task.action_space.start)
        self._dynamics = task.dynamics()
        self._state = 0
        self._last_step: Step | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[int, dict[str, Any]]:
        """Start an episode in a state drawn from the task's start distribution."""
        super().reset(seed=seed)
        self._state = int(first_state(self._dynamics, self.np_random.random()))
        self._last_step = None
        return self._shown_state(), {"success": False, "crash": False}

    def _shown_state(self) -> int:
        return self._state + self._first_state

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        """Take an action.

        Args:
            action: in [0, A), counted from the start of the action space.

        Returns:
            Next state, reward, terminated, False, and `info`.
        """
        dynamics, first = self._dynamics, self._first_action
        if not first <= action < first + dynamics.actions:
            raise RequestError(
                f"action = {action!r}; it must lie in [{first}, {first + dynamics.actions})"
            )
        number = int(action) - first
        index = transition(dynamics, self._state, number, self.np_random.random())
        before, reward = self._state, float(dynamics.reward[index])
        self._state = int(dynamics.next_state[index])
        self._last_step = unassisted_step(before, number, reward, self._state)
        events = int(dynamics.events[index])
        info = {"success": bool(events & SUCCESS), "crash": bool(events & CRASH)}
        return self._shown_state(), reward, bool(events & TERMINATED), False, info

    def render(self) -> Any:
        """For "rgb_array" the picture of the state, uint8 [H, W, 3]; None without a mode."""
        if self.render_mode != "rgb_array":
            return None
        return self._painter.picture(self._state, self._last_step)

    @functools.cached_property
    def _painter(self) -> Painter:
        return Painter(self.task.display)

    def snapshot(self) -> int:
        """The number of the state."""
        return self._state

    def restore(self, snapshot: int) -> None:
        """Put a state back; chance goes on, so that the same action may lead elsewhere.

        Args:
            snapshot: from `snapshot`.
        """
        self._state = snapshot
