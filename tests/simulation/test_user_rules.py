"""Rules from outside the package run through the same loops."""

import os
from typing import NamedTuple

import pytest

from qbumpers.assistants import register_assistant
from qbumpers.decisions import Decision
from qbumpers.simulation import run
from tests import reference_rules as plain
from tests.assistants.own_rules import (
    BudgetOptions,
    NoOptions,
    full_budget,
    guide,
    guide_with_a_dictionary,
    guide_within_budget,
    spend,
    watch,
)
from tests.reference_simulation import ReferenceTrial
from tests.simulation.conditions import on_the_cliff
from tests.simulation.corridors import in_the_corridor

pytestmark = pytest.mark.usefixtures("own_registry")


def assert_same(first, second):
    for field, array in first._asdict().items():
        assert array.tolist() == getattr(second, field).tolist(), field


def plain_overrides(condition, rule, trials):
    references = [
        ReferenceTrial(condition, rule, seed=0, trial=trial).run() for trial in range(trials)
    ]
    return [[e["assisted_overrides"] for e in reference.episodes] for reference in references]


def test_a_rule_registered_again_is_simulated_from_then_on():
    register_assistant("guide", NoOptions)(watch)
    assert run(on_the_cliff(("guide", {}), episodes=3), trials=2).outcomes.overrides.sum() == 0
    register_assistant("guide", NoOptions)(guide)
    condition = on_the_cliff(("guide", {}), episodes=3)
    found = run(condition, trials=2).outcomes
    assert found.overrides.tolist() == plain_overrides(condition, plain.maximal, 2)
    assert (found.assisted_return == 87).all()


def test_a_rule_that_cannot_be_compiled_gives_the_same_numbers_and_one_warning():
    register_assistant("guide", NoOptions)(guide)
    compiled = run(on_the_cliff(("guide", {}), episodes=3), trials=2).outcomes
    with pytest.warns(UserWarning, match="'guide' cannot be compiled") as caught:
        register_assistant("guide", NoOptions)(guide_with_a_dictionary)
    assert len(caught) == 1
    # Warnings are errors from here on: the simulation repeats none.
    interpreted = run(on_the_cliff(("guide", {}), episodes=3), trials=2, workers=2).outcomes
    assert_same(interpreted, compiled)


def elsewhere(rule):
    """The same rule, which refuses to decide in this process."""
    here = os.getpid()

    def decide(*arguments):
        assert os.getpid() != here
        return rule(*arguments)

    return decide


def register_plain(decide):
    with pytest.warns(UserWarning, match="'guide' cannot be compiled"):
        register_assistant("guide", NoOptions)(decide)
    return "guide", {}


def register_with_memory(decide):
    def guide_while_any_left(situation, noise, options, memory):
        assert memory > 0
        return decide(situation, noise, options)

    with pytest.warns(UserWarning, match="'budget' cannot be compiled"):
        register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
            guide_while_any_left
        )
    return "budget", {"budget": 10_000}


@pytest.mark.slow
@pytest.mark.parametrize("register", [register_plain, register_with_memory])
def test_an_own_rule_reaches_the_processes_that_step_a_task_in_python(register):
    """On numbers that the assistants share, maximal assistance written again does the same."""
    own = in_the_corridor(*register(elsewhere(guide_with_a_dictionary)), common_random_numbers=True)
    found = run(own, trials=3, seed=4, workers=2).outcomes
    expected = run(in_the_corridor("maximal", common_random_numbers=True), trials=3, seed=4)
    assert_same(found, expected.outcomes)
    assert found.overrides.any()
    with pytest.raises(AssertionError):
        run(own, trials=1)


@pytest.mark.slow
def test_an_own_rule_is_compiled_in_the_processes_that_step_a_task_in_python():
    register_assistant("guide", NoOptions)(guide)
    own = in_the_corridor("guide", common_random_numbers=True)
    expected = run(in_the_corridor("maximal", common_random_numbers=True), trials=3, seed=4)
    assert_same(run(own, trials=3, seed=4, workers=2).outcomes, expected.outcomes)


def options_class():
    class Options(NamedTuple):
        pass

    return Options


def test_rules_whose_options_classes_have_the_same_name_are_kept_apart():
    register_assistant("watch", options_class())(watch)
    register_assistant("guide", options_class())(guide)
    overrides = [
        run(on_the_cliff((name, {}), episodes=3), trials=2).outcomes.overrides.sum()
        for name in ("watch", "guide")
    ]
    assert overrides[0] == 0
    assert overrides[1] > 0


class PlainBudget:
    """The rule with memory, written plainly for one trial."""

    def __init__(self, budget):
        self.left = budget

    def decide(self, situation, noise):
        return (plain.maximal if self.left > 0 else plain.none)(situation, noise)

    def observe(self, step):
        self.left -= step.overridden


def assert_spent_as_planned(condition, outcomes, budget):
    for trial in range(len(outcomes.overrides)):
        rule = PlainBudget(budget)
        reference = ReferenceTrial(
            condition, rule.decide, seed=0, trial=trial, observe=rule.observe
        ).run()
        for field in ("assisted_return", "unassisted_return", "overrides"):
            name = "assisted_overrides" if field == "overrides" else field
            expected = [episode[name] for episode in reference.episodes]
            assert getattr(outcomes, field)[trial].tolist() == expected, field


def test_memory_lasts_a_trial_and_is_fresh_in_the_next():
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    condition = on_the_cliff(("budget", {"budget": 30}), episodes=5)
    found = run(condition, trials=3).outcomes
    assert_spent_as_planned(condition, found, 30)
    assert (found.overrides.sum(axis=1) == 30).all()


def test_a_memory_that_numba_cannot_compile_is_carried_too():
    def whole_budget(options, model):
        return {"left": options.budget}

    def count_down(memory, step, options):
        return {"left": memory["left"] - int(step.overridden)}

    def guide_while_any_left(situation, noise, options, memory):
        action, probability = (plain.maximal if memory["left"] > 0 else plain.none)(
            situation, noise
        )
        return Decision(action, probability)

    with pytest.warns(UserWarning, match="'budget' cannot be compiled") as caught:
        register_assistant("budget", BudgetOptions, start=whole_budget, observe=count_down)(
            guide_while_any_left
        )
    assert len(caught) == 1
    condition = on_the_cliff(("budget", {"budget": 9}), episodes=2)
    found = run(condition, trials=2).outcomes
    assert_spent_as_planned(condition, found, 9)
    assert (found.overrides.sum(axis=1) == 9).all()
