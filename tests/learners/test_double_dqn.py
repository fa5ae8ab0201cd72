"""Compiled Double DQN against a plain float64 PyTorch one, and without what makes it fast."""

import numba
import numpy as np
import pytest

from qbumpers.errors import RequestError, checked
from qbumpers.learners import DoubleDQN
from qbumpers.learners.double_dqn import (
    learn,
    loss_gradient,
    make_memory,
    remember,
    update,
)
from qbumpers.learners.interface import Rates, Transition
from qbumpers.networks import Network
from qbumpers.networks.network import named_parameters
from qbumpers.networks.simd import multiply_add
from qbumpers.random_streams import LEARNER, draw, trial_streams
from qbumpers.registration import as_numbers
from tests.learners.textbook import TextbookLearner, double_dqn_loss, transitions

INPUTS, ACTIONS = 4, 3
NETWORKS = [
    Network((8, 6), "tanh"),
    Network((8, 6), "relu"),
    Network((8, 6), "tanh", 5),
    Network((8, 6), "relu", 5),
]
RATES = Rates(0.1, 1e-3)


def transition(observation, action, reward, next_observation, terminated):
    return Transition(observation, action, reward, next_observation, terminated, -1)


def stream(name="test"):
    return trial_streams(0, name, range(1))[0, LEARNER]


def made(network, precision: type[np.floating] = np.float64, **changes):
    """A learner, its layout, and a memory whose target network differs from its network."""
    learner = DoubleDQN(network=network, **changes)
    layout = network.layout(INPUTS, ACTIONS)
    memory = make_memory(learner, layout, stream(), precision)
    memory.target[:] += np.random.default_rng(9).normal(0, 0.3, len(memory.target))
    return learner, layout, memory


def textbook_of(learner, layout, memory):
    textbook = TextbookLearner(learner, layout, memory.parameters)
    textbook.target.copy_from(TextbookLearner(learner, layout, memory.target).online)
    return textbook


@pytest.mark.parametrize(("precision", "close"), [(np.float64, 1e-7), (np.float32, 1e-4)])
@pytest.mark.parametrize("spread", [0.1, 5.0])  # of rewards: within the Huber loss's width, beyond
@pytest.mark.parametrize("network", NETWORKS, ids=str)
def test_gradients_are_those_of_automatic_differentiation(network, spread, precision, close):
    learner, layout, memory = made(network, precision, batch_size=16, replay_size=64)
    memory.replay[:] = transitions(np.random.default_rng(0), 64, INPUTS, ACTIONS, spread)
    batch = np.random.default_rng(1).integers(64, size=16)
    textbook = textbook_of(learner, layout, memory)
    rows = memory.replay[batch]
    double_dqn_loss(textbook.online, textbook.target, rows, learner.discount).backward()
    loss_gradient(memory, learner.discount, batch)
    assert memory.gradient == pytest.approx(textbook.online.gradient(), abs=close)


@pytest.mark.parametrize("clip", ["global", "variable", "none"])
@pytest.mark.parametrize("network", [NETWORKS[1], NETWORKS[2]], ids=str)
def test_an_update_shortens_the_gradient_as_asked(network, clip):
    learner, layout, memory = made(network, clip=clip, gradient_limit=0.05, replay_size=32)
    memory.replay[:] = transitions(np.random.default_rng(0), 32, INPUTS, ACTIONS, 5.0)
    textbook = textbook_of(learner, layout, memory)
    update(as_numbers(learner), memory, np.arange(32))
    textbook.update(memory.replay)
    assert memory.gradient == pytest.approx(textbook.online.gradient(), abs=1e-8)
    assert (np.linalg.norm(memory.gradient) > 0.2) == (clip == "none")


@pytest.mark.parametrize("clip", ["global", "variable"])
def test_a_thousand_updates_stay_together(clip):
    """Terminals, renewed targets and a replay that overflows; batches from the same stream."""
    learner, layout, memory = made(
        Network((8, 6), "tanh", 5), batch_size=8, replay_size=400, learning_starts=100,
        target_every=150, clip=clip, gradient_limit=0.2, learning_rate=1e-3,
    )  # fmt: skip
    textbook = textbook_of(learner, layout, memory)
    settings, mine, same = as_numbers(learner), stream("batches"), stream("batches")
    rows = transitions(np.random.default_rng(5), 1_099, INPUTS, ACTIONS, 2.0)
    kept = []
    for seen, row in enumerate(rows, 1):
        observation, next_observation = row[:INPUTS], row[INPUTS : 2 * INPUTS]
        happened = transition(
            observation, int(row[-3]), float(row[-2]), next_observation, bool(row[-1] == 0)
        )
        learn(settings, memory, happened, RATES, mine)
        kept.append(row)
        if seen >= 100:
            among = min(seen, 400)
            chosen = [int(draw(same) * among) for _ in range(8)]
            # The replay is a ring: place p holds the newest transition whose number is p mod 400.
            newest = [p + (seen - 1 - p) // 400 * 400 for p in chosen]
            textbook.update([kept[number] for number in newest])
        if seen >= 100 and seen % 150 == 0:
            textbook.target.copy_from(textbook.online)
    assert memory.counts.tolist() == [1_099, 1_000]
    moved = np.abs(memory.parameters - make_memory(learner, layout, stream()).parameters).max()
    assert moved > 0.05
    assert memory.parameters == pytest.approx(textbook.online.flat(), abs=1e-4 * moved)
    assert memory.target == pytest.approx(textbook.target.flat(), abs=1e-4 * moved)
    assert np.abs(memory.target - memory.parameters).max() > 1e-3


# Sums of products are rounded once wherever the compiled learner's are: bits can be compared.
@numba.njit(error_model="numpy")
def fused_adam(parameters, moments, gradient, rate, updates):
    """Adam in float32 without any flush."""
    kind = np.float32
    step = kind(rate / (1 - 0.9**updates))
    correction = kind(1 / np.sqrt(1 - 0.999**updates))
    for i in range(len(parameters)):
        slope = gradient[i]
        moments[0, i] = multiply_add(kind(0.9), moments[0, i], kind(0.1) * slope)
        moments[1, i] = multiply_add(kind(0.999), moments[1, i], kind(0.001) * (slope * slope))
        scale = multiply_add(np.sqrt(moments[1, i]), correction, kind(1e-8))
        parameters[i] -= step * moments[0, i] / scale


def numpy_adam(parameters, moments, gradient, rate, updates):
    """The same by whole arrays, each operation rounded by itself."""
    one = np.float32
    moments[0] = one(0.9) * moments[0] + one(0.1) * gradient
    moments[1] = one(0.999) * moments[1] + one(0.001) * (gradient * gradient)
    step = one(rate / (1 - 0.9**updates))
    correction = one(1 / np.sqrt(1 - 0.999**updates))
    parameters -= step * moments[0] / (np.sqrt(moments[1]) * correction + one(1e-8))


def test_flushing_denormal_numbers_changes_no_parameter():
    """Units fall silent, as rectified ones do, wake up and fall silent for good."""
    learner, layout, memory = made(
        Network((16, 8), "relu"), np.float32, batch_size=8, replay_size=512, clip="none"
    )
    memory.replay[:] = transitions(np.random.default_rng(0), 512, INPUTS, ACTIONS, 1.0)
    silent = memory.replay.copy()
    named_parameters(layout, memory.parameters)["hidden_1.bias"][:8] = -1.0
    memory.replay[:, 2 * INPUTS + 1] *= 1e-3
    settings, generator = as_numbers(learner), np.random.default_rng(1)
    parameters, moments = memory.parameters.copy(), memory.moments.copy()
    rounded, rounded_moments = memory.parameters.copy(), memory.moments.copy()
    denormal = 0
    for updates in range(1, 30_001):
        if updates in (300, 5_000, 5_300):
            memory.replay[:], silent = silent, memory.replay.copy()
        if updates == 6_000:  # so negative that these units never answer again
            named_parameters(layout, memory.parameters)["hidden_1.bias"][:8] = -50.0
            parameters[:] = rounded[:] = memory.parameters
        update(settings, memory, generator.integers(512, size=8))
        fused_adam(parameters, moments, memory.gradient, learner.learning_rate, updates)
        numpy_adam(rounded, rounded_moments, memory.gradient, learner.learning_rate, updates)
        if updates % 500 == 0:
            assert np.array_equal(parameters, memory.parameters)
            assert rounded == pytest.approx(memory.parameters, abs=1e-4)
            denormal += count_denormal(moments)
    assert denormal > 1_000  # the plain moments do fade into them
    assert count_denormal(memory.moments) == 0


def count_denormal(numbers):
    return int(((numbers != 0) & (np.abs(numbers) < np.finfo(np.float32).tiny)).sum())


def test_nothing_is_learned_before_there_is_enough_to_draw_from():
    learner, _, memory = made(Network((8, 6)), learning_starts=5, replay_size=10)
    before = memory.parameters.copy()
    ones, batches = np.ones(INPUTS, np.float32), stream("batches")
    for number in range(1, 6):
        happened = transition(ones, 1, 2.0, ones, False)
        learn(as_numbers(learner), memory, happened, RATES, batches)
        assert np.array_equal(memory.parameters, before) == (number < 5)


def test_the_oldest_transition_gives_way_and_a_truncation_is_no_end():
    _, _, memory = made(Network((8, 6)), replay_size=3)
    for number in range(5):
        here, there = (np.full(INPUTS, number + part, np.float32) for part in (0.0, 0.5))
        remember(memory, transition(here, number % ACTIONS, -number, there, number == 4))
    assert memory.replay[:, 0].tolist() == [3, 4, 2]
    assert memory.replay[:, INPUTS].tolist() == [3.5, 4.5, 2.5]
    assert memory.replay[:, -3:].tolist() == [[0, -3, 1], [1, -4, 0], [2, -2, 1]]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("discount", 0.0),
        ("learning_rate", 0.0),
        ("batch_size", 0),
        ("replay_size", 0),
        ("learning_starts", 0),
        ("target_every", 0),
        ("clip", "both"),
        ("gradient_limit", 0.0),
        ("network", {"hidden": (0,)}),
        ("network", {"activation": "elu"}),
        ("network", {"dueling": -1}),
    ],
)
def test_numbers_out_of_range_are_named(field, value):
    with pytest.raises(RequestError, match=rf"learner: .*{field}"):
        checked(DoubleDQN, {field: value}, "learner")
