"""How often intervals hold the truth."""

import numpy as np


def covering(estimates, truth):
    """Share of the intervals that hold the truth."""
    return np.mean([estimate.low <= truth <= estimate.high for estimate in estimates])


def bound(repetitions, share=0.95):
    """Four standard errors of a share among that many."""
    return 4 * np.sqrt(share * (1 - share) / repetitions)
