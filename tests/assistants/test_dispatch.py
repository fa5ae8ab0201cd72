import numpy as np
import pytest

from qbumpers.assistants import make_assistant, register_assistant
from qbumpers.assistants.dispatch import decide, observe, start
from qbumpers.compilation import compiled_for_session
from qbumpers.decisions import Noise, Situation, Step
from tests.assistants.own_rules import BudgetOptions, full_budget, guide_within_budget, spend

SITUATION = Situation(np.array([1.0, 3.0, 3.0]), 0, 0.0, 1.0, 3.0)
NOISE = Noise(0.5, 0.5)


def two_decisions(situation, noise, options):
    """A host in small: its rule decides, sees its own step, and decides again."""
    memory = start(options)
    first = decide(situation, noise, options, memory)
    step = Step(
        situation.proposed, first.action, 0, first.action != situation.proposed,
        first.probability, noise.coin, noise.tie, situation.values, 0.0, 0.0,
    )  # fmt: skip
    memory = observe(memory, step, options)
    return first.action, decide(situation, noise, options, memory).action


@pytest.fixture(params=["interpreted", "compiled"])
def host(request):
    return two_decisions if request.param == "interpreted" else compiled_for_session(two_decisions)


@pytest.mark.parametrize(("name", "actions"), [("none", (0, 0)), ("maximal", (2, 2))])
def test_the_type_of_the_options_selects_the_rule(host, name, actions):
    assert host(SITUATION, NOISE, make_assistant(name).options) == actions


@pytest.mark.usefixtures("own_registry")
def test_memory_travels_from_decision_to_decision(host):
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    for budget, actions in [(0, (0, 0)), (1, (2, 0)), (2, (2, 2))]:
        options = make_assistant("budget", budget=budget).options
        assert host(SITUATION, NOISE, options) == actions
