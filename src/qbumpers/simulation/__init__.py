"""Simulated people, many and fast."""

from qbumpers.simulation.condition import Condition, make_condition
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts, Steps
from qbumpers.simulation.trials import record, run, simulate
from qbumpers.simulation.workers import make_pool

__all__ = [
    "Condition",
    "Outcomes",
    "Script",
    "Simulation",
    "StateCounts",
    "Steps",
    "make_condition",
    "make_pool",
    "record",
    "run",
    "simulate",
]
