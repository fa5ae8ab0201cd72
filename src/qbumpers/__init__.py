"""Assistance that lets people learn: Stochastic Q Bumpers for shared control.

`import qbumpers` registers the Gymnasium environments; everything else loads when it is used.
"""

import importlib
from typing import Any

import gymnasium

__version__ = "0.1.0"

_HOME = {
    "Assistant": "assistants",
    "make_assistant": "assistants",
    "register_assistant": "assistants",
    "Decision": "decisions",
    "Noise": "decisions",
    "Situation": "decisions",
    "Step": "decisions",
    "RequestError": "errors",
    "QLearner": "learners",
    "Schedule": "learners",
    "SharedControl": "shared_control",
    "TabularTask": "tasks",
    "make_task": "tasks",
    "register_task": "tasks",
    "TabularValues": "values",
    "learn_values": "values",
    "load_values": "values",
    "solve": "values",
    "simulate": "simulation",
}

__all__ = ["__version__", *_HOME]

gymnasium.register(
    id="qbumpers/CliffWalking-v0",
    entry_point="qbumpers.tasks.cliff_walking:CliffWalking",
    max_episode_steps=100,
)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'qbumpers' has no attribute {name!r}")
    return getattr(importlib.import_module(f"qbumpers.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
