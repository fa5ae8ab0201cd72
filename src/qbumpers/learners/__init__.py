"""Simulated people: what they do, what they believe happened, how they learn from it."""

from qbumpers.learners.double_dqn import DoubleDQN
from qbumpers.learners.perception import PERCEPTIONS, Experience, Perception, perceive, perception
from qbumpers.learners.q_learning import QLearner, Schedule

__all__ = [
    "PERCEPTIONS",
    "DoubleDQN",
    "Experience",
    "Perception",
    "QLearner",
    "Schedule",
    "perceive",
    "perception",
]
