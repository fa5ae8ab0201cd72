"""Action values of an assistant, Q*: how they are kept, and where they come from."""

from qbumpers.values.exact import solve
from qbumpers.values.network import NetworkValues
from qbumpers.values.q_learning import learn_values
from qbumpers.values.remapping import remapped_values
from qbumpers.values.shipped import shipped_expert, shipped_values
from qbumpers.values.tabular import (
    QValues,
    TabularValues,
    check_width,
    decoded_values,
    load_values,
)
from qbumpers.values.uncertainty import StartInterval, start_interval

__all__ = [
    "NetworkValues",
    "QValues",
    "StartInterval",
    "TabularValues",
    "check_width",
    "decoded_values",
    "learn_values",
    "load_values",
    "remapped_values",
    "shipped_expert",
    "shipped_values",
    "solve",
    "start_interval",
]
