"""Simulated learners: how they choose, what they believe happened, how they learn from it."""

from qbumpers.learners.double_dqn import DoubleDQN
from qbumpers.learners.expected_sarsa import ExpectedSarsa
from qbumpers.learners.motor import Motor
from qbumpers.learners.perception import PERCEPTIONS, Perception, perceive, perception
from qbumpers.learners.q_learning import QLearner
from qbumpers.learners.registry import (
    LearnerType,
    learner_for_settings,
    learner_type,
    learners,
    make_learner,
    register_learner,
)
from qbumpers.learners.sarsa import Sarsa
from qbumpers.learners.schedules import Schedule

__all__ = [
    "PERCEPTIONS",
    "DoubleDQN",
    "ExpectedSarsa",
    "LearnerType",
    "Motor",
    "Perception",
    "QLearner",
    "Sarsa",
    "Schedule",
    "learner_for_settings",
    "learner_type",
    "learners",
    "make_learner",
    "perceive",
    "perception",
    "register_learner",
]
