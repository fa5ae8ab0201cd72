"""Options that are no numbers, in the tables of a run."""

from qbumpers.analysis.report import find
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load


def test_another_assistant_is_written_as_ids_write_it(tmp_path):
    other = {"name": "stochastic-q-bumpers", "alpha": 0.5}
    settings = {
        "name": "budgets", "task": "cliff-walking", "trials": 1, "episodes": 2,
        "assistants": [{"name": "budget", "per_episode": 3, "of": other}],
    }  # fmt: skip
    run_experiment(make_plan(make_experiment(settings)), tmp_path)
    row = find(load(tmp_path)).summary.row(0, named=True)
    assert row["of"] == '{name="stochastic-q-bumpers",alpha=0.5}'
    assert row["per_episode"] == 3
