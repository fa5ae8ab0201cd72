"""Rules from outside the package run through the same loops."""

from typing import NamedTuple

import pytest

from qbumpers.assistants import register_assistant
from qbumpers.decisions import Decision
from qbumpers.simulation import run
from tests import reference_simulation as plain
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
from tests.simulation.conditions import on_the_cliff

pytestmark = pytest.mark.usefixtures("own_registry")


def assert_same(first, second):
    for field, array in first._asdict().items():
        assert array.tolist() == getattr(second, field).tolist(), field


def plain_overrides(condition, rule, trials):
    references = [
        plain.ReferenceTrial(condition, rule, seed=0, trial=trial).run() for trial in range(trials)
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
        reference = plain.ReferenceTrial(
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
