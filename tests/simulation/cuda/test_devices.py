"""Which device simulates, and what is said if there is none."""

import importlib.util
import types

import numba.cuda
import pytest

from qbumpers import simulate
from qbumpers.errors import RequestError
from qbumpers.simulation.cuda import devices
from qbumpers.simulation.cuda.devices import Card, device_of


@pytest.fixture
def machine(monkeypatch):
    """A machine with cards and a driver that a test describes."""

    def described(cards=1, driver=(12, 4), toolkit=(12, 9), extra=True, error=None):
        class CudaSupportError(Exception):
            pass

        class Cards:
            def __len__(self):
                if error:
                    raise CudaSupportError(error)
                return cards

        cuda = types.SimpleNamespace(
            gpus=Cards(),
            CudaSupportError=CudaSupportError,
            runtime=types.SimpleNamespace(get_version=lambda: toolkit),
            driver=types.SimpleNamespace(driver=types.SimpleNamespace(get_version=lambda: driver)),
        )
        found = object() if extra else None
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: found)
        monkeypatch.setattr("numba.cuda", cuda)
        monkeypatch.setattr(numba, "cuda", cuda)
        monkeypatch.setattr(devices, "compiles", lambda: True)

    return described


def test_the_processor_is_no_card():
    assert device_of("processor") is None


def test_a_card_is_named_by_its_number(machine):
    machine(cards=2)
    assert device_of("gpu") == Card(0, "float64")
    assert device_of("gpu:1", "float32") == Card(1, "float32")


@pytest.mark.parametrize(
    ("description", "device", "message"),
    [
        ({"extra": False}, "gpu", r"the extra gpu is not installed; pip install 'qbumpers\[gpu\]'"),
        ({"error": "no\ndriver:\n"}, "gpu", "no NVIDIA card can be used here: no driver$"),
        ({"cards": 1}, "gpu:1", "there is 1 card here, counted from 0"),
        ({"driver": (11, 8)}, "gpu", r"one of CUDA 11\.8; one of CUDA 12 or later is needed"),
    ],
)
def test_why_a_card_cannot_be_used_is_said_in_one_sentence(machine, description, device, message):
    machine(**description)
    with pytest.raises(RequestError, match=message):
        device_of(device)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"device": "gpus"}, "device = 'gpus'; 'processor', 'gpu' or the number of a card"),
        ({"device": "gpu:x"}, "device = 'gpu:x'; 'processor', 'gpu' or the number of a card"),
        ({"precision": "float16"}, "precision 'float16'"),
        ({"precision": "float32"}, "precision = 'float32'; a processor simulates in 'float64'"),
    ],
)
def test_what_names_no_device_is_refused_before_anything_runs(given, message):
    with pytest.raises(RequestError, match=message):
        simulate("cliff-walking", "none", trials=1, **given)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--workers", 2, "--on", "gpu"), "cores, or a graphics card; give one"),
        (("--precision", "float32"), "only with --on gpu"),
        (("--on", "gpu:one"), "device = 'gpu:one'"),
    ],
)
@pytest.mark.parametrize(
    "command",
    [
        ("run", "x.toml"),
        ("tune", "x.toml", "--floor", 1),
        ("reproduce", "cliff-walking"),
        ("compare",),
    ],
)
def test_commands_refuse_what_does_not_go_together(call, command, options, message):
    status, _, errors = call(*command, *options)
    assert status == 2
    assert message in errors
