"""Tasks: tabular ones, those observed as vectors, and the package's Gymnasium environments."""

from qbumpers.tasks.cliff_walking import CliffWalking, cliff_walking
from qbumpers.tasks.environment import TabularEnvironment
from qbumpers.tasks.registry import make_task, register_task, task_names
from qbumpers.tasks.stepping import Stepper, UndoableStepper
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Task
from qbumpers.tasks.vector import VectorTask

__all__ = [
    "CliffWalking",
    "Stepper",
    "TabularEnvironment",
    "TabularTask",
    "Task",
    "UndoableStepper",
    "VectorTask",
    "cliff_walking",
    "make_task",
    "register_task",
    "task_names",
]
