"""Compiled networks against PyTorch's automatic differentiation and finite differences."""

import numpy as np
import pytest
import torch

from qbumpers.networks import Network
from qbumpers.networks.network import backward, forward, initialise, named_parameters
from qbumpers.random_streams import LEARNER, trial_streams
from tests.learners.textbook import TextbookNetwork

INPUTS, ACTIONS, STATES = 3, 4, 7
NETWORKS = [
    Network(hidden, activation, dueling)
    for hidden in [(), (6, 5), (6, 5, 8)]
    for activation in ("tanh", "relu")
    for dueling in (0, 5)
]
OF_TWO_LAYERS = [network for network in NETWORKS if len(network.hidden) == 2]
# The rational function for tanh is good to 1.2e-8.
TOLERANCES = {np.float64: 1e-7, np.float32: 1e-5}


def made(network, precision, states=STATES, inputs=INPUTS, seed=0):
    """Layout, random parameters, and a workspace with random observations in front."""
    generator = np.random.default_rng(seed)
    layout = network.layout(inputs, ACTIONS)
    parameters = generator.normal(0, 0.7, layout.parameters()).astype(precision)
    workspace = np.full(layout.workspace(states), np.nan, precision)
    workspace[: states * inputs] = generator.normal(0, 1, states * inputs)
    return layout, parameters, workspace


def gradient_of(layout, parameters, workspace, deltas):
    deltas_workspace = np.full(layout.workspace(len(deltas)), np.nan, workspace.dtype)
    gradient = np.full(len(parameters), np.nan, workspace.dtype)
    backward(layout, parameters, workspace, deltas, deltas_workspace, gradient)
    return gradient


@pytest.mark.parametrize(
    ("network", "precision"),
    [(n, np.float64) for n in NETWORKS] + [(n, np.float32) for n in OF_TWO_LAYERS],
    ids=str,
)
def test_values_and_gradients_are_those_of_automatic_differentiation(network, precision):
    layout, parameters, workspace = made(network, precision)
    observations = workspace[: STATES * INPUTS].reshape(STATES, INPUTS).copy()
    weights = np.random.default_rng(1).normal(0, 1, (STATES, ACTIONS)).astype(precision)
    textbook = TextbookNetwork(network, layout, parameters)
    expected = textbook(observations)
    (expected * torch.as_tensor(weights)).sum().backward()
    close = TOLERANCES[precision]
    values = forward(layout, parameters, workspace, STATES)
    assert values == pytest.approx(expected.detach().numpy(), abs=20 * close)
    found = gradient_of(layout, parameters, workspace, weights)
    size = np.abs(textbook.gradient()).max()
    assert found == pytest.approx(textbook.gradient(), abs=10 * close * size)


@pytest.mark.parametrize("network", [Network((6, 5)), Network((6, 5), "relu", 5)], ids=str)
def test_gradients_are_differences_of_the_values(network):
    layout, parameters, workspace = made(network, np.float64, states=1)
    deltas = np.array([[1.0, -2.0, 0.5, 3.0]])
    step = 1e-5

    def loss(place, change):
        moved = parameters.copy()
        moved[place] += change
        return float((forward(layout, moved, workspace.copy(), 1) * deltas).sum())

    forward(layout, parameters, workspace, 1)
    found = gradient_of(layout, parameters, workspace, deltas)
    differences = [
        (loss(place, step) - loss(place, -step)) / (2 * step) for place in range(len(parameters))
    ]
    assert found == pytest.approx(np.array(differences), abs=2e-5)


@pytest.mark.parametrize("network", OF_TWO_LAYERS, ids=str)
def test_one_state_and_a_batch_have_the_same_values(network):
    layout, parameters, workspace = made(network, np.float32)
    together = forward(layout, parameters, workspace, STATES).copy()
    for state in range(STATES):
        alone = np.zeros(layout.workspace(1), np.float32)
        alone[:INPUTS] = workspace[state * INPUTS : (state + 1) * INPUTS]
        assert forward(layout, parameters, alone, 1)[0] == pytest.approx(together[state], abs=1e-5)


def test_tanh_is_tanh_wherever_it_is_asked():
    layout = Network((1, 1)).layout(1, 1)
    parameters = np.array([1.0, 0.0, 1.0, 0.0, 1.0, 0.0])  # tanh of tanh
    points = np.concatenate([np.linspace(-12, 12, 4001), [1e-30, -1e30, 1e30, 0.0]])
    workspace = np.zeros(layout.workspace(len(points)))
    workspace[: len(points)] = points
    found = forward(layout, parameters, workspace, len(points))[:, 0]
    assert found == pytest.approx(np.tanh(np.tanh(points)), abs=1e-7)
    assert np.abs(found).max() <= 1


@pytest.mark.parametrize("network", NETWORKS, ids=str)
def test_every_parameter_has_a_name_and_a_place(network):
    layout, parameters, _ = made(network, np.float32)
    named = named_parameters(layout, parameters)
    assert np.array_equal(np.concatenate([a.ravel() for a in named.values()]), parameters)
    units = sum(network.hidden) + (
        2 * network.dueling + 1 + ACTIONS if network.dueling else ACTIONS
    )
    assert sum(a.size for name, a in named.items() if name.endswith(".bias")) == units
    next(iter(named.values()))[...] = 7
    assert parameters[0] == 7


def test_a_dueling_networks_advantages_have_mean_zero_around_its_value():
    layout, parameters, workspace = made(Network((6,), "tanh", 5), np.float64)
    values = forward(layout, parameters, workspace, STATES).copy()
    named_parameters(layout, parameters)["advantages.bias"][...] += 3.0
    assert forward(layout, parameters, workspace, STATES) == pytest.approx(values, abs=1e-12)
    named_parameters(layout, parameters)["value.bias"][...] += 2.0
    assert forward(layout, parameters, workspace, STATES) == pytest.approx(values + 2, abs=1e-12)


def test_initial_weights_are_uniform_within_glorots_limits_and_biases_zero():
    layout = Network((64, 48), "relu", 32).layout(8, 4)
    parameters = np.full(layout.parameters(), np.nan, np.float32)
    initialise(layout, parameters, trial_streams(0, "test", range(1))[0, LEARNER])
    for name, array in named_parameters(layout, parameters).items():
        if name.endswith(".bias"):
            assert not array.any()
        else:
            limit = np.sqrt(6 / sum(array.shape))
            assert np.abs(array).max() <= limit * (1 + 1e-6)
            # A uniform number's standard deviation is limit / sqrt(3).
            assert array.std() == pytest.approx(limit / np.sqrt(3), rel=6 / np.sqrt(array.size))
            assert abs(array.mean()) < 4 * limit / np.sqrt(3 * array.size)
