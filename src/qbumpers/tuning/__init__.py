"""Finding the assistant that teaches best above a required performance."""

from qbumpers.tuning.choosing import Contender, Tuning, tune
from qbumpers.tuning.trials import Progress

__all__ = ["Contender", "Progress", "Tuning", "tune"]
