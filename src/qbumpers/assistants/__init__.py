"""Decision rules, one file each, and the registry that names them."""

from qbumpers.assistants import (  # in the order in which they are listed
    budget,
    local_q_thresholding,
    maximal,
    none,
    stochastic_q_bumpers,
)
from qbumpers.assistants.assistant import Assistant, assistant_of, make_assistant
from qbumpers.assistants.registry import Options, Rule, assistants, register_assistant

__all__ = [
    "Assistant",
    "Options",
    "Rule",
    "assistant_of",
    "assistants",
    "budget",
    "local_q_thresholding",
    "make_assistant",
    "maximal",
    "none",
    "register_assistant",
    "stochastic_q_bumpers",
]
