"""Making a plan warns, before any work, of values that say nothing about assistance."""

import pytest

from qbumpers.experiments import plan
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experts import ExpertWarning
from tests.experiments.examples import cart, settings
from tests.values.networks import constant


def test_values_no_better_than_random_play_are_warned_of_once_per_run(tmp_path):
    constant(0, 4, 2, task="CartPole-v1").save(tmp_path / "fall.npz")
    changes = {"values": str(tmp_path / "fall.npz"), "trials": 1, "episodes": 1}
    experiment = make_experiment(cart(tmp_path, **changes))
    with pytest.warns(ExpertWarning, match=r"task CartPole-v1: .* say nothing"):
        made = make_plan(experiment)
    run_experiment(made, tmp_path / "out")  # a second warning would be an error here


def test_what_a_network_claims_is_tried_by_playing_and_a_table_is_not(tmp_path, monkeypatch):
    tried = []
    monkeypatch.setattr(plan, "check_expert", lambda task, values: tried.append(task.name))
    make_plan(make_experiment(settings()))
    assert tried == []
    make_plan(make_experiment(cart(tmp_path)))
    assert tried == ["CartPole-v1"]
