"""Tables of a run that somebody has changed: the file and the column are named."""

import polars as pl
import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments.store import load
from tests.values.networks import network_of

EPISODES, STATES = "episodes.parquet", "states.parquet"

CHANGES = {
    "renamed": (
        EPISODES,
        lambda table: table.rename({"assisted_return": "gain"}),
        r"it has no column 'assisted_return', but \['condition'",
    ),
    "dropped": (EPISODES, lambda table: table.drop("condition"), "it has no column 'condition'"),
    "a text": (
        EPISODES,
        lambda table: table.with_columns(pl.col("assisted_return").cast(pl.String)),
        "column 'assisted_return' holds String, not numbers",
    ),
    "fractions": (
        EPISODES,
        lambda table: table.with_columns(pl.col("trial") + 0.5),
        "column 'trial' holds Float64, not whole numbers",
    ),
    "missing": (
        EPISODES,
        lambda table: table.with_columns(overrides=pl.lit(None, pl.Int32)),
        "column 'overrides' lacks values",
    ),
    "not finite": (
        EPISODES,
        lambda table: table.with_columns(unassisted_return=float("nan")),
        "column 'unassisted_return' has numbers that are not finite",
    ),
    "states": (STATES, lambda table: table.drop("overridden"), "it has no column 'overridden'"),
}


@pytest.mark.parametrize(("name", "change", "message"), CHANGES.values(), ids=list(CHANGES))
def test_a_table_with_other_columns_is_refused(folder, name, change, message):
    change(pl.read_parquet(folder / name)).write_parquet(folder / name)
    with pytest.raises(RequestError, match=rf"run/{name}: {message}"):
        load(folder)


def test_further_columns_do_no_harm(folder):
    table = pl.read_parquet(folder / EPISODES).with_columns(note=pl.lit("seen"))
    table.write_parquet(folder / EPISODES)
    assert load(folder).episodes.equals(table)


def test_values_of_another_kind_of_task_are_refused(folder):
    network_of(inputs=4, actions=2, task="CartPole-v1").save(folder / "values.npz")
    with pytest.raises(RequestError, match=r"values\.npz: of task CartPole-v1, not of this run"):
        load(folder)


def test_values_that_are_gone_are_named(folder):
    (folder / "values.npz").unlink()
    with pytest.raises(RequestError, match=r"run: it holds no values\.npz"):
        load(folder)


def test_a_design_that_no_run_wrote_is_refused(folder):
    (folder / "experiment.toml").write_text("")
    with pytest.raises(RequestError, match=r"experiment\.toml: it has no table \[run\]"):
        load(folder)


def test_a_file_is_no_results_folder(folder):
    with pytest.raises(RequestError, match=r"folder .*experiment\.toml: it is a file"):
        load(folder / "experiment.toml")
