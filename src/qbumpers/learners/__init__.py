"""Simulated learners: how they choose, what they believe happened, how they learn from it."""

from qbumpers.learners.actor_critic import ActorCritic
from qbumpers.learners.double_dqn import DoubleDQN
from qbumpers.learners.expected_sarsa import ExpectedSarsa
from qbumpers.learners.forgetting import PowerLaw
from qbumpers.learners.imitator import Imitator
from qbumpers.learners.model_based import ModelBased
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
from qbumpers.learners.softmax_q_learning import SoftmaxQLearner
from qbumpers.learners.two_rate import TwoRate

__all__ = [
    "PERCEPTIONS",
    "ActorCritic",
    "DoubleDQN",
    "ExpectedSarsa",
    "Imitator",
    "LearnerType",
    "ModelBased",
    "Motor",
    "Perception",
    "PowerLaw",
    "QLearner",
    "Sarsa",
    "Schedule",
    "SoftmaxQLearner",
    "TwoRate",
    "learner_for_settings",
    "learner_type",
    "learners",
    "make_learner",
    "perceive",
    "perception",
    "register_learner",
]
