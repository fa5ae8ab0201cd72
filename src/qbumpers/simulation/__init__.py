"""Simulated learners, many and fast."""

from qbumpers.simulation.condition import Condition, Setup, make_condition
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts
from qbumpers.simulation.trials import engine_of, record, run, simulate

__all__ = [
    "Condition",
    "Outcomes",
    "Script",
    "Setup",
    "Simulation",
    "StateCounts",
    "engine_of",
    "make_condition",
    "record",
    "run",
    "simulate",
]
