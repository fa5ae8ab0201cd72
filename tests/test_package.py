"""What `import qbumpers` gives, and what it leaves for later."""

import importlib.util
import subprocess
import sys

import pytest

import qbumpers


def run(program: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout.strip()


@pytest.mark.parametrize("heavy", ["numba", "scipy", "polars", "matplotlib", "pydantic", "PIL"])
def test_importing_the_package_loads_nothing_heavy(heavy):
    assert importlib.util.find_spec(heavy), "it is installed, so it could have been loaded"
    assert run(f"import sys, qbumpers; print({heavy!r} in sys.modules)") == "False"


def test_importing_the_package_registers_its_environment():
    program = (
        "import gymnasium, qbumpers\n"
        "print(gymnasium.make('qbumpers/CliffWalking-v0').spec.max_episode_steps)"
    )
    assert run(program) == "100"


@pytest.mark.parametrize("name", qbumpers.__all__)
def test_every_public_name_is_there(name):
    assert getattr(qbumpers, name) is not None
    assert name in dir(qbumpers)


def test_public_names_are_those_of_their_modules():
    for name in ("SharedControl", "TabularTask", "RequestError", "simulate", "solve"):
        assert getattr(qbumpers, name).__name__ == name


def test_all_public_names_come_with_a_star():
    program = "from qbumpers import *; print(SharedControl.__name__, solve.__name__)"
    assert run(program) == "SharedControl solve"


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"qbumpers.*bumpers"):
        # Reading it is the test.
        qbumpers.bumpers  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]
    assert not hasattr(qbumpers, "simulator")
