"""A run goes on from whatever is whole in its folder, and ends in the same bytes."""

import contextlib
import errno
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments import cells, work
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.store import load
from qbumpers.experiments.writing import open_store
from qbumpers.files import LocalFolder, StoreError
from tests.experiments.examples import BUMPERS, cells_of, contents_of, rows_of, run_into

TABLES = ("episodes.parquet", "states.parquet")


@pytest.fixture
def simulated(monkeypatch):
    """Trials that are simulated from now on, by the name of the assistant and its alpha."""
    done = []

    def spy(condition, *, trials, seed):
        done.append((condition.assistant.name, *condition.assistant.options[:1], trials))
        return simulate(condition, trials=trials, seed=seed)

    simulate = work.run_condition
    monkeypatch.setattr(work, "run_condition", spy)
    return done


def modified(paths):
    return {path: (path.stat().st_mtime_ns, path.stat().st_ino) for path in paths}


def test_nothing_is_simulated_or_written_twice(folder, whole, simulated):
    before = modified(cells_of(folder))
    run_into(folder)
    assert simulated == []
    assert modified(cells_of(folder)) == before
    assert contents_of(folder, *TABLES) == contents_of(whole, *TABLES)


def test_a_folder_may_have_any_name(tmp_path, whole, simulated):
    folder = run_into(tmp_path / "try[final]")
    simulated.clear()
    run_into(folder)
    assert simulated == []
    assert rows_of(folder) == rows_of(whole)
    assert load(folder).episodes.height == 3 * 5 * 4


def test_a_finished_run_reports_all_its_trials_at_once(folder):
    reports = []
    run_into(folder, report=reports.append)
    assert reports == [(15, 15, 0, 0.0, [], [])]


def test_only_new_conditions_are_simulated(folder, simulated):
    run_into(folder, assistants=[{"name": "none"}, {**BUMPERS, "alpha": [0.3, 0.5, 0.7]}])
    assert simulated == [("stochastic-q-bumpers", 0.5, range(5))]


def test_only_new_learners_are_simulated(tmp_path, simulated):
    none: dict[str, Any] = {"assistants": [{"name": "none"}]}
    run_into(tmp_path, learners=[{"perception": "observant"}], **none)
    before = rows_of(tmp_path)
    simulated.clear()
    run_into(tmp_path, learners=[{"perception": ["transition", "observant"]}], **none)
    assert simulated == [("none", range(5))]
    after = [row for key, row in rows_of(tmp_path).items() if key[0].endswith("observant")]
    assert [row[4:] for row in after] == [row[4:] for row in before.values()]


@pytest.mark.parametrize("reading", [{"criterion": -20.0}, {"reproduces": "cliff-walking"}])
def test_another_reading_of_the_results_simulates_nothing(folder, whole, simulated, reading):
    run_into(folder, **reading)
    assert simulated == []
    assert contents_of(folder, *TABLES) == contents_of(whole, *TABLES)
    found = load(folder).experiment.model_dump()
    assert found.items() >= reading.items()


def test_only_new_blocks_of_trials_are_simulated(tmp_path, monkeypatch, simulated):
    monkeypatch.setattr(cells, "EPISODES_A_CELL", 2 * 4)
    run_into(tmp_path, trials=4, assistants=[{"name": "none"}])
    run_into(tmp_path, trials=8, assistants=[{"name": "none"}])
    blocks = [trials for _, trials in simulated]
    assert blocks == [range(0, 2), range(2, 4), range(4, 6), range(6, 8)]


def test_an_interrupted_run_keeps_its_finished_cells(tmp_path, monkeypatch, whole, simulated):
    monkeypatch.setattr(cells, "EPISODES_A_CELL", 2 * 4)

    def interrupt(progress):
        if progress.trials >= 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_into(tmp_path, report=interrupt)
    kept = cells_of(tmp_path)
    assert len(kept) >= 3 * 2
    with pytest.raises(RequestError, match="the run is not finished; run it again to continue"):
        load(tmp_path)
    simulated.clear()
    run_into(tmp_path)
    assert len(simulated) == 9 - len(kept) // 2
    assert rows_of(tmp_path) == rows_of(whole)


@pytest.mark.parametrize("kind", ["episodes", "states"])
@pytest.mark.parametrize("damage", ["deleted", "emptied", "halved", "cut by a byte", "overwritten"])
def test_a_damaged_cell_is_computed_again(folder, whole, simulated, kind, damage):
    cell = next(path for path in cells_of(folder) if f"-{kind}-" in path.name)
    content = cell.read_bytes()
    spoiled = {
        "emptied": b"",
        "halved": content[: len(content) // 2],
        "cut by a byte": content[:-1],
        "overwritten": b"\0" * len(content),
    }
    if damage == "deleted":
        cell.unlink()
    else:
        cell.write_bytes(spoiled[damage])
    others = modified(path for path in cells_of(folder) if path.parent != cell.parent)
    reports = []
    run_into(folder, report=reports.append)
    assert len(simulated) == 1
    assert (reports[0].trials, reports[-1].trials) == (10, 15)
    named = [] if damage == "deleted" else [str(cell.relative_to(folder))]
    assert {tuple(report.damaged) for report in reports} == {tuple(named)}
    assert modified(others) == others
    assert contents_of(folder, *TABLES, "cells/**/*") == contents_of(whole, *TABLES, "cells/**/*")


def test_a_missing_or_damaged_table_is_put_together_again(folder, whole, simulated):
    (folder / "episodes.parquet").write_bytes(b"PAR1")
    (folder / "states.parquet").unlink()
    run_into(folder)
    assert simulated == []
    assert contents_of(folder, *TABLES) == contents_of(whole, *TABLES)


def opened(folder):
    """The folder as another run of its experiment has it open."""
    plan = make_plan(load(folder).experiment)
    return open_store(folder, plan.experiment, plan.record)


DIFFERENT = {
    "seed": (9, "3", "9"),
    "episodes": (6, "4", "6"),
    "name": ("other", "'small'", "'other'"),
    "values": ("q-learning", "'exact'", "'q-learning'"),
    "retention": (2, "0", "2"),
    "common_random_numbers": (True, "False", "True"),
    "task": (
        {"name": "FrozenLake-v1", "discount": 0.9},
        ".*'name': 'cliff-walking'.*",
        ".*'name': 'FrozenLake-v1'.*",
    ),
}


@pytest.mark.parametrize("field", DIFFERENT)
def test_a_folder_of_another_experiment_is_left_alone(folder, field):
    value, was, now = DIFFERENT[field]
    before = contents_of(folder, "*.*", "cells/**/*.*")
    message = rf"output folder .* holds another experiment \({field} was {was}, now {now}\)"
    with pytest.raises(RequestError, match=message):
        run_into(folder, **{field: value}, assistants=[{"name": "none"}])
    assert contents_of(folder, "*.*", "cells/**/*.*") == before


def test_all_differing_fields_are_named(folder):
    with pytest.raises(RequestError, match=r"\(episodes was 4, now 6; seed was 3, now 9\)"):
        run_into(folder, seed=9, episodes=6)


def test_a_folder_that_another_run_is_writing_to_is_refused(folder, simulated):
    before = contents_of(folder, "*.*", "cells/**/*.*")
    message = rf"output folder {folder}: another run is writing to it; wait for it, or choose"
    with opened(folder), pytest.raises(RequestError, match=message):
        run_into(folder)
    assert simulated == []
    assert contents_of(folder, "*.*", "cells/**/*.*") == before
    run_into(folder)


def test_a_run_that_is_refused_does_not_change_the_design_of_the_one_that_writes(folder):
    before = (folder / "experiment.toml").read_bytes()
    with opened(folder), pytest.raises(RequestError, match="another"):
        run_into(folder, trials=8)
    assert (folder / "experiment.toml").read_bytes() == before


def test_an_experiment_that_another_run_begins_just_before_is_left_alone(tmp_path, monkeypatch):
    """The folder was empty when this run looked, and is another's when it comes to write."""
    locked = LocalFolder.locked

    def come_second(place):
        monkeypatch.setattr(LocalFolder, "locked", locked)
        run_into(tmp_path, seed=9)
        return locked(place)

    monkeypatch.setattr(LocalFolder, "locked", come_second)
    with pytest.raises(RequestError, match=r"holds another experiment \(seed was 9, now 3\)"):
        run_into(tmp_path)
    assert load(tmp_path).experiment.seed == 9


def test_a_file_is_no_output_folder(tmp_path):
    path = tmp_path / "results"
    path.write_text("mine")
    with pytest.raises(RequestError, match=r"output folder .*results: it is a file"):
        run_into(path)
    assert path.read_text() == "mine"


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match=r"cannot write .*file/out/.*: Not a dir"):
        run_into(tmp_path / "file" / "out")


@contextlib.contextmanager
def without_privileges():
    """Root may write anywhere; nobody may not."""
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(user)


@pytest.fixture
def guarded():
    """A folder that everybody may read and nobody but its owner may write."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        folder.chmod(0o555)
        yield folder
        folder.chmod(0o755)


def test_a_folder_that_may_not_be_written_is_named(guarded):
    with (
        without_privileges(),
        pytest.raises(StoreError, match=rf"cannot write {guarded}/out/.*: Permission denied"),
    ):
        run_into(guarded / "out")
    assert list(guarded.iterdir()) == []


@pytest.mark.parametrize("blocked", ["cells", "episodes.parquet", "states.parquet", "values.npz"])
def test_what_stands_in_the_way_of_a_file_is_named(tmp_path, blocked, whole):
    """A folder in the place of a file, or a file in the place of a folder."""
    path = tmp_path / blocked
    path.write_text("mine") if blocked == "cells" else path.mkdir()
    with pytest.raises(StoreError, match=rf"cannot (write|read) {path}.*: (Is a|Not a|File ex)"):
        run_into(tmp_path)
    path.unlink() if blocked == "cells" else path.rmdir()
    run_into(tmp_path)
    assert contents_of(tmp_path, *TABLES) == contents_of(whole, *TABLES)


def test_a_disk_that_fills_up_at_any_write_leaves_only_whole_files(tmp_path, whole, monkeypatch):
    written = []
    monkeypatch.setattr(os, "fsync", written.append)
    run_into(tmp_path / "counting")
    # The conditions, the design, the values, two files for each of three cells, two tables.
    assert len(written) == 1 + 1 + 1 + 3 * 2 + 2
    reference = contents_of(whole, "*.*", "cells/**/*.*")
    for place in range(len(written)):
        folder = tmp_path / f"full at {place}"
        remaining = iter([*[None] * place, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))])

        def fill_up(_, remaining=remaining):
            if error := next(remaining):
                raise error

        monkeypatch.setattr(os, "fsync", fill_up)
        with pytest.raises(
            StoreError, match=rf"cannot write .*{place}/.*: No space left on device"
        ):
            run_into(folder)
        left = contents_of(folder, "*.*", ".*", "cells/**/*.*", "cells/**/.*")
        assert len(left) == place
        assert left.items() <= reference.items()
        monkeypatch.setattr(os, "fsync", lambda _: None)
        run_into(folder)
        assert contents_of(folder, "*.*", "cells/**/*.*") == reference
