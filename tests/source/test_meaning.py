"""What code means changes with what it does, wherever that is written, and with nothing else."""

import importlib
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

from qbumpers.source import meaning_of, version_of

HELPERS = """
LIMIT = 0.5
SCALES = {"near": 1.0, "far": [2.0, 3.0]}

def scaled(value):
    return value * LIMIT

def unused(value):
    return value
"""

MINE = """
import functools
import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

import helpers
from helpers import SCALES
from qbumpers.choice import best_value as best_of

WEIGHTS = np.array([1.0, 2.0])
GAIN = 2.0

class Options(NamedTuple):
    alpha: Annotated[float, Field(ge=0)] = 0.3
    how: Literal["best", "second-best"] = "best"

class Base:
    shift = 1.0

    def moved(self, value):
        return value + self.shift

class Table(Base):
    def __init__(self, size):
        self.size = size

    def look(self, value):
        return math.floor(value) % self.size

TABLE = Table(3)

def noisy(factor):
    def decorate(function):
        @functools.wraps(function)
        def changed(*arguments):
            return factor * function(*arguments)
        return changed
    return decorate

@functools.cache
def cached(value):
    return value + 1.0

@noisy(1.5)
def decorated(value, power=2):
    return value ** power

def made(step):
    return lambda value: value + step

stepped = made(4.0)

def mine(situation, noise, options):
    from helpers import scaled as late
    found = helpers.scaled(best_of(situation)) + cached(GAIN) + decorated(3.0)
    found += WEIGHTS.sum() + SCALES["near"] + TABLE.look(found) + stepped(found) + late(1.0)
    return [np.maximum(found, each) for each in range(3)]
"""

SAME = {
    "a comment": ("    found = helpers", "    # why\n    found = helpers"),
    "a docstring": ("options):\n    from", 'options):\n    """Why."""\n    from'),
    "a docstring of a class": ("(NamedTuple):\n", '(NamedTuple):\n    """Why."""\n'),
    "lines": ("GAIN = 2.0", "GAIN = 2.0\n\n\n"),
    "types of arguments": ("mine(situation, noise", "mine(situation: float, noise: int"),
    "parentheses": ("GAIN) + decorated(3.0)", "GAIN) + (decorated(3.0))"),
    "another function": ("GAIN = 2.0", "GAIN = 2.0\ndef other():\n    return 7\n"),
    "in another module, what is not used": ("    return value\n", "    return -value\n"),
}

OTHER = {
    "the function": ('SCALES["near"] + TABLE', 'SCALES["near"] - TABLE'),
    "a constant": ("GAIN = 2.0", "GAIN = 2.5"),
    "a constant of another module": ("LIMIT = 0.5", "LIMIT = 0.25"),
    "a function of another module": ("value * LIMIT", "value / LIMIT"),
    "a collection": ("[2.0, 3.0]", "[2.0, 3.5]"),
    "an array": ("[1.0, 2.0]", "[1.0, 2.5]"),
    "a decorator's argument": ("@noisy(1.5)", "@noisy(2.5)"),
    "what a decorator does": ("factor * function", "factor + function"),
    "what is decorated": ("value ** power", "value * power"),
    "a default": ("power=2", "power=3"),
    "a cached function": ("value + 1.0", "value + 1.5"),
    "a closure": ("made(4.0)", "made(5.0)"),
    "a lambda": ("value + step", "value - step"),
    "an object": ("Table(3)", "Table(4)"),
    "a method": ("math.floor", "math.ceil"),
    "a base class": ("value + self.shift", "value - self.shift"),
    "a class attribute": ("shift = 1.0", "shift = 2.0"),
    "a default of options": ("= 0.3", "= 0.4"),
    "the order of texts": ('"best", "second-best"', '"second-best", "best"'),
    "a name of the package": ("import best_value as", "import pick as"),
    "an import within": ("import scaled as late", "import unused as late"),
}


@pytest.fixture
def meaning(tmp_path, monkeypatch):
    """What `mine` and its options mean if these are the files of its modules."""
    places = iter(range(9))

    def found(mine=MINE, helpers=HELPERS):
        place = tmp_path / str(next(places))
        place.mkdir()
        for name, text in (("mine", mine), ("helpers", helpers)):
            (place / f"{name}.py").write_text(text, encoding="utf-8")
            monkeypatch.delitem(sys.modules, name, raising=False)
        with monkeypatch.context() as patch:
            patch.syspath_prepend(place)
            importlib.invalidate_caches()
            module = importlib.import_module("mine")
            return meaning_of({"mine": (module.mine, module.Options)})

    yield found
    for name in ("mine", "helpers"):
        sys.modules.pop(name, None)


def changed(change):
    old, new = change
    assert (MINE + HELPERS).count(old) >= 1
    return MINE.replace(old, new, 1), HELPERS if old in MINE else HELPERS.replace(old, new)


@pytest.mark.parametrize("change", SAME.values(), ids=list(SAME))
def test_what_changes_nothing_is_not_seen(meaning, change):
    first = meaning()
    assert first == meaning(*changed(change))
    assert first.unknown == ()
    assert {"mine.mine", "helpers.scaled", "helpers.LIMIT", "mine.TABLE"} <= first.code.keys()


@pytest.mark.parametrize("change", OTHER.values(), ids=list(OTHER))
def test_what_changes_anything_is_seen(meaning, change):
    first, second = meaning(), meaning(*changed(change))
    assert second.unknown == ()
    assert first.code != second.code


def test_packages_are_named_with_their_versions_and_python_is_not(meaning):
    found = meaning()
    assert found.packages["numpy"] == np.__version__
    assert set(found.packages) == {"numpy", "pydantic"}
    assert found.of_package == {"qbumpers.choice"}
    assert found.modules == {"mine", "helpers"}


def test_a_file_that_was_edited_since_it_was_imported_is_not_what_runs(meaning, tmp_path):
    meaning()
    (tmp_path / "0" / "helpers.py").write_text(HELPERS.replace("* LIMIT", "/ LIMIT"))
    found = meaning_of({"helper": sys.modules["helpers"].scaled})
    assert found.unknown == ("the source of helpers.scaled is not what runs: it was edited since",)
    (tmp_path / "0" / "helpers.py").write_text("# moved down\n\n" + HELPERS)
    assert meaning_of({"helper": sys.modules["helpers"].scaled}).unknown == ()


def test_what_has_no_source_is_unknown():
    space = {"__name__": "typed"}
    exec("def typed(value):\n    return value", space)
    assert meaning_of({"rule": space["typed"]}).unknown == ("there is no source of typed.typed",)
    kind = type("Made", (), {"__module__": __name__})
    assert meaning_of({"kind": kind}).unknown == (f"there is no source of {__name__}.Made",)
    assert meaning_of({"lock": threading.Lock()}).unknown == (
        "what lock holds, a lock, cannot be read",
    )


def test_a_script_means_the_same_as_the_module_that_others_import(tmp_path):
    (tmp_path / "script.py").write_text(
        textwrap.dedent("""
        from qbumpers.source import meaning_of

        def rule(value):
            return value + 1

        print(sorted(meaning_of({"rule": rule}).code.items()))
        """)
    )
    printed = [
        subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True, check=True
        ).stdout
        for arguments in (["script.py"], ["-m", "script"], ["-c", "import script"])
    ]
    assert "script.rule" in printed[0]
    assert printed == [printed[0]] * 3


def test_the_same_code_means_the_same_in_every_process():
    """Sets of texts, for one, are in another order in each."""
    program = "\n".join(
        [
            "from tests.source.test_meaning import meaning_of",
            "print(meaning_of({'set': {'a', 'b', 'c', 'd'}, 'f': meaning_of}).code)",
        ]
    )
    printed = {
        subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    }
    assert len(printed) == 1


def test_versions_are_those_of_installed_distributions():
    assert version_of("numpy.linalg") == {"numpy": np.__version__}
    assert [version_of(name) for name in ("math", "qbumpers.choice", __name__)] == [{}, {}, {}]
