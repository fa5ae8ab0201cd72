"""Simulated people, many and fast."""

from qbumpers.simulation.condition import Condition, make_condition
from qbumpers.simulation.loops import Outcomes, Script, StateCounts, Steps
from qbumpers.simulation.tabular import Simulation, record, run, simulate

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
