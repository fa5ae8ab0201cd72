"""Simulated learners, many and fast."""

from qbumpers.simulation.condition import Condition, Setup, make_condition
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts
from qbumpers.simulation.trials import record, run, simulate

__all__ = [
    "Condition",
    "Outcomes",
    "Script",
    "Setup",
    "Simulation",
    "StateCounts",
    "make_condition",
    "record",
    "run",
    "simulate",
]
