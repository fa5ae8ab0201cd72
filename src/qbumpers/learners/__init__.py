"""Simulated people: what they do, what they believe happened, how they learn from it."""

from qbumpers.learners.perception import PERCEPTIONS, Experience, Perception, perceive, perception
from qbumpers.learners.q_learning import QLearner, Schedule

__all__ = [
    "PERCEPTIONS",
    "Experience",
    "Perception",
    "QLearner",
    "Schedule",
    "perceive",
    "perception",
]
