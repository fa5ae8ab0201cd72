"""Small networks that tests use as action values."""

import numpy as np

from qbumpers.networks import Network
from qbumpers.values import NetworkValues


def network_of(*, inputs=3, actions=2, seed=0, scale=0.5, **changes) -> NetworkValues:
    network = changes.pop("network", Network((5, 4)))
    size = network.layout(inputs, actions).parameters()
    parameters = np.random.default_rng(seed).normal(0, scale, size)
    fields = {"discount": 0.9, "task": "a task", "method": "by chance", **changes}
    return NetworkValues(network, inputs, actions, parameters, **fields)


def constant(best, inputs, actions, **fields) -> NetworkValues:
    """Values that prefer one action everywhere: 1 for it, 0 for the others."""
    network = Network(())
    parameters = np.zeros((inputs + 1) * actions)
    parameters[inputs * actions + best] = 1
    return NetworkValues(
        network, inputs, actions, parameters,
        **{"discount": 0.9, "task": "a task", "method": "by hand", **fields},
    )  # fmt: skip
