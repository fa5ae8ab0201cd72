"""Own rules and learners reach another process, which computes the same bytes."""

import importlib
import pickle
import subprocess
import sys

import numba
import pytest
from numba.core.dispatcher import Dispatcher

from qbumpers.assistants import register_assistant
from qbumpers.assistants.registry import assistants
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.work import finish
from qbumpers.simulation.packing import packed
from tests.assistants import own_rules
from tests.experiments.examples import settings
from tests.narrowing import of_kind

OWN = """
from typing import Annotated, NamedTuple
from pydantic import Field
from qbumpers.decisions import Decision

class Options(NamedTuple):
    kindness: Annotated[float, Field(ge=0, le=1)] = 0.5

def helper(values):
    return sorted(range(len(values)), key=lambda action: -values.tolist()[action])

def kind(situation, noise, options):
    best = helper(situation.values)[0]
    if best == situation.proposed or noise.coin >= options.kindness:
        return Decision(situation.proposed, options.kindness)
    return Decision(best, options.kindness)
"""

ELSEWHERE = """
import pickle, sys, warnings
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.work import finish

warnings.simplefilter("error")
conditions, seed = pickle.load(open(sys.argv[1], "rb"))
conditions = pickle.loads(conditions)
assert "kindness_rules" not in sys.modules
done = [finish(c, Cell(name, 1, 2), seed) for name, c in conditions.items()]
pickle.dump(done, open(sys.argv[2], "wb"))
"""


def plan_of(*assistants, **changes):
    return make_plan(make_experiment(settings(assistants=list(assistants), **changes)))


def test_another_process_without_the_module_of_a_rule_computes_the_same_bytes(
    tmp_path, monkeypatch, own_registry
):
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "kindness_rules.py").write_text(OWN, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path / "here")
    rules = importlib.import_module("kindness_rules")
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("kind", rules.Options)(rules.kind)
    plan = plan_of({"name": "none"}, {"name": "kind", "kindness": [0.2, 0.9]})
    (tmp_path / "packed").write_bytes(pickle.dumps((packed(plan.conditions), plan.experiment.seed)))
    command = [sys.executable, "-c", ELSEWHERE, tmp_path / "packed", tmp_path / "done"]
    subprocess.run(command, check=True, cwd=tmp_path)
    done = pickle.loads((tmp_path / "done").read_bytes())
    assert len(done) == 3
    for each in done:
        again = finish(plan.conditions[each.cell.content], each.cell, plan.experiment.seed)
        assert again == each
    assert len({each.files["episodes.parquet"] for each in done}) == 3


def test_a_rule_is_compiled_with_its_own_settings(own_registry):
    fast = numba.njit(fastmath=True)(own_rules.guide)
    register_assistant("fast", own_rules.NoOptions)(fast)
    register_assistant(
        "budget",
        own_rules.BudgetOptions,
        start=own_rules.full_budget,
        observe=own_rules.spend,
    )(own_rules.guide_within_budget)
    before = assistants()
    content = packed(plan_of({"name": "fast"}, {"name": "budget", "budget": 3}).conditions)
    pickle.loads(content)
    after = assistants()
    for name in ("fast", "budget"):
        assert after[name] is not before[name]
        assert after[name].compiled
        assert not after[name].built_in
        for part in ("decide", "start", "observe"):
            now, then = getattr(after[name], part), getattr(before[name], part)
            assert (now is None) == (then is None)
            if now is not None:
                assert now.targetoptions == then.targetoptions
    compiled = {name: of_kind(Dispatcher, after[name].decide) for name in ("fast", "budget")}
    assert compiled["fast"].targetoptions["fastmath"] is True
    assert "fastmath" not in compiled["budget"].targetoptions


def test_built_in_rules_are_not_registered_again():
    before = assistants()
    plan = plan_of({"name": "none"}, {"name": "stochastic-q-bumpers", "alpha": 0.5}, seed=9)
    conditions = pickle.loads(packed(plan.conditions))
    assert assistants() == before
    content, condition = next(iter(conditions.items()))
    cell = Cell(content, 0, 1)
    assert finish(condition, cell, 9) == finish(plan.conditions[content], cell, 9)


def test_modules_are_pickled_by_name_again_afterwards(own_registry):
    register_assistant("watch", own_rules.NoOptions)(own_rules.watch)
    packed(plan_of({"name": "watch"}).conditions)
    assert b"own_rules" in pickle.dumps(own_rules.watch)
    import cloudpickle

    assert cloudpickle.list_registry_pickle_by_value() == set()
