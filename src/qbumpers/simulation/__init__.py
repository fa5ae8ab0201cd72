"""Simulated learners, many and fast."""

from qbumpers.simulation.condition import Condition, Setup, make_condition
from qbumpers.simulation.cuda.devices import Card, device_of
from qbumpers.simulation.outcomes import Outcomes, Script, Simulation, StateCounts, TrialMeans
from qbumpers.simulation.trials import (
    check_for_card,
    engine_of,
    made_by,
    record,
    run,
    run_on_card,
    simulate,
    simulate_means,
)

__all__ = [
    "Card",
    "Condition",
    "Outcomes",
    "Script",
    "Setup",
    "Simulation",
    "StateCounts",
    "TrialMeans",
    "check_for_card",
    "device_of",
    "engine_of",
    "made_by",
    "make_condition",
    "record",
    "run",
    "run_on_card",
    "simulate",
    "simulate_means",
]
