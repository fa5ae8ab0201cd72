"""Double DQN (van Hasselt, Guez and Silver 2016) in compiled code: an update in some 20 us.

The people that Section 4.3 simulates, and its expert, learn so.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import compiled, compiled_apart
from qbumpers.learners.q_learning import Schedule
from qbumpers.networks.network import Layout, Network, backward, forward, initialise
from qbumpers.networks.simd import multiply_add, sum_of_squares
from qbumpers.random_streams import draw

Count = Annotated[int, Field(ge=1)]


class DoubleDQN(NamedTuple):
    """A Double DQN learner; its networks and replay live with the trial.

    Attributes:
        network: its shape.
        discount: of the learner's values.
        epsilon: probability of a random action, by episode.
        learning_rate: of Adam.
        batch_size: transitions of an update.
        replay_size: transitions that are remembered.
        learning_starts: steps before the first update; from then on there is one a step.
        target_every: steps after which the target network is renewed.
        clip: what the norm of the gradient is clipped for: "global" (all parameters together),
            "variable" (each layer's weights and biases by themselves) or "none".
        gradient_limit: of that norm.
        penalty: what an override feels like, in reward units, to a learner whose perception
            includes disruption.
    """

    network: Network = Network()
    discount: Annotated[float, Field(gt=0, le=1)] = 0.99
    epsilon: Schedule = Schedule(1.0, 0.02, 0.1)
    learning_rate: Annotated[float, Field(gt=0, le=1)] = 1e-3
    batch_size: Count = 32
    replay_size: Count = 50_000
    learning_starts: Count = 1_000
    target_every: Count = 1_500
    clip: Literal["global", "variable", "none"] = "global"
    gradient_limit: Annotated[float, Field(gt=0)] = 10.0
    penalty: Annotated[float, Field(allow_inf_nan=False)] = 1.0


CLIPS = ("none", "global", "variable")


class Rates(NamedTuple):
    """The numbers of a `DoubleDQN` that its updates need."""

    discount: float
    learning_rate: float
    batch_size: int
    learning_starts: int
    target_every: int
    clip: int
    gradient_limit: float


def rates(learner: DoubleDQN) -> Rates:
    """The numbers of a learner that its updates need."""
    return Rates(
        learner.discount,
        learner.learning_rate,
        learner.batch_size,
        learner.learning_starts,
        learner.target_every,
        CLIPS.index(learner.clip),
        learner.gradient_limit,
    )


class Brain(NamedTuple):
    """What a learner carries along, all changed in place; float is float32 but in tests.

    Attributes:
        parameters: float [P], of its network.
        target: float [P], of the target network.
        gradient: float [P].
        moments: float [2, P], of Adam.
        replay: float32 [M, 2 D + 3], transitions: observation, next observation, action, reward,
            and 0 where the next state is terminal, else 1.
        counts: int64 [2], transitions seen and updates made.
        room: float, for batches.
    """

    parameters: np.ndarray
    target: np.ndarray
    gradient: np.ndarray
    moments: np.ndarray
    replay: np.ndarray
    counts: np.ndarray
    room: np.ndarray


def make_brain(
    learner: DoubleDQN, layout: Layout, stream: np.ndarray, precision: type = np.float32
) -> Brain:
    """A learner's networks, freshly initialised, and its empty replay.

    Args:
        learner: its settings.
        layout: of its network.
        stream: uint64 [4], random stream of the initial weights.
        precision: of the networks.

    Returns:
        The brain.
    """
    size = layout.parameters()
    parameters = np.zeros(size, precision)
    initialise(layout, parameters, stream)
    return Brain(
        parameters=parameters,
        target=parameters.copy(),
        gradient=np.zeros(size, precision),
        moments=np.zeros((2, size), precision),
        replay=np.zeros((learner.replay_size, 2 * layout.sizes[0] + 3), np.float32),
        counts=np.zeros(2, np.int64),
        room=np.zeros(4 * layout.room(learner.batch_size), precision),
    )


@compiled_apart
def remember(
    brain: Brain, observation: np.ndarray, action: int, reward: float, following: np.ndarray,
    terminated: bool,
) -> None:  # fmt: skip
    """Keep a transition, in place of the oldest where the replay is full.

    Args:
        brain: of the learner.
        observation: float32 [D].
        action: that the learner credits.
        reward: as it perceives it.
        following: float32 [D], the next observation.
        terminated: whether the episode ended there for good; a truncation is no end.
    """
    width = len(observation)
    line = brain.replay[brain.counts[0] % len(brain.replay)]
    for i in range(width):
        line[i] = observation[i]
        line[width + i] = following[i]
    line[2 * width] = action
    line[2 * width + 1] = reward
    line[2 * width + 2] = 0.0 if terminated else 1.0
    brain.counts[0] += 1


@compiled_apart
def learn(layout: Layout, brain: Brain, rates: Rates, stream: np.ndarray) -> None:
    """One update from a batch drawn at random, once there is enough to draw from.

    Args:
        layout: of the network.
        brain: of the learner.
        rates: of the learner.
        stream: uint64 [4], random stream of the batch.
    """
    seen = brain.counts[0]
    if seen < rates.learning_starts:
        return
    among = min(seen, len(brain.replay))
    batch = np.empty(rates.batch_size, np.int64)
    for n in range(rates.batch_size):
        batch[n] = int(draw(stream) * among)
    update(layout, brain, rates, batch)
    if seen % rates.target_every == 0:
        brain.target[:] = brain.parameters


@compiled_apart
def update(layout: Layout, brain: Brain, rates: Rates, batch: np.ndarray) -> None:
    """One step of Adam on the Huber loss of given transitions.

    Args:
        layout: of the network.
        brain: of the learner.
        rates: of the learner.
        batch: int64 [N], places in the replay.
    """
    loss_gradient(layout, brain, rates.discount, batch)
    if rates.clip == 1:
        _shorten(brain.gradient, rates.gradient_limit)
    elif rates.clip == 2:
        _shorten_each(layout, brain.gradient, rates.gradient_limit)
    brain.counts[1] += 1
    _adam(brain.parameters, brain.gradient, brain.moments, rates.learning_rate, brain.counts[1])


@compiled_apart
def loss_gradient(layout: Layout, brain: Brain, discount: float, batch: np.ndarray) -> None:
    """Gradient of the mean Huber loss, of width 1, between action values and their targets.

    The target of a transition is its reward and, where it does not end the episode, the discounted
    value that the target network gives the action which the network itself prefers.

    Args:
        layout: of the network.
        brain: of the learner; its `gradient` is overwritten.
        discount: of the values.
        batch: int64 [N], places in the replay.
    """
    states, width, actions = len(batch), layout.sizes[0], layout.actions
    size = len(brain.room) // 4
    now, preferred = brain.room[:size], brain.room[size : 2 * size]
    later, spare = brain.room[2 * size : 3 * size], brain.room[3 * size :]
    for n in range(states):
        line = brain.replay[batch[n]]
        for i in range(width):
            now[n * width + i] = line[i]
            preferred[n * width + i] = line[width + i]
            later[n * width + i] = line[width + i]
    preferences = forward(layout, brain.parameters, preferred, states)
    futures = forward(layout, brain.target, later, states)
    values = forward(layout, brain.parameters, now, states)
    deltas = preferences  # of equal shape, and no longer needed once a row is read
    kind = values.dtype.type
    for n in range(states):
        line = brain.replay[batch[n]]
        best = 0
        for action in range(1, actions):
            if preferences[n, action] > preferences[n, best]:
                best = action
        future = kind(discount) * futures[n, best] * kind(line[2 * width + 2])
        credited = int(line[2 * width])
        difference = values[n, credited] - (kind(line[2 * width + 1]) + future)
        for action in range(actions):
            deltas[n, action] = kind(0)
        deltas[n, credited] = min(max(difference, kind(-1)), kind(1)) / kind(states)
    backward(layout, brain.parameters, now, deltas, spare, brain.gradient)


@compiled_apart
def _shorten(gradient: np.ndarray, limit: float) -> None:
    """Scale a gradient down to a norm of `limit` where it is longer."""
    norm = np.sqrt(sum_of_squares(gradient))
    if norm > limit:
        gradient *= gradient.dtype.type(limit) / norm


@compiled
def _shorten_each(layout: Layout, gradient: np.ndarray, limit: float) -> None:
    """Scale down the gradients of each layer's weights and biases by themselves."""
    sizes, actions, streams, _ = layout
    place = 0
    for layer in range(1, len(sizes)):
        place = _shorten_layer(gradient, place, sizes[layer], sizes[layer - 1], limit)
    last = sizes[len(sizes) - 1]
    if streams == 0:
        _shorten_layer(gradient, place, actions, last, limit)
        return
    place = _shorten_layer(gradient, place, streams, last, limit)
    place = _shorten_layer(gradient, place, 1, streams, limit)
    place = _shorten_layer(gradient, place, streams, last, limit)
    _shorten_layer(gradient, place, actions, streams, limit)


@compiled
def _shorten_layer(
    gradient: np.ndarray, place: int, outputs: int, inputs: int, limit: float
) -> int:
    end = place + outputs * inputs
    _shorten(gradient[place:end], limit)
    _shorten(gradient[end : end + outputs], limit)
    return end + outputs


@compiled_apart
def _adam(
    parameters: np.ndarray, gradient: np.ndarray, moments: np.ndarray, rate: float, updates: int
) -> None:
    """Adam (Kingma and Ba 2015) with its usual 0.9, 0.999 and 1e-8.

    Units that stay silent let both moments fade into denormal numbers, which processors add up many
    times slower. Moments too small to move any parameter are set to zero instead.
    """
    kind = parameters.dtype.type
    keep, blend = kind(0.9), kind(0.1)
    keep_square, blend_square = kind(0.999), kind(0.001)
    step = kind(rate / (1 - 0.9**updates))
    correction = kind(1 / np.sqrt(1 - 0.999**updates))
    epsilon, silent = kind(1e-8), kind(1e-30)
    zero = kind(0)
    first, second = moments[0], moments[1]
    for i in range(len(parameters)):
        slope = gradient[i]
        mean = multiply_add(keep, first[i], blend * slope)
        square = multiply_add(keep_square, second[i], blend_square * (slope * slope))
        mean = mean if abs(mean) > silent else zero
        square = square if square > silent else zero
        first[i] = mean
        second[i] = square
        parameters[i] -= step * mean / multiply_add(np.sqrt(square), correction, epsilon)
