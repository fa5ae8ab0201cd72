"""What processes that simulate have in common, imported once by the process they are forked from.

Numba loads most of itself at the first call of a compiled function, hence the call.
"""

import numpy as np

import qbumpers.simulation.deep  # noqa: F401
from qbumpers.random_streams import draw

draw(np.zeros(4, np.uint64))
