"""Where the assistant's Q* comes from, and how it is kept."""

from qbumpers.values.exact import solve
from qbumpers.values.q_learning import learn_values
from qbumpers.values.tabular import QValues, TabularValues, check_width, decoded_values, load_values

__all__ = [
    "QValues",
    "TabularValues",
    "check_width",
    "decoded_values",
    "learn_values",
    "load_values",
    "solve",
]
