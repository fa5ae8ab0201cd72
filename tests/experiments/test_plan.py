"""Making a plan warns, before any work, of values that say nothing about assistance."""

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments import plan
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experts import ExpertWarning
from tests.experiments.examples import cart, settings
from tests.values.networks import constant


@pytest.mark.slow
def test_values_no_better_than_random_play_are_warned_of_once_per_run(tmp_path):
    constant(0, 4, 2, task="CartPole-v1").save(tmp_path / "fall.npz")
    changes = {"values": str(tmp_path / "fall.npz"), "trials": 1, "episodes": 1}
    experiment = make_experiment(cart(tmp_path, **changes))
    with pytest.warns(ExpertWarning, match=r"task CartPole-v1: .* say nothing"):
        made = make_plan(experiment)
    run_experiment(made, tmp_path / "out")  # a second warning would be an error here


TABLES = {
    "windy-gridworld": {"arguments": {"stochastic": True}},
    "larger-cliff": {"arguments": {"rows": 5, "columns": 6}},
    "frozen-lake": {},
    "taxi": {},
    "inventory": {},
    "random-mdp": {"arguments": {"seed": 2, "states": 6}},
    "remapped": {"arguments": {"of": "taxi", "keys": [1, 0, 2, 3, 4, 5]}},
}


def of_task(name, arguments, v_min=-200.0):
    bumpers = {"name": "stochastic-q-bumpers", "alpha": 0.5, "v_min": v_min}
    return make_experiment(
        {"name": "e", "task": {"name": name, **arguments}, "assistants": [bumpers]}
    )


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_solved_exactly_if_values_are_left_out(name):
    made = make_plan(of_task(name, TABLES[name]))
    assert made.values.method == "exact dynamic programming"
    assert made.values.made_for == made.task.identity()


def test_tasks_of_vectors_have_their_expert_also_with_other_keys():
    made = make_plan(of_task("mountain-car", {}))
    turned = {"arguments": {"of": "mountain-car", "keys": [2, 1, 0]}}
    remapped = make_plan(of_task("remapped", turned))
    observation = np.array([-0.3, 0.02], np.float32)
    assert made.values(observation)[::-1] == pytest.approx(remapped.values(observation), rel=1e-6)


def test_a_floor_that_is_not_below_what_the_start_is_worth_is_named():
    message = r"v_min = 0 must be below the value of the start state, V\*\(s_0\) = -15"
    with pytest.raises(RequestError, match=message):
        make_plan(of_task("windy-gridworld", {}, v_min=0.0))


def test_what_a_network_claims_is_tried_by_playing_and_a_table_is_not(tmp_path, monkeypatch):
    tried = []
    monkeypatch.setattr(plan, "check_expert", lambda task, values: tried.append(task.name))
    make_plan(make_experiment(settings()))
    assert tried == []
    make_plan(make_experiment(cart(tmp_path)))
    assert tried == ["CartPole-v1"]
