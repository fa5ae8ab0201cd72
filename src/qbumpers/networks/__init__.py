"""Networks in compiled code: their shape, their layers, and sums in vector registers."""

from qbumpers.networks.network import Layout, Network

__all__ = ["Layout", "Network"]
