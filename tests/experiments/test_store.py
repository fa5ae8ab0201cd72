"""Reading an output folder back."""

import polars as pl
import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load, run_description
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.experiments.examples import BUMPERS, run_into, settings
from tests.narrowing import present


def test_a_finished_run_loads_as_it_was_run(whole):
    results = load(str(whole))
    assert results.experiment == make_experiment(settings())
    assert results.episodes.equals(pl.read_parquet(whole / "episodes.parquet"))
    assert present(results.states).equals(pl.read_parquet(whole / "states.parquet"))
    assert results.values.digest() == solve(cliff_walking()).digest()
    libraries = {"numpy", "numba", "scipy", "polars"}
    assert set(run_description(whole)) == {"format", "version", "python", "platform"} | libraries


def test_a_folder_without_a_design_is_named(tmp_path):
    with pytest.raises(RequestError, match=rf"results folder {tmp_path}: it holds no experiment"):
        load(tmp_path)
    with pytest.raises(RequestError, match=r"absent: it holds no experiment\.toml"):
        load(tmp_path / "absent")


def test_a_run_that_is_not_finished_says_how_to_go_on(folder):
    (folder / "episodes.parquet").unlink()
    with pytest.raises(RequestError, match=r"not finished; run it again to continue"):
        load(folder)


@pytest.mark.parametrize("kind", ["episodes", "states"])
@pytest.mark.parametrize("content", [b"", b"PAR1", None])
def test_a_damaged_table_says_how_to_mend_it(folder, kind, content):
    path = folder / f"{kind}.parquet"
    path.write_bytes(path.read_bytes()[:-9] if content is None else content)
    with pytest.raises(RequestError, match=r"results folder .*: damaged; run it again to mend it"):
        load(folder)


def test_damaged_values_are_named(folder):
    (folder / "values.npz").write_bytes(b"")
    with pytest.raises(RequestError, match=r"values file .*values\.npz: not a file of Q values"):
        load(folder)


def test_a_design_edited_by_hand_is_checked(folder):
    path = folder / "experiment.toml"
    path.write_text(path.read_text().replace("trials = 5", "trials = 0"))
    with pytest.raises(RequestError, match=r"experiment\.toml: trials = 0: "):
        load(folder)


@pytest.mark.parametrize(
    "changes",
    [
        {"trials": 8},
        {"assistants": [{"name": "maximal"}]},
        # The ids stay: an option that all of a kind share, and a learner alone, are not in them.
        {"assistants": [{"name": "none"}, {**BUMPERS, "second": False}]},
        {"learners": [{"perception": "observant"}]},
    ],
    ids=["trials", "assistants", "options", "learner"],
)
def test_tables_older_than_the_design_are_not_taken_for_its_results(folder, changes):
    def stop(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_into(folder, **changes, report=stop)
    with pytest.raises(RequestError, match="the run is not finished; run it again to continue"):
        load(folder)
