"""The cache of compiled code, tried on a small package with a copy of the module in it."""

import errno
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from qbumpers import compilation
from qbumpers.kept_code import CodeFiles, DamagedCodeError
from tests.narrowing import of_kind, present

RULE = """
from pocket.compilation import compiled
@compiled
def rule():
    return {answer}
"""
LOOP = """
from pocket.compilation import compiled, compiled_for_session
from pocket.rule import rule
@compiled
def loop():
    return rule()
@compiled_for_session
def own_loop():
    return rule()
"""
SHOW = """
from pocket.loop import loop, own_loop
print(loop(), own_loop(), sum(loop.stats.cache_hits.values()))
"""
FULL_DISK = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
"""


@pytest.fixture
def package(tmp_path):
    folder = tmp_path / "pocket"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "compilation.py").write_text(Path(compilation.__file__).read_text())
    (folder / "rule.py").write_text(RULE.format(answer=1))
    (folder / "loop.py").write_text(LOOP)
    return folder


def run(package, before="", **environment):
    """What a fresh process prints and what it says in warnings."""
    inherited = {name: v for name, v in os.environ.items() if not name.startswith("NUMBA_")}
    finished = subprocess.run(
        [sys.executable, "-c", before + SHOW],
        cwd=package.parent,
        env={**inherited, "PYTHONDONTWRITEBYTECODE": "1", **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    said = [line for line in finished.stderr.splitlines() if "Warning: " in line]
    return tuple(int(word) for word in finished.stdout.split()), said


def shown(package, **environment):
    """(what the loop returns, what the session's loop returns, loops found on disk)."""
    found, said = run(package, **environment)
    assert said == []
    return found


def stamp(package):
    """`source_stamp` of the package, as a fresh process would compute it."""
    path = package / "compilation.py"
    spec = present(importlib.util.spec_from_file_location("pocket_compilation", path))
    module = importlib.util.module_from_spec(spec)
    present(spec.loader).exec_module(module)
    return module.source_stamp()


def test_a_cached_loop_is_found_again_and_notices_a_change_in_another_file(package):
    assert shown(package) == (1, 1, 0)
    assert shown(package) == (1, 1, 1)
    (package / "rule.py").write_text(RULE.format(answer=2))
    assert shown(package) == (2, 2, 0)


def test_code_compiled_for_a_session_is_not_kept_on_disk(package, tmp_path):
    cache = tmp_path / "cache"
    shown(package, NUMBA_CACHE_DIR=str(cache))
    kept = {path.name.split("-")[0] for path in cache.rglob("*.nbc")}
    assert kept == {"loop.loop", "rule.rule"}


def nowhere(package, tmp_path):
    """The environment of a process that finds no folder for compiled code."""
    # A plain file where each folder would be: it stops even a user who may write anywhere.
    (package / "__pycache__").touch()
    blocked = tmp_path / "blocked"
    blocked.touch()
    return {name: str(blocked / "home") for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA")}


@pytest.mark.slow
def test_without_a_folder_for_the_cache_functions_are_compiled_every_time(package, tmp_path):
    environment = nowhere(package, tmp_path)
    for _ in range(2):
        found, said = run(package, **environment)
        assert found == (1, 1, 0)
        assert len(said) == 1
        assert "compiled code cannot be kept (no folder for it can be written)" in said[0]
    assert list(tmp_path.rglob("*.nb?")) == []


@pytest.mark.slow
def test_on_a_full_disk_functions_are_compiled_with_one_warning(package):
    found, said = run(package, FULL_DISK)
    assert found == (1, 1, 0)
    assert len(said) == 1
    assert f"compiled code cannot be kept (in {package / '__pycache__'}: File too large)" in said[0]
    assert list((package / "__pycache__").iterdir()) == []


def emptied(content):
    return b""


def cut_short(content):
    return content[: len(content) // 2]


def changed(content):
    """With one bit of the compiled code itself turned round."""
    place = len(content) // 2
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


@pytest.mark.parametrize(
    "damage", [cut_short, *(pytest.param(d, marks=pytest.mark.slow) for d in (emptied, changed))]
)
def test_damaged_code_is_made_again_with_one_warning(package, damage):
    shown(package)
    kept = sorted((package / "__pycache__").glob("*.nbc"))
    assert len(kept) == 2
    for path in kept:
        path.write_bytes(damage(path.read_bytes()))
    found, said = run(package)
    assert found == (1, 1, 0)
    assert len(said) == 1
    assert "compiled code cannot be used" in said[0]
    assert "was damaged" in said[0]
    assert shown(package) == (1, 1, 1)


def test_two_processes_that_keep_code_at_once_do_not_mix_it_up(tmp_path):
    first, second = (CodeFiles(tmp_path, "loop", "sources") for _ in range(2))
    first.save(("int64",), "code for int64")
    second.save(("float64",), "code for float64")
    second.save(("int64",), "code for int64")
    for files in (first, second, CodeFiles(tmp_path, "loop", "sources")):
        assert files.load(("int64",)) == "code for int64"
        assert files.load(("float64",)) == "code for float64"
        assert files.load(("bool",)) is None


def test_code_of_other_types_of_the_same_name_is_not_taken(tmp_path):
    class Kind:
        def __init__(self, number):
            self.number = number

        def __eq__(self, other):
            return self.number == other.number

        def __hash__(self):
            return hash(self.number)

        def __repr__(self):
            return "Kind"

    files = CodeFiles(tmp_path, "loop", "sources")
    files.save(Kind(1), "code of the first")
    assert files.load(Kind(2)) is None
    assert files.load(Kind(1)) == "code of the first"


def test_code_of_other_sources_is_removed_and_that_of_other_functions_is_not(tmp_path):
    CodeFiles(tmp_path, "loop", "old").save("types", "old code")
    CodeFiles(tmp_path, "other", "old").save("types", "other code")
    new = CodeFiles(tmp_path, "loop", "new")
    assert new.load("types") is None
    new.save("types", "new code")
    assert new.load("types") == "new code"
    assert CodeFiles(tmp_path, "loop", "old").load("types") is None
    assert CodeFiles(tmp_path, "other", "old").load("types") == "other code"
    new.flush()
    assert new.load("types") is None


def test_code_that_cannot_be_written_leaves_nothing_behind(tmp_path, monkeypatch):
    def fill(path, content):
        with path.open("wb") as file:
            file.write(content[:3])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    files = CodeFiles(tmp_path, "loop", "sources")
    monkeypatch.setattr(Path, "write_bytes", fill)
    with pytest.raises(OSError, match="No space left on device"):
        files.save("types", "code")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    files.save("types", "code")
    [path] = tmp_path.iterdir()
    path.write_bytes(b"")
    with pytest.raises(DamagedCodeError, match=r"loop\..*\.nbc was damaged"):
        files.load("types")


def edit(package):
    (package / "rule.py").write_text(RULE.format(answer=2))


def add(package):
    (package / "extra.py").touch()


def rename(package):
    (package / "loop.py").rename(package / "hoop.py")


def add_in_a_folder(package):
    (package / "inner").mkdir()
    (package / "inner" / "deep.py").touch()


@pytest.mark.parametrize("change", [edit, add, rename, add_in_a_folder])
def test_the_stamp_changes_with_every_source_of_the_package(package, change):
    before = stamp(package)
    assert stamp(package) == before
    change(package)
    assert stamp(package) != before


def test_the_stamp_ignores_files_that_are_not_sources(package):
    before = stamp(package)
    (package / "notes.txt").write_text("nothing")
    assert stamp(package) == before


def test_the_stamp_covers_every_source_that_is_compiled(tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(Path(compilation.__file__).parent, copy)
    marks = ("@compiled", "@register_jitable", "@overload", "@intrinsic")
    sources = [path for path in copy.rglob("*.py") if any(m in path.read_text() for m in marks)]
    assert len(sources) > 5
    for source in sources:
        before = stamp(copy)
        source.write_text(source.read_text() + "\n# changed\n")
        assert stamp(copy) != before, source.name


class Pair(NamedTuple):
    first: int
    second: float


@compilation.compiled_for_session
def _weigh(numbers, pair, nested):
    return numbers.sum() * pair.second + pair.first + nested[0][1]


def test_entered_code_gives_what_the_function_gives_and_compiles_once():
    examples = (np.zeros(2), Pair(0, 0.0), ((0, 0.0), 1))
    entry = compilation.entered(_weigh, *examples)
    assert len(of_kind(Dispatcher, _weigh).signatures) == 1
    arguments = (np.array([1.5, 2.0, 4.0]), Pair(3, 0.25), ((7, 0.125), 9))
    assert entry(*arguments) == _weigh(*arguments) == 7.5 * 0.25 + 3 + 0.125
    compilation.entered(_weigh, *examples)
    assert len(of_kind(Dispatcher, _weigh).signatures) == 1


def test_a_function_that_is_not_compiled_is_entered_as_it_is():
    plain = compilation.uncompiled(_weigh)
    assert compilation.entered(plain, np.zeros(2)) is plain


hold = compilation.compiled_for_session(compilation.uncompiled(compilation.hold))


@compilation.compiled_for_session
def _grow(common, amount):
    pair, numbers = common.content
    numbers[0] += amount
    return pair.first + numbers.sum()


def test_held_values_are_entered_with_and_stay_the_same_arrays():
    numbers = np.array([1.0, 2.0])
    common = hold((Pair(3, 0.5), numbers))
    entry = compilation.entered(_grow, common, 0.0)
    assert entry(common, 4.0) == 3 + 7
    numbers[1] = 10.0
    assert entry(common, 1.0) == 3 + 16
    assert numbers.tolist() == [6.0, 10.0]


def test_held_values_outlive_the_names_of_their_arrays():
    common = hold((Pair(1, 0.5), np.full(1000, 2.0)))
    others = [np.full(1000, 9.0) for _ in range(50)]  # would reuse memory that was given back
    assert len(others) == 50
    assert _grow(common, 0.0) == 1 + 2000
