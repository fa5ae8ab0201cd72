"""Recorded steps come back from files as they were."""

import numpy as np
import polars as pl
import pytest

from qbumpers import RequestError
from qbumpers.decisions import Step
from qbumpers.experiments.recordings import export_recording
from qbumpers.experiments.steps import load_steps, save_steps, steps_of
from tests.experiments.examples import run_into
from tests.fitting.records import bandit, walked


def assert_same(found, expected, left_out=()):
    for field in set(Step._fields) - {*left_out}:
        assert np.array_equal(getattr(found, field), getattr(expected, field)), field


def test_steps_come_back_from_parquet(tmp_path):
    people = {"first": walked("q-learning"), "second": bandit([0, 1, 1])}
    path = tmp_path / "steps.parquet"
    with pytest.raises(pl.exceptions.PolarsError):  # other numbers of actions
        save_steps(path, people)
    people["second"] = walked("q-learning", trial=1)
    save_steps(path, people)
    found = load_steps(path)
    assert [*found] == ["first", "second"]
    for name, steps in found.items():
        assert_same(steps, people[name])


def test_a_log_is_the_table_that_it_was():
    table = walked("q-learning")
    log = [Step(*(column[place] for column in table)) for place in range(len(table.episode))]
    assert_same(steps_of(log), table)
    with pytest.raises(RequestError, match="at least one step is needed"):
        steps_of([])


def test_steps_come_back_from_a_dataset_of_minari(tmp_path, monkeypatch):
    pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    folder = run_into(tmp_path / "out")
    export_recording(folder, "stochastic-q-bumpers/alpha=0.3", "cliff/steps-v0", trials=2)
    by_name = load_steps("cliff/steps-v0")
    by_folder = load_steps(tmp_path / "datasets" / "cliff" / "steps-v0")
    assert [*by_name] == [*by_folder] == ["0", "1"]
    for trial, steps in by_name.items():
        assert_same(by_folder[trial], steps)
        assert steps.state[0] == 36
        assert (steps.executed != steps.proposed).tolist() == steps.overridden.tolist()
        goal = steps.next_state == 47
        assert ((steps.events & 1) > 0).tolist() == goal.tolist()
        going_on = np.diff(steps.episode) == 0
        assert (steps.next_state[:-1] == steps.state[1:])[going_on].all()


def test_what_holds_no_numbered_steps_is_refused(tmp_path):
    with pytest.raises(RequestError, match="at least one is needed"):
        save_steps(tmp_path / "a.parquet", {})
    vectors = bandit([0, 1])._replace(state=np.zeros((2, 3), np.float32))
    with pytest.raises(RequestError, match="participant 5: states are not numbered; vectors"):
        save_steps(tmp_path / "a.parquet", {"5": vectors})
    pl.DataFrame({"participant": ["1"], "state": [0]}).write_parquet(tmp_path / "b.parquet")
    with pytest.raises(RequestError, match=r"b\.parquet': it has no column episode, proposed"):
        load_steps(tmp_path / "b.parquet")
    (tmp_path / "c.parquet").write_text("nothing")
    with pytest.raises(RequestError, match=r"c\.parquet': not a readable Parquet file"):
        load_steps(tmp_path / "c.parquet")
    with pytest.raises(RequestError, match=r"d\.parquet': there is no such file"):
        load_steps(tmp_path / "d.parquet")
    with pytest.raises(RequestError, match="neither a Parquet file nor a Minari dataset"):
        load_steps(tmp_path / "nowhere")
