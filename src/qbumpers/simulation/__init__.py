"""Simulated people, many and fast."""

from qbumpers.simulation.condition import Condition, make_condition
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts, Steps
from qbumpers.simulation.trials import record, run, simulate

__all__ = [
    "Condition",
    "Outcomes",
    "Script",
    "Simulation",
    "StateCounts",
    "Steps",
    "make_condition",
    "record",
    "run",
    "simulate",
]
