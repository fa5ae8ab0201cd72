"""Prints a digest of networks after updates; run by a test on this processor and as others."""

import hashlib

import numpy as np

from qbumpers.learners import DoubleDQN
from qbumpers.learners.double_dqn import make_memory, update
from qbumpers.networks import Network
from qbumpers.random_streams import LEARNER, trial_streams
from qbumpers.registration import as_numbers

INPUTS, ACTIONS, UPDATES = 8, 4, 200
NETWORKS = [Network(), Network((40, 17), "relu", 33)]


def weights_after(network: Network, updates: int) -> bytes:
    """Weights after updates with batches from a replay of random transitions."""
    learner = DoubleDQN(network=network, replay_size=1_000, gradient_limit=0.5)
    layout = network.layout(INPUTS, ACTIONS)
    memory = make_memory(learner, layout, trial_streams(0, "updates", range(1))[0, LEARNER])
    generator = np.random.default_rng(0)
    memory.replay[:] = generator.normal(size=memory.replay.shape)
    memory.replay[:, 2 * INPUTS] = generator.integers(ACTIONS, size=len(memory.replay))
    memory.replay[:, -1] = 1.0
    settings = as_numbers(learner)
    for _ in range(updates):
        update(settings, memory, generator.integers(1_000, size=learner.batch_size))
    return memory.parameters.tobytes()


if __name__ == "__main__":
    for network in NETWORKS:
        print(hashlib.sha256(weights_after(network, UPDATES)).hexdigest())
