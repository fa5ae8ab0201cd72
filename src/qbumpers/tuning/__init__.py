"""Finding the assistant that teaches best above a required performance."""

from qbumpers.tuning.choosing import Contender, Tuning, tune
from qbumpers.tuning.trials import TuningProgress

__all__ = ["Contender", "Tuning", "TuningProgress", "tune"]
