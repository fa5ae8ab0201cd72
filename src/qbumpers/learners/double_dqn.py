"""Double DQN (van Hasselt, Guez and Silver 2016) in compiled code: an update in some 20 us.

The learners that Section 4.3 simulates, and its expert, learn so.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import compiled, compiled_apart
from qbumpers.learners.epsilon_greedy import epsilon_greedy, epsilon_greedy_policy, greedy
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled
from qbumpers.networks.network import Layout, Network, backward, forward, initialise, values_of
from qbumpers.networks.simd import multiply_add, sum_of_squares
from qbumpers.random_streams import draw

Count = Annotated[int, Field(ge=1)]


class DoubleDQN(NamedTuple):
    """A Double DQN learner; its networks and replay live with the trial.

    Attributes:
        network: shape of the network of its action values.
        discount: gamma of the learner's own values, in (0, 1].
        epsilon: probability of a random action, by episode.
        learning_rate: step size of Adam, in (0, 1].
        batch_size: transitions of an update.
        replay_size: transitions that are remembered.
        learning_starts: steps before the first update; from then on there is one per step.
        target_every: steps after which the target network is renewed.
        clip: what the norm of the gradient is clipped for: "global" (all parameters together),
            "variable" (each layer's weights and biases by themselves) or "none".
        gradient_limit: the norm to which a longer gradient is shortened.
    """

    network: Network = Network()
    discount: Annotated[float, Field(gt=0, le=1)] = 0.99
    epsilon: Schedule = Schedule(1.0, 0.02, 0.1)
    learning_rate: Annotated[float, Field(gt=0, le=1)] = 1e-3
    batch_size: Count = 32
    replay_size: Count = 50_000
    learning_starts: Count = 1_000
    target_every: Count = 1_500
    clip: Literal["none", "global", "variable"] = "global"
    gradient_limit: Annotated[float, Field(gt=0)] = 10.0


_GLOBAL, _VARIABLE = 1, 2  # places among the choices of `clip`


class DQNMemory(NamedTuple):
    """What a learner carries along, all arrays changed in place; float is float32 but in tests.

    Attributes:
        layout: sizes of its network.
        parameters: float [P], weights and biases of its network.
        target: float [P], those of the target network.
        gradient: float [P], of the loss, in an update.
        moments: float [2, P], first and second moments of Adam.
        replay: float32 [M, 2 D + 3], transitions: observation, next observation, action, reward,
            and 0 if the next state is terminal, else 1.
        counts: int64 [2], transitions seen and updates made.
        batch_workspace: float, for the networks of an update.
        workspace: float, for the network of one observation.
    """

    layout: Layout
    parameters: np.ndarray
    target: np.ndarray
    gradient: np.ndarray
    moments: np.ndarray
    replay: np.ndarray
    counts: np.ndarray
    batch_workspace: np.ndarray
    workspace: np.ndarray


def make_memory(
    settings: DoubleDQN, layout: Layout, stream: np.ndarray, precision: type = np.float32
) -> DQNMemory:
    """Networks, freshly initialised, and an empty replay.

    Args:
        settings: how it learns; of them the sizes of the replay and of a batch are used.
        layout: sizes of its network.
        stream: uint64 [4], random stream of the initial weights.
        precision: type of the numbers of the networks.

    Returns:
        The memory.
    """
    size = layout.parameters()
    parameters = np.zeros(size, precision)
    initialise(layout, parameters, stream)
    return DQNMemory(
        layout=layout,
        parameters=parameters,
        target=parameters.copy(),
        gradient=np.zeros(size, precision),
        moments=np.zeros((2, size), precision),
        replay=np.zeros((settings.replay_size, 2 * layout.sizes[0] + 3), np.float32),
        counts=np.zeros(2, np.int64),
        batch_workspace=np.zeros(4 * layout.workspace(settings.batch_size), precision),
        workspace=np.zeros(layout.workspace(1), precision),
    )


def start(settings: DoubleDQN, shape: Shape, stream: np.ndarray) -> DQNMemory:
    """The memory before the first episode."""
    layout = settings.network.layout(shape.observation_size, len(shape.width))
    return make_memory(settings, layout, stream)


def begin(settings: DoubleDQN, memory: DQNMemory, episode: int, episodes: int) -> Rates:
    """Exploration of an episode; the step size stays."""
    return Rates(scheduled(settings.epsilon, episode, episodes), settings.learning_rate)


@compiled_apart
def choose(
    settings: DoubleDQN, memory: DQNMemory, state: np.ndarray, rates: Rates, stream: np.ndarray
) -> int:
    """An epsilon-greedy action."""
    values = values_of(memory.layout, memory.parameters, memory.workspace, state)
    return epsilon_greedy(values, rates.epsilon, draw(stream), draw(stream))


@compiled_apart
def policy(
    settings: DoubleDQN, memory: DQNMemory, state: np.ndarray, rates: Rates, out: np.ndarray
) -> None:
    """The probabilities of `choose`."""
    values = values_of(memory.layout, memory.parameters, memory.workspace, state)
    epsilon_greedy_policy(values, rates.epsilon, out)


@compiled_apart
def prefer(settings: DoubleDQN, memory: DQNMemory, state: np.ndarray, tie: float) -> int:
    """A greedy action."""
    return greedy(values_of(memory.layout, memory.parameters, memory.workspace, state), tie)


@compiled_apart
def learn(
    settings: DoubleDQN, memory: DQNMemory, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Remember a transition; update once from a batch, if there is enough to draw one from."""
    remember(memory, transition)
    replay(settings, memory, stream)


@compiled_apart
def remember(memory: DQNMemory, transition: Transition) -> None:
    """Keep a transition, in place of the oldest if the replay is full."""
    observation, next_observation = transition.state, transition.next_state
    width = len(observation)
    line = memory.replay[memory.counts[0] % len(memory.replay)]
    for i in range(width):
        line[i] = observation[i]
        line[width + i] = next_observation[i]
    line[2 * width] = transition.action
    line[2 * width + 1] = transition.reward
    line[2 * width + 2] = 0.0 if transition.terminated else 1.0
    memory.counts[0] += 1


@compiled_apart
def replay(settings: DoubleDQN, memory: DQNMemory, stream: np.ndarray) -> None:
    """One update from a batch drawn at random, once there is enough to draw from.

    Args:
        settings: how the learner learns, as numbers.
        memory: changed in place.
        stream: uint64 [4], random stream of the batch.
    """
    seen = memory.counts[0]
    if seen < settings.learning_starts:
        return
    among = min(seen, len(memory.replay))
    batch = np.empty(settings.batch_size, np.int64)
    for n in range(settings.batch_size):
        batch[n] = int(draw(stream) * among)
    update(settings, memory, batch)
    if seen % settings.target_every == 0:
        for i in range(len(memory.target)):
            memory.target[i] = memory.parameters[i]


@compiled_apart
def update(settings: DoubleDQN, memory: DQNMemory, batch: np.ndarray) -> None:
    """One step of Adam on the Huber loss of given transitions.

    Args:
        settings: how the learner learns, as numbers.
        memory: changed in place.
        batch: int64 [N], places in the replay.
    """
    loss_gradient(memory, settings.discount, batch)
    if settings.clip == _GLOBAL:
        _shorten(memory.gradient, settings.gradient_limit)
    elif settings.clip == _VARIABLE:
        _shorten_each(memory.layout, memory.gradient, settings.gradient_limit)
    memory.counts[1] += 1
    _adam(
        memory.parameters, memory.gradient, memory.moments, settings.learning_rate,
        memory.counts[1],
    )  # fmt: skip


@compiled_apart
def loss_gradient(memory: DQNMemory, discount: float, batch: np.ndarray) -> None:
    """Gradient of the mean Huber loss, of width 1, between action values and their targets.

    The target of a transition is its reward and, unless it ends the episode, the discounted value
    that the target network gives the action which the network itself prefers.

    Args:
        memory: its `gradient` is overwritten.
        discount: gamma of the targets, in (0, 1].
        batch: int64 [N], places in the replay.
    """
    layout = memory.layout
    states, width, actions = len(batch), layout.sizes[0], layout.actions
    size = len(memory.batch_workspace) // 4
    now, preferred = memory.batch_workspace[:size], memory.batch_workspace[size : 2 * size]
    later, spare = memory.batch_workspace[2 * size : 3 * size], memory.batch_workspace[3 * size :]
    for n in range(states):
        line = memory.replay[batch[n]]
        for i in range(width):
            now[n * width + i] = line[i]
            preferred[n * width + i] = line[width + i]
            later[n * width + i] = line[width + i]
    preferences = forward(layout, memory.parameters, preferred, states)
    futures = forward(layout, memory.target, later, states)
    values = forward(layout, memory.parameters, now, states)
    deltas = preferences  # of equal shape, and no longer needed once a row is read
    kind = values.dtype.type
    for n in range(states):
        line = memory.replay[batch[n]]
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
    backward(layout, memory.parameters, now, deltas, spare, memory.gradient)


@compiled_apart
def _shorten(gradient: np.ndarray, limit: float) -> None:
    """Scale a gradient down to a norm of `limit` if it is longer."""
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


register_learner(
    "double-dqn", DoubleDQN, start=start, begin=begin, choose=choose, prefer=prefer, policy=policy,
    learn=learn, observes="vectors",
)  # fmt: skip
