"""Making a plan warns, before any work, of values that say nothing about assistance."""

import warnings

import pytest

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
        plan = make_plan(experiment)
    run_experiment(plan, tmp_path / "out")  # a second warning would be an error here


def test_tables_are_not_played():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make_plan(make_experiment(settings()))
