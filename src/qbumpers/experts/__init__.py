"""Experts: training them, judging and choosing them, correcting what their values claim."""

from qbumpers.experts.checking import ExpertWarning, check_expert
from qbumpers.experts.stable_baselines import from_stable_baselines
from qbumpers.experts.training import Recipe, train_expert

__all__ = [
    "ExpertWarning",
    "Recipe",
    "check_expert",
    "from_stable_baselines",
    "train_expert",
]
