"""What was finished and then spoiled: damage anywhere is noticed, named and mended."""

import shutil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.errors import RequestError
from qbumpers.experiments import cells, work
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load, run_description
from qbumpers.experiments.writing import open_store
from qbumpers.files import StoreError
from tests.experiments.examples import cells_of, contents_of, run_into, settings
from tests.narrowing import present

ALL = ("*.parquet", "*.npz", "cells/**/*")
PLAN = make_plan(make_experiment(settings()))


@pytest.fixture(scope="module")
def spare(whole, tmp_path_factory):
    """A finished run that each example spoils and mends."""
    return shutil.copytree(whole, tmp_path_factory.mktemp("spare") / "run")


def surveyed(folder):
    """How many cells are whole, and which files are damaged."""
    with open_store(folder, PLAN.experiment, PLAN.record) as store:
        found = store.survey(PLAN.experiment.trials)
    return sum(map(len, found.cells.values())), found.damaged


def flipped(content, place, bit):
    spoiled = bytearray(content)
    spoiled[place] ^= 1 << bit
    return bytes(spoiled)


@given(file=st.integers(0, 5), place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_is_noticed_wherever_it_is(spare, file, place, bit):
    path = cells_of(spare)[file]
    content = path.read_bytes()
    path.write_bytes(flipped(content, int(place * len(content)), bit))
    assert surveyed(spare) == (2, [str(path.relative_to(spare))])
    assert not path.exists()
    path.write_bytes(content)
    assert surveyed(spare) == (3, [])


@given(file=st.integers(0, 5), end=st.floats(0, 1, exclude_max=True), more=st.binary(max_size=9))
def test_a_file_cut_off_or_carried_on_is_noticed(spare, file, end, more):
    path = cells_of(spare)[file]
    content = path.read_bytes()
    cut = content[: int(end * len(content))] if not more else content + more
    path.write_bytes(cut)
    assert surveyed(spare) == (2, [str(path.relative_to(spare))])
    path.write_bytes(content)


@pytest.mark.parametrize("kind", ["episodes", "states"])
@pytest.mark.parametrize("place", [0, 5, 0.3, 0.7, -9, -1])
def test_what_a_flipped_bit_spoils_is_told_computed_again_and_equal(folder, whole, kind, place):
    path = next(path for path in cells_of(folder) if f"-{kind}-" in path.name)
    content = path.read_bytes()
    index = int(place * len(content)) if isinstance(place, float) else place
    path.write_bytes(flipped(content, index, 2))
    reports = []
    run_into(folder, report=reports.append)
    assert [report.trials for report in reports] == [10, 15]
    assert {tuple(report.damaged) for report in reports} == {(str(path.relative_to(folder)),)}
    assert contents_of(folder, *ALL) == contents_of(whole, *ALL)


def test_all_damaged_files_are_told_at_once(folder, whole):
    for path in cells_of(folder):
        path.write_bytes(b"")
    reports = []
    run_into(folder, report=reports.append)
    expected = sorted(str(path.relative_to(whole)) for path in cells_of(whole))
    assert (reports[0].trials, sorted(reports[0].damaged)) == (0, expected)
    assert contents_of(folder, *ALL) == contents_of(whole, *ALL)


def test_files_of_others_among_the_cells_are_left_alone(folder, whole):
    place = cells_of(folder)[0].parent
    others = [place / "notes.txt", place / "000000-5-episodes.parquet", place / "x.parquet"]
    for path in others:
        path.write_text("mine")
    reports = []
    run_into(folder, report=reports.append)
    assert [path.read_text() for path in others] == ["mine"] * 3
    assert reports == [(15, 15, 0, 0.0, [], [])]
    assert contents_of(folder, "*.parquet") == contents_of(whole, "*.parquet")


def test_a_cell_that_is_spoiled_while_the_run_goes_on_ends_it(folder):
    """Whatever was surveyed, nothing unread goes into the tables."""
    before = contents_of(folder, "*.parquet")
    path = cells_of(folder)[3]
    with open_store(folder, PLAN.experiment, PLAN.record) as store:
        found = store.survey(PLAN.experiment.trials)
        path.write_bytes(flipped(path.read_bytes(), 40, 0))
        with pytest.raises(StoreError, match=rf"{path.name} was changed .*run it again to mend"):
            store.assemble(found.cells)
    assert contents_of(folder, "*.parquet") == before


def test_cells_of_another_condition_are_not_taken_for_those_of_this_one(folder, whole):
    first, second = sorted({path.parent for path in cells_of(folder)})[:2]
    shutil.rmtree(first)
    reports = []
    run_into(folder, report=reports.append)
    assert reports[0].trials == 10
    assert contents_of(folder, *ALL) == contents_of(whole, *ALL)
    assert contents_of(first, "*") != contents_of(second, "*")


@pytest.mark.parametrize(
    ("number", "age"), [("1", "an older"), ("4", "a newer"), (None, "an older")]
)
@pytest.mark.parametrize("use", [run_into, load], ids=["run", "load"])
def test_a_folder_of_another_version_is_refused_and_left_alone(folder, number, age, use):
    path = folder / "experiment.toml"
    line = "" if number is None else f"format = {number}\n"
    path.write_text(path.read_text().replace("format = 3\n", line))
    before = contents_of(folder, "*.*", "cells/**/*.*")
    message = rf"output folder .*written by {age} version .*\(format {number or 1}, needed 3\)"
    with pytest.raises(RequestError, match=message):
        use(folder)
    assert contents_of(folder, "*.*", "cells/**/*.*") == before


def test_the_format_is_written_down(whole):
    assert run_description(whole)["format"] == 3


def trials_simulated(monkeypatch):
    done = []
    simulate = work.run_condition
    monkeypatch.setattr(
        work,
        "run_condition",
        lambda condition, *, trials, seed: (
            done.append((trials.start, trials.stop))
            or simulate(condition, trials=trials, seed=seed)
        ),
    )
    return done


def test_more_trials_fewer_and_more_again_compute_nothing_that_is_there(tmp_path, monkeypatch):
    done = trials_simulated(monkeypatch)
    by_count = {}
    for count, expected in [(130, [(0, 130)]), (200, [(130, 200)]), (120, [(0, 120)]), (200, [])]:
        done.clear()
        run_into(tmp_path, trials=count, assistants=[{"name": "none"}])
        assert done == expected
        results = load(tmp_path)
        by_count.setdefault(count, []).append((results.episodes, results.states))
        assert results.episodes["trial"].unique().to_list() == list(range(count))
    for tables in zip(*by_count[200], strict=True):
        assert tables[0].equals(tables[1])


def test_other_sizes_of_cells_use_what_is_there(tmp_path, monkeypatch):
    """A later version may cut experiments otherwise."""
    done = trials_simulated(monkeypatch)
    for episodes, count in [(4 * 3, 7), (4 * 5, 17), (4 * 2, 20), (4 * 100, 25)]:
        monkeypatch.setattr(cells, "EPISODES_A_CELL", episodes)
        run_into(tmp_path, trials=count, assistants=[{"name": "none"}])
    assert sorted(trial for first, end in done for trial in range(first, end)) == list(range(25))
    monkeypatch.undo()
    expected = load(run_into(tmp_path / "whole", trials=25, assistants=[{"name": "none"}]))
    assert load(tmp_path).episodes.equals(expected.episodes)
    assert present(load(tmp_path).states).equals(present(expected.states))
