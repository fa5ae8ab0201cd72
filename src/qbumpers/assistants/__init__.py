"""Decision rules, one file each, and the registry that names them."""

from qbumpers.assistants import local_q_thresholding, maximal, none, stochastic_q_bumpers
from qbumpers.assistants.registry import (
    Assistant,
    Rule,
    assistants,
    make_assistant,
    register_assistant,
)

__all__ = [
    "Assistant",
    "Rule",
    "assistants",
    "local_q_thresholding",
    "make_assistant",
    "maximal",
    "none",
    "register_assistant",
    "stochastic_q_bumpers",
]
