from .assistants import Assistant, make_assistant, register_assistant
from .decisions import Decision, Noise, Situation, Step
from .errors import RequestError
from .experiments.store import load
from .learners import QLearner, Schedule
from .shared_control import SharedControl
from .simulation import Simulation, simulate
from .tasks import TabularTask, make_task, register_task
from .values import QValues, TabularValues, learn_values, load_values, solve

__version__: str

__all__ = [
    "Assistant",
    "Decision",
    "Noise",
    "QLearner",
    "QValues",
    "RequestError",
    "Schedule",
    "SharedControl",
    "Simulation",
    "Situation",
    "Step",
    "TabularTask",
    "TabularValues",
    "__version__",
    "learn_values",
    "load",
    "load_values",
    "make_assistant",
    "make_task",
    "register_assistant",
    "register_task",
    "simulate",
    "solve",
]
