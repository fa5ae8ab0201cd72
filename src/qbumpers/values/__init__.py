"""Where the assistant's Q* comes from, how it is kept, and how good it is."""

from qbumpers.values.deep_q_learning import Recipe, train_expert
from qbumpers.values.exact import solve
from qbumpers.values.experts import ExpertWarning, check_expert, shipped_expert
from qbumpers.values.network import NetworkValues
from qbumpers.values.q_learning import learn_values
from qbumpers.values.stable_baselines import from_stable_baselines
from qbumpers.values.tabular import QValues, TabularValues, check_width, decoded_values, load_values

__all__ = [
    "ExpertWarning",
    "NetworkValues",
    "QValues",
    "Recipe",
    "TabularValues",
    "check_expert",
    "check_width",
    "decoded_values",
    "from_stable_baselines",
    "learn_values",
    "load_values",
    "shipped_expert",
    "solve",
    "train_expert",
]
