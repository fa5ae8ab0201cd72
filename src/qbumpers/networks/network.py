"""Multi-layer perceptrons in compiled code: action values of one state or a batch, and gradients.

All parameters of a network lie in one flat array, layer after layer, weights [inputs, outputs] and
then biases [outputs], so that an optimiser is one loop over it. A dueling network (Wang et al.
2016) ends in four layers: value units, value, advantage units, advantages.
"""

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import compiled, compiled_apart
from qbumpers.networks.layers import (
    activate,
    activation_gradient,
    add_biases,
    backpropagate,
    gradient_of_layer,
    matrix,
    weighted_sums,
)
from qbumpers.networks.simd import multiply, transposed
from qbumpers.random_streams import draw


class Network(NamedTuple):
    """The shape of a network.

    Attributes:
        hidden: units of each hidden layer.
        activation: what hidden units do, "tanh" or "relu".
        dueling: units of each of the two streams of a dueling network; 0 for a plain one.
    """

    hidden: tuple[Annotated[int, Field(ge=1, le=4096)], ...] = (64, 64)
    activation: Literal["tanh", "relu"] = "tanh"
    dueling: Annotated[int, Field(ge=0, le=4096)] = 0

    def layout(self, inputs: int, actions: int) -> "Layout":
        """The network laid out between so many inputs and actions."""
        return Layout((inputs, *self.hidden), actions, self.dueling, self.activation == "relu")


class Layout(NamedTuple):
    """A network as compiled code needs it.

    Attributes:
        sizes: inputs, then units of each hidden layer.
        actions: A.
        dueling: units of each stream of a dueling network, or 0.
        relu: rectified linear units instead of tanh.
    """

    sizes: tuple[int, ...]
    actions: int
    dueling: int
    relu: bool

    def layers(self) -> list[tuple[str, int, int]]:
        """Name, outputs and inputs of each layer, in the order of their parameters."""
        sizes, last = self.sizes, self.sizes[-1]
        layers = [(f"hidden_{i}", sizes[i], sizes[i - 1]) for i in range(1, len(sizes))]
        if not self.dueling:
            return [*layers, ("values", self.actions, last)]
        return [
            *layers,
            ("value_units", self.dueling, last),
            ("value", 1, self.dueling),
            ("advantage_units", self.dueling, last),
            ("advantages", self.actions, self.dueling),
        ]

    def parameters(self) -> int:
        """How many numbers the network has."""
        return sum(outputs * (inputs + 1) for _, outputs, inputs in self.layers())

    def workspace(self, states: int) -> int:
        """How many numbers `forward` needs for a batch of states."""
        heads = 2 * self.dueling + 1 + self.actions if self.dueling else self.actions
        return states * (sum(self.sizes) + heads)


def named_parameters(layout: Layout, parameters: np.ndarray) -> dict[str, np.ndarray]:
    """The parameters by name, as views: "hidden_1.weight" [inputs, outputs], "hidden_1.bias", ...

    Args:
        layout: sizes of the network, which say where its parameters lie.
        parameters: float [P], flat.

    Returns:
        Views of `parameters`.
    """
    named: dict[str, np.ndarray] = {}
    offset = 0
    for name, outputs, inputs in layout.layers():
        end = offset + outputs * inputs
        named[f"{name}.weight"] = parameters[offset:end].reshape(inputs, outputs)
        named[f"{name}.bias"] = parameters[end : end + outputs]
        offset = end + outputs
    return named


def initialise(layout: Layout, parameters: np.ndarray, stream: np.ndarray) -> None:
    """Weights uniform in +-sqrt(6 / (inputs + outputs)) (Glorot and Bengio 2010), biases 0.

    Args:
        layout: sizes of the network, which say where its parameters lie.
        parameters: float [P], overwritten.
        stream: uint64 [4], see `qbumpers.random_streams`.
    """
    offset = 0
    for _, outputs, inputs in layout.layers():
        _glorot_uniform(parameters[offset : offset + outputs * inputs], outputs + inputs, stream)
        offset += outputs * inputs
        parameters[offset : offset + outputs] = 0
        offset += outputs


@compiled_apart
def _glorot_uniform(weights: np.ndarray, connections: int, stream: np.ndarray) -> None:
    limit = np.sqrt(6 / connections)
    for i in range(len(weights)):
        weights[i] = limit * (2 * draw(stream) - 1)


@compiled_apart
def forward(
    layout: Layout, parameters: np.ndarray, workspace: np.ndarray, states: int
) -> np.ndarray:
    """Action values of a batch of states.

    Args:
        layout: sizes of the network, which say where its parameters lie.
        parameters: float [P], weights and biases.
        workspace: float [`layout.workspace(states)` or more]; its first numbers are the
            observations [states, inputs], what follows is overwritten, for `backward`.
        states: N.

    Returns:
        float [N, A], a view of `workspace`.
    """
    sizes, actions, streams, relu = layout
    offset, first = 0, 0
    below = matrix(workspace, 0, states, sizes[0])
    for layer in range(1, len(sizes)):
        first += below.size
        units = matrix(workspace, first, states, sizes[layer])
        activate(units, weighted_sums(parameters, offset, below, units), relu)
        offset += units.shape[1] * (below.shape[1] + 1)
        below = units
    first += below.size
    if streams == 0:
        values = matrix(workspace, first, states, actions)
        add_biases(values, weighted_sums(parameters, offset, below, values))
        return values
    value_units, value, advantage_units, values = _heads(workspace, first, states, streams, actions)
    activate(value_units, weighted_sums(parameters, offset, below, value_units), relu)
    offset += streams * (below.shape[1] + 1)
    add_biases(value, weighted_sums(parameters, offset, value_units, value))
    offset += streams + 1
    activate(advantage_units, weighted_sums(parameters, offset, below, advantage_units), relu)
    offset += streams * (below.shape[1] + 1)
    add_biases(values, weighted_sums(parameters, offset, advantage_units, values))
    for n in range(states):
        mean = values[n].sum() / values.dtype.type(actions)
        for action in range(actions):
            values[n, action] += value[n, 0] - mean
    return values


@compiled_apart
def values_of(
    layout: Layout, parameters: np.ndarray, workspace: np.ndarray, observation: np.ndarray
) -> np.ndarray:
    """Action values of one observation.

    Args:
        layout: sizes of the network, which say where its parameters lie.
        parameters: float [P], weights and biases.
        workspace: float [`layout.workspace(1)` or more], overwritten.
        observation: float32 [D].

    Returns:
        float [A], a view of the workspace.
    """
    for i in range(len(observation)):
        workspace[i] = observation[i]
    return forward(layout, parameters, workspace, 1)[0]


@compiled
def _heads(workspace: np.ndarray, first: int, states: int, streams: int, actions: int) -> Any:
    """Where the layers of a dueling network lie."""
    second = first + states * streams
    third = second + states
    fourth = third + states * streams
    return (
        matrix(workspace, first, states, streams),
        matrix(workspace, second, states, 1),
        matrix(workspace, third, states, streams),
        matrix(workspace, fourth, states, actions),
    )


@compiled_apart
def backward(
    layout: Layout, parameters: np.ndarray, workspace: np.ndarray, deltas: np.ndarray,
    deltas_workspace: np.ndarray, gradient: np.ndarray,
) -> None:  # fmt: skip
    """The gradient of a loss, by back-propagation.

    Args:
        layout: sizes of the network, which say where its parameters lie.
        parameters: float [P], weights and biases.
        workspace: as `forward` left it.
        deltas: float [N, A], derivatives of the loss by the action values.
        deltas_workspace: float [`layout.workspace(N)`], overwritten.
        gradient: float [P], overwritten.
    """
    sizes, _, streams, relu = layout
    states = deltas.shape[0]
    first, offset = 0, 0  # of the last hidden layer, and of the parameters after it
    for layer in range(1, len(sizes)):
        first += states * sizes[layer - 1]
        offset += sizes[layer] * (sizes[layer - 1] + 1)
    last = sizes[len(sizes) - 1]
    units = matrix(workspace, first, states, last)
    below = matrix(deltas_workspace, first, states, last)
    if streams == 0:
        gradient_of_layer(gradient, offset, units, deltas)
        if len(sizes) > 1:
            backpropagate(parameters, offset, deltas, units, relu, below)
    else:
        _backward_heads(
            layout,
            parameters,
            workspace,
            deltas,
            deltas_workspace,
            gradient,
            offset,
            first,
            units,
            below,
        )
    for layer in range(len(sizes) - 1, 0, -1):
        offset -= sizes[layer] * (sizes[layer - 1] + 1)
        above = below
        first -= states * sizes[layer - 1]
        units = matrix(workspace, first, states, sizes[layer - 1])
        gradient_of_layer(gradient, offset, units, above)
        if layer > 1:
            below = matrix(deltas_workspace, first, states, sizes[layer - 1])
            backpropagate(parameters, offset, above, units, relu, below)


@compiled_apart
def _backward_heads(
    layout: Layout, parameters: np.ndarray, workspace: np.ndarray, deltas: np.ndarray,
    deltas_workspace: np.ndarray, gradient: np.ndarray, offset: int, first: int,
    units: np.ndarray, below: np.ndarray,
) -> None:  # fmt: skip
    """The last four layers of a dueling network, down to the deltas `below` of its trunk."""
    sizes, actions, streams, relu = layout
    states, last = units.shape
    first += units.size
    value_units, _, advantage_units, _ = _heads(workspace, first, states, streams, actions)
    value_down, value, advantage_down, advantages = _heads(
        deltas_workspace, first, states, streams, actions
    )
    for n in range(states):
        total = deltas[n].sum()
        value[n, 0] = total
        for action in range(actions):
            advantages[n, action] = deltas[n, action] - total / deltas.dtype.type(actions)
    value_offset = offset + streams * (last + 1)
    advantage_offset = value_offset + streams + 1
    advantages_offset = advantage_offset + streams * (last + 1)
    gradient_of_layer(gradient, value_offset, value_units, value)
    backpropagate(parameters, value_offset, value, value_units, relu, value_down)
    gradient_of_layer(gradient, offset, units, value_down)
    gradient_of_layer(gradient, advantages_offset, advantage_units, advantages)
    backpropagate(parameters, advantages_offset, advantages, advantage_units, relu, advantage_down)
    gradient_of_layer(gradient, advantage_offset, units, advantage_down)
    if len(sizes) > 1:
        weights = matrix(parameters, offset, last, streams)
        multiply(value_down, False, transposed(weights), below)
        weights = matrix(parameters, advantage_offset, last, streams)
        sums = np.empty_like(below)
        multiply(advantage_down, False, transposed(weights), sums)
        for n in range(states):
            for i in range(last):
                below[n, i] += sums[n, i]
        activation_gradient(below, units, relu)
