"""A user's own rules and learners in experiments: in files, threads and processes."""

import pickle

import numpy as np
import polars as pl
import pytest

from qbumpers.assistants import register_assistant
from qbumpers.errors import RequestError
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from qbumpers.learners import make_learner
from qbumpers.simulation import run, simulate
from qbumpers.tasks import cliff_walking
from tests.assistants import own_rules
from tests.experiments.examples import cart, ids_of, run_into, settings
from tests.learners.own_learners import (
    choose_with_a_dictionary,
    register_averaging,
    register_linear,
)

pytestmark = [
    pytest.mark.usefixtures("own_registry"),
    pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning"),
]

GUIDE = {"name": "guide"}
OWN = {"name": "averaging", "step_size": [0.5, 1.0], "hopes": 1.0}


def register_guide():
    register_assistant("guide", own_rules.NoOptions)(own_rules.guide)


@pytest.mark.slow
def test_an_own_learner_and_rule_run_in_threads_beside_those_of_the_package(tmp_path):
    register_guide()
    register_averaging()
    changes = {"learners": [{}, OWN], "assistants": [GUIDE, {"name": "maximal"}], "trials": 3}
    folder = run_into(tmp_path, workers=2, **changes)
    results = load(folder)
    assert ids_of(**changes)[-1].startswith("maximal@name=averaging,")
    for step_size in (0.5, 1.0):
        learner = make_learner("averaging", step_size=step_size, hopes=1.0)
        outcomes = simulate(
            cliff_walking(), "maximal", learner=learner, trials=3, episodes=4, seed=3
        ).outcomes
        rows = results.episodes.filter(pl.col("condition").str.contains(f"step_size={step_size:g}"))
        rows = rows.filter(pl.col("assistant") == "maximal")
        assert rows["overrides"].to_list() == outcomes.overrides.ravel().tolist()
    assert make_experiment(results.experiment.model_dump(exclude_none=True)) == results.experiment


@pytest.mark.parametrize("compiled", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_an_own_learner_of_vectors_runs_in_processes_that_never_saw_it(tmp_path, compiled):
    if compiled:
        register_linear()
    else:  # what Numba cannot compile needs no time for it in each process
        with pytest.warns(UserWarning, match="learner 'linear' cannot be compiled"):
            register_linear(choose=choose_with_a_dictionary)
    changes = {"learners": [{"name": "linear"}], "assistants": [{"name": "none"}]}
    plan = make_plan(make_experiment(cart(tmp_path, **changes)))
    run_experiment(plan, tmp_path / "out", backend=ThisMachine(2))
    episodes = load(tmp_path / "out").episodes
    for named, content in plan.named:
        here = run(plan.conditions[content], trials=2, seed=3).outcomes
        shared = run(plan.conditions[content], trials=2, seed=3, workers=2).outcomes
        rows = episodes.filter(pl.col("condition") == named.condition)
        assert rows["assisted_return"].to_list() == here.assisted_return.ravel().tolist()
        for field, array in here._asdict().items():
            assert np.array_equal(array, getattr(shared, field)), field


@pytest.mark.slow
def test_a_rule_over_an_own_rule_is_pickled_with_it():
    register_guide()
    over = {"name": "budget", "per_episode": 3, "of": GUIDE}
    plan = make_plan(make_experiment(settings(assistants=[over])))
    [condition] = plan.conditions.values()
    again = pickle.loads(pickle.dumps(condition))
    assert again.content() == condition.content()
    expected, found = (run(each, trials=2).outcomes for each in (condition, again))
    assert (expected.overrides <= 3).all()
    for field, array in expected._asdict().items():
        assert np.array_equal(array, getattr(found, field)), field


def test_wrong_settings_of_an_own_learner_are_named():
    register_averaging()
    with pytest.raises(RequestError, match=r"learners\.0\.step_size = 2\.0: .*less than or equal"):
        make_experiment(settings(learners=[{"name": "averaging", "step_size": 2.0}]))
    with pytest.raises(RequestError, match=r"step_sise = 0\.5: .*did you mean 'step_size'\?"):
        make_experiment(settings(learners=[{"name": "averaging", "step_sise": 0.5}]))
