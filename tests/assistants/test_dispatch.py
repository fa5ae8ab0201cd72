import pytest

from qbumpers.assistants import make_assistant, register_assistant
from qbumpers.assistants.dispatch import decide, observe, start
from qbumpers.compilation import compiled_for_session
from qbumpers.decisions import Execution, Noise, step_of
from tests.assistants.own_rules import BudgetOptions, full_budget, guide_within_budget, spend
from tests.assistants.situations import model_of, situation_of

SITUATION, MODEL = situation_of([1.0, 3.0, 3.0], 0), model_of()
NOISE = Noise(0.5, 0.5)


def two_decisions(situation, noise, options, model):
    """A host in small: its rule decides, sees its own step, and decides again."""
    memory = start(options, model)
    first = decide(situation, noise, options, memory)
    done = Execution(first.action, False, first.probability)
    step = step_of(situation, noise, done, 0, 0.0, 1, 0)
    memory = observe(memory, step, options)
    return first.action, decide(situation, noise, options, memory).action


@pytest.fixture(params=["interpreted", "compiled"])
def host(request):
    return two_decisions if request.param == "interpreted" else compiled_for_session(two_decisions)


@pytest.mark.parametrize(("name", "actions"), [("none", (0, 0)), ("maximal", (2, 2))])
def test_the_type_of_the_options_selects_the_rule(host, name, actions):
    assert host(SITUATION, NOISE, make_assistant(name).options, MODEL) == actions


@pytest.mark.usefixtures("own_registry")
def test_memory_travels_from_decision_to_decision(host):
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    for budget, actions in [(0, (0, 0)), (1, (2, 0)), (2, (2, 2))]:
        options = make_assistant("budget", budget=budget).options
        assert host(SITUATION, NOISE, options, MODEL) == actions
