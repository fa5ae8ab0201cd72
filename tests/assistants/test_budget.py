"""A budget over another rule, decision by decision; `test_loops` holds it to the plain one."""

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant, register_assistant
from qbumpers.conformance import check_conformance, slippery_corridor
from qbumpers.decisions import Decision, Noise
from qbumpers.experiments.design import condition_id
from qbumpers.simulation import make_condition, run
from qbumpers.tasks import cliff_walking
from tests.assistants.otherwise import bumpers
from tests.assistants.own_rules import NoOptions, TakeBackOptions, guide, take_back
from tests.assistants.situations import model_of, situation_of, step_of
from tests.simulation.conditions import BUMPERS, on_the_cliff

INNER = {"name": BUMPERS[0], **BUMPERS[1]}
NOISE = Noise(0.25, 0.5)
BAD, GOOD = situation_of([1.0, 3.0, 3.0], 0), situation_of([1.0, 3.0, 3.0], 2)


def budget(per_episode, of: Any = "maximal"):
    return make_assistant("budget", per_episode=per_episode, of=of)


def decisions(assistant, situations):
    """What an assistant decides in one situation after another, seeing its own steps."""
    memory, found = assistant.start(model_of()), []
    for situation in situations:
        decision = assistant.decide(situation, NOISE, memory)
        step = step_of(situation, decision.action, undone=decision.undo)
        memory = assistant.observe(memory, step)
        found.append(decision)
    return found


@given(st.integers(0, 6), st.lists(st.lists(st.booleans(), max_size=12), max_size=4))
def test_only_the_first_overrides_of_every_episode_happen(per_episode, episodes):
    situations = [
        (BAD if bad else GOOD)._replace(episode=episode, step=step)
        for episode, steps in enumerate(episodes)
        for step, bad in enumerate(steps)
    ]
    found = iter(decisions(budget(per_episode), situations))
    for steps in episodes:
        left = per_episode
        for bad in steps:
            decision = next(found)
            if bad and left:
                assert decision == Decision(2, 1.0)
                left -= 1
            else:
                assert decision == Decision(0 if bad else 2, 0.0)


@given(st.integers(0, 6), st.lists(st.booleans(), max_size=20))
def test_a_budget_in_all_lasts_over_the_episodes(in_all, bads):
    situations = [
        (BAD if bad else GOOD)._replace(episode=step // 3, step=step % 3)
        for step, bad in enumerate(bads)
    ]
    limited = make_assistant("budget", in_all=in_all, of="maximal")
    found = [decision.probability == 1 for decision in decisions(limited, situations)]
    before = np.cumsum([0, *bads])
    assert found == [bad and before[step] < in_all for step, bad in enumerate(bads)]


@given(st.sampled_from([0.0, 0.125, 0.25, 0.5, 0.75, 1.0]), st.lists(st.booleans(), max_size=40))
def test_no_more_than_a_share_of_the_steps_so_far_is_overridden_and_no_less_if_possible(
    share, bads
):
    limited = make_assistant("budget", share=share, of="maximal")
    found, spent = decisions(limited, [BAD if bad else GOOD for bad in bads]), 0
    for step, (bad, decision) in enumerate(zip(bads, found, strict=True), 1):
        allowed = bad and spent + 1 <= share * step
        assert decision.probability == float(allowed)
        spent += allowed


def test_of_several_limits_each_is_kept():
    limited = make_assistant("budget", per_episode=2, in_all=5, share=0.5, of="maximal")
    situations = [BAD._replace(episode=step // 6) for step in range(24)]
    found = [int(decision.probability) for decision in decisions(limited, situations)]
    assert found == [0, 1, 0, 1, 0, 0, *[1, 1, 0, 0, 0, 0], *[1, 0, 0, 0, 0, 0], *[0] * 6]


@pytest.mark.parametrize(
    ("limit", "value"), [("per_episode", -1), ("in_all", -1), ("share", 1.5), ("in_all", 2.5)]
)
def test_limits_have_bounds(limit, value):
    with pytest.raises(RequestError, match=f"assistant budget: {limit} = {value}"):
        make_assistant("budget", of="maximal", **{limit: value})


def test_a_limit_that_is_left_out_leaves_no_trace_in_ids_and_streams():
    # So it was before there were other limits than one per episode.
    old = budget(2, INNER)
    assert list(old.described()) == ["of", "per_episode"]
    named = condition_id(old, [old, make_assistant("budget", of="maximal", in_all=3)])
    assert named == 'budget/of={name="stochastic-q-bumpers",alpha=0.7,second=true},per_episode=2'
    assert condition_id(make_assistant("budget", of="maximal", in_all=3), [old]) == (
        'budget/of={name="maximal"},in_all=3'
    )


def test_falls_happen_once_the_budget_is_spent_which_the_bumpers_below_stop():
    fall = situation_of([-13.0, 94.0], 0, start_value=87.0)
    limited = make_assistant("budget", in_all=1, of={"name": "stochastic-q-bumpers", "alpha": 0.7})
    assert decisions(limited, [fall] * 2) == [Decision(1, 1.0), Decision(0, 0.0)]
    assert bumpers(fall, NOISE) == Decision(1, 1.0)


@pytest.mark.parametrize(
    "limits",
    [
        {"share": 0.125, "per_episode": 1},
        pytest.param({"in_all": 9}, marks=pytest.mark.slow),
    ],
)
def test_limits_do_the_same_in_every_host(limits):
    assistant = make_assistant("budget", of={"name": "correct"}, **limits)
    assert check_conformance(assistant, tasks=[slippery_corridor()])


@pytest.mark.parametrize(("outer", "inner"), [(2, 3), (3, 2), (0, 5), (5, 0)])
def test_of_a_budget_within_a_budget_the_smaller_is_kept(outer, inner):
    situations = [BAD._replace(episode=e, step=s) for e in range(2) for s in range(6)]
    nested = budget(outer, {"name": "budget", "per_episode": inner, "of": "maximal"})
    probabilities = [decision.probability for decision in decisions(nested, situations)]
    allowed = min(outer, inner)
    assert probabilities == [*[1.0] * allowed, *[0.0] * (6 - allowed)] * 2


def test_an_undone_step_is_spent_and_none_is_undone_afterwards(own_registry):
    register_assistant("take-back", TakeBackOptions, needs=("undo",))(take_back)
    found = decisions(budget(2, "take-back"), [BAD] * 4)
    assert found == [Decision(0, 0.5, True)] * 2 + [Decision(0, 0.0, False)] * 2


def test_needs_and_bounds_are_those_of_the_rule_below(own_registry):
    register_assistant("take-back", TakeBackOptions, needs=("undo",))(take_back)
    assert budget(2, "take-back").needs == {"undo"}
    with pytest.raises(RequestError, match="alpha = 2"):
        budget(2, {"name": "local-q-thresholding", "alpha": 2.0})
    with pytest.raises(RequestError, match="v_min = 90"):
        make_condition(cliff_walking(), budget(2, {**INNER, "v_min": 90.0}))
    with pytest.raises(RequestError, match="assistant budget: of = 7"):
        budget(2, 7)


@pytest.mark.parametrize("protocol", [2, 5])
def test_a_budget_goes_to_other_processes(protocol, own_registry):
    register_assistant("guide", NoOptions)(guide)
    for assistant in (budget(2, INNER), budget(2, budget(1, "guide"))):
        again = pickle.loads(pickle.dumps(assistant, protocol))
        assert again.described() == assistant.described()
        assert decisions(again, [BAD] * 3) == decisions(assistant, [BAD] * 3)


def outcomes(assistant):
    """Trials that draw the same numbers, whatever the assistant."""
    condition = make_condition(cliff_walking(), assistant, episodes=12, common_random_numbers=True)
    return run(condition, trials=4, seed=3).outcomes


def assert_same(first, second):
    for field, array in first._asdict().items():
        assert np.array_equal(array, getattr(second, field)), field


def test_a_budget_that_is_never_spent_changes_nothing():
    assert_same(outcomes(budget(100, INNER)), outcomes(make_assistant(**INNER)))


@pytest.mark.slow
def test_a_nested_budget_is_simulated_as_the_smaller_one():
    smaller = outcomes(budget(3, INNER))
    assert smaller.overrides.max() == 3
    nested = {"name": "budget", "per_episode": 3, "of": INNER}
    assert_same(outcomes(budget(50, nested)), smaller)


def test_a_budget_of_an_own_rule_is_simulated_compiled(own_registry):
    register_assistant("guide", NoOptions)(guide)
    assistant = budget(4, "guide")
    assert assistant.compiled
    assert not assistant.built_in
    assert_same(outcomes(assistant), outcomes(budget(4, "maximal")))


def test_the_budget_is_for_training_alone():
    condition = on_the_cliff(("budget", {"per_episode": 2, "of": INNER}), episodes=3, retention=2)
    overrides = run(condition, trials=3).outcomes.overrides
    assert (overrides[:, 3:] == 0).all()
    assert overrides[:, :3].max() == 2
