"""Which learner explains the choices of a record: likelihoods, estimates, comparisons."""

from qbumpers.fitting.candidates import Candidate, Likelihood, choices_of, make_candidate
from qbumpers.fitting.compare import Fitted, Progress, compare, fit
from qbumpers.fitting.estimate import Estimate, Interval, estimate, interval

__all__ = [
    "Candidate",
    "Estimate",
    "Fitted",
    "Interval",
    "Likelihood",
    "Progress",
    "choices_of",
    "compare",
    "estimate",
    "fit",
    "interval",
    "make_candidate",
]
