"""Tasks: tabular ones with known transitions, and the package's Gymnasium environments."""

from qbumpers.tasks.cliff_walking import CliffWalking, cliff_walking
from qbumpers.tasks.environment import TabularEnvironment
from qbumpers.tasks.registry import make_task, register_task, task_names
from qbumpers.tasks.tabular import TabularTask

__all__ = [
    "CliffWalking",
    "TabularEnvironment",
    "TabularTask",
    "cliff_walking",
    "make_task",
    "register_task",
    "task_names",
]
