"""Values of networks: against plain NumPy, and files that do not lie about what they hold."""

import contextlib
import json
import pickle

import numpy as np
import pytest

import qbumpers
from qbumpers import RequestError, load_values
from qbumpers.networks import Network
from qbumpers.networks.network import named_parameters
from qbumpers.values import NetworkValues
from tests.values.networks import network_of

SHAPES = [
    Network((5, 4)),
    Network((6,), "relu"),
    Network(()),
    Network((5,), "tanh", 3),
    Network((), "relu", 4),
]


def plain(values, observations):
    """The network as a textbook says, in float64."""
    arrays = {k: v.astype(np.float64) for k, v in named_parameters(*_laid_out(values)).items()}
    squash = np.tanh if values.network.activation == "tanh" else lambda x: np.maximum(x, 0)

    def layer(name, units):
        return units @ arrays[f"{name}.weight"] + arrays[f"{name}.bias"]

    units = np.asarray(observations, np.float64)
    for number in range(1, len(values.network.hidden) + 1):
        units = squash(layer(f"hidden_{number}", units))
    if not values.network.dueling:
        return layer("values", units)
    value = layer("value", squash(layer("value_units", units)))
    advantages = layer("advantages", squash(layer("advantage_units", units)))
    return value + advantages - advantages.mean(axis=-1, keepdims=True)


def _laid_out(values):
    return values.layout, values.parameters


@pytest.mark.parametrize("network", SHAPES)
def test_values_are_those_of_the_textbook_network(network):
    values = network_of(network=network)
    observations = np.random.default_rng(1).normal(size=(20, 3))
    expected = plain(values, observations)
    assert values(observations) == pytest.approx(expected, abs=2e-6)
    assert values(observations[0]) == pytest.approx(expected[0], abs=2e-6)
    assert values(observations[0]).dtype == np.float64


@pytest.mark.parametrize("shape", [(), (2,), (4,), (2, 2, 3), (5, 4)])
def test_an_observation_of_another_shape_is_refused(shape):
    with pytest.raises(RequestError, match=r"an observation has shape .*; \(3,\) is needed"):
        network_of()(np.zeros(shape))


def test_parameters_are_copied_and_cannot_be_changed():
    values = network_of()
    with pytest.raises(ValueError, match="read-only"):
        values.parameters[0] = 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": np.zeros(7)}, r"parameters have shape \(7,\).* needs \(54,\)"),
        ({"parameters": np.full(54, np.nan)}, "every parameter must be finite"),
        ({"discount": 1.5}, r"discount = 1\.5; it must lie in \(0, 1\]"),
    ],
)
def test_wrong_numbers_are_named(changes, message):
    fields = {
        "network": Network((5, 4)), "inputs": 3, "actions": 2, "parameters": np.zeros(54),
        "discount": 0.9, "task": "a task", "method": "by hand", **changes,
    }  # fmt: skip
    with pytest.raises(RequestError, match=message):
        NetworkValues(**fields)


@pytest.mark.parametrize("network", SHAPES)
def test_a_file_gives_back_the_values_and_where_they_came_from(tmp_path, network):
    values = network_of(network=network)
    values.save(tmp_path / "values.npz")
    loaded = load_values(tmp_path / "values.npz")
    assert isinstance(loaded, NetworkValues)
    assert loaded.parameters.tobytes() == values.parameters.tobytes()
    assert loaded.network == network
    assert (loaded.inputs, loaded.actions, loaded.discount) == (3, 2, 0.9)
    assert (loaded.task, loaded.method) == ("a task", "by chance")
    assert loaded.version == qbumpers.__version__


def test_values_travel_to_other_processes():
    values = network_of()
    assert pickle.loads(pickle.dumps(values)).digest() == values.digest()


def test_the_digest_is_of_what_decides():
    made = network_of()
    assert network_of(task="other", method="other").digest() == made.digest()
    others = [network_of(seed=1), network_of(discount=0.8), network_of(network=Network((4, 5)))]
    others.append(network_of(network=Network((5, 4), "relu")))
    assert len({each.digest() for each in [made, *others]}) == 5


@pytest.fixture
def archive(tmp_path):
    """Arrays and provenance of a file, and how to write and read them back changed."""
    path = tmp_path / "values.npz"
    network_of().save(path)
    with np.load(path) as file:
        arrays = dict(file.items())

    def rewritten(change):
        changed = dict(arrays)
        provenance = json.loads(str(changed.pop("provenance")))
        change(changed, provenance)
        np.savez(path, **changed, provenance=json.dumps(provenance))
        return load_values(path)

    return rewritten


@pytest.mark.parametrize(
    ("name", "array", "message"),
    [
        ("hidden_2.weight", np.zeros((4, 5), "f4"), r"hidden_2\.weight is float32 \[4, 5\]; "
         r"float32 \[5, 4\] is needed"),
        ("values.bias", np.zeros(2, "f2"), r"values\.bias is float16 \[2\]; float32 \[2\]"),
        ("values.bias", np.zeros(2, "f8"), r"values\.bias is float64"),
        ("values.weight", None, r"values\.weight is missing; float32 \[4, 2\] is needed"),
        ("hidden_1.bias", np.full(5, np.inf, "f4"), "every parameter must be finite"),
        ("hidden_1.bias", np.zeros(5, "f4"), "do not match its hash"),
    ],
)  # fmt: skip
def test_an_array_that_does_not_suit_is_named_with_what_is_needed(archive, name, array, message):
    def change(arrays, _):
        del arrays[name]
        if array is not None:
            arrays[name] = array

    with pytest.raises(RequestError, match=rf"values file .*values\.npz: .*{message}"):
        archive(change)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("network", {"hidden": [5, 0], "activation": "tanh", "dueling": 0}, r"network: hidden\.1"),
        ("network", {"hidden": [5, 4], "activation": "elu", "dueling": 0}, "activation = 'elu'"),
        ("network", {"hidden": [4096] * 9, "activation": "relu", "dueling": 0}, r"\[3, 4096\]"),
        ("network", 7, "not a file of Q values"),
        ("inputs", 4, r"hidden_1\.weight is float32 \[3, 5\]; float32 \[4, 5\]"),
        ("discount", 0.95, "do not match its hash"),
        ("surprise", 1, "not a file of Q values"),
    ],
)
def test_a_provenance_that_does_not_suit_is_refused(archive, field, value, message):
    with pytest.raises(RequestError, match=message):
        archive(lambda _, provenance: provenance.update({field: value}))


def test_pickled_arrays_are_never_read(archive):
    def change(arrays, _):
        arrays["values.bias"] = np.array([print, print], object)

    with pytest.raises(RequestError, match="not a file of Q values"):
        archive(change)


def test_a_changed_byte_is_refused_or_of_no_consequence(tmp_path):
    path = tmp_path / "values.npz"
    network_of().save(path)
    content, digest = path.read_bytes(), network_of().digest()
    for place in range(0, len(content), 3):
        changed = bytearray(content)
        changed[place] ^= 0xFF
        path.write_bytes(changed)
        with contextlib.suppress(RequestError):
            assert load_values(path).digest() == digest
