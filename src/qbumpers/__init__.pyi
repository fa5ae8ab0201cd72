from .assistants import Assistant, make_assistant, register_assistant
from .decisions import Decision, Noise, Situation, Step
from .errors import RequestError
from .experiments.store import load
from .experts import train_expert
from .learners import DoubleDQN, QLearner, Schedule
from .networks import Network
from .shared_control import SharedControl
from .simulation import Simulation, simulate
from .tasks import TabularTask, VectorTask, make_task, register_task
from .values import (
    NetworkValues,
    QValues,
    TabularValues,
    learn_values,
    load_values,
    shipped_expert,
    solve,
)

__version__: str

__all__ = [
    "Assistant",
    "Decision",
    "DoubleDQN",
    "Network",
    "NetworkValues",
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
    "VectorTask",
    "__version__",
    "learn_values",
    "load",
    "load_values",
    "make_assistant",
    "make_task",
    "register_assistant",
    "register_task",
    "shipped_expert",
    "simulate",
    "solve",
    "train_expert",
]
