import math
import pickle
from typing import Annotated, NamedTuple

import pytest
from pydantic import Field

from qbumpers.assistants import assistants, make_assistant, register_assistant
from qbumpers.assistants.maximal import MaximalOptions
from qbumpers.decisions import Decision, Noise
from qbumpers.errors import RequestError
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
from tests.assistants.situations import model_of, situation_of, step_of

SITUATION = situation_of([1.0, 3.0, 3.0], 0)
NOISE = Noise(0.5, 0.5)


def overridden_step():
    return step_of(SITUATION, 2)


def test_every_assistant_of_the_package_is_compiled_for_every_task():
    built_in = [rule for rule in assistants().values() if rule.built_in]
    assert len(built_in) >= 5
    for rule in built_in:
        tables_only = {"states", "dynamics"} & set(rule.needs)
        kinds = {"states"} if tables_only else {"states", "vectors"}
        assert rule.compiles_for == kinds, rule.name


def test_options_that_are_not_given_take_the_papers_values():
    options = make_assistant("stochastic-q-bumpers", alpha=0.7).options
    assert options._asdict() == {
        "alpha": 0.7,
        "v_min": 0.0,
        "p_max": 0.999,
        "second": False,
        "escalate": True,
        "clip": True,
    }


def test_whole_numbers_are_taken_as_floats():
    # An integer would be another type to compiled code, and other content to random streams.
    options = make_assistant("stochastic-q-bumpers", alpha=1, v_min=-2).options
    assert [type(options.alpha), type(options.v_min)] == [float, float]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"alpha": -0.1}, r"alpha = -0\.1"),
        ({"alpha": 1.1}, r"alpha = 1\.1"),
        ({"alpha": float("nan")}, "alpha = nan"),
        ({"alpha": "0.7"}, r"alpha = '0\.7'"),
        ({"alpha": True}, "alpha = True"),
        ({"alpha": None}, "alpha = None"),
        ({}, "alpha.*required"),
        ({"alpha": 0.7, "p_max": 0.5}, r"p_max = 0\.5"),
        ({"alpha": 0.7, "p_max": 1.0}, r"p_max = 1\.0"),
        ({"alpha": 0.7, "v_min": float("-inf")}, "v_min = -inf"),
        ({"alpha": 0.7, "v_min": float("nan")}, "v_min = nan"),
        ({"alpha": 0.7, "second": 1}, "second = 1"),
        ({"alpha": 0.7, "clip": "yes"}, "clip = 'yes'"),
        ({"alpha": 0.7, "escalte": False}, "'escalte'.*did you mean 'escalate'"),
    ],
)
def test_wrong_options_are_named_with_their_value(options, message):
    with pytest.raises(RequestError, match=f"stochastic-q-bumpers.*{message}"):
        make_assistant("stochastic-q-bumpers", **options)


@pytest.mark.parametrize("name", ["none", "maximal"])
def test_assistants_without_options_refuse_any(name):
    with pytest.raises(RequestError, match=f"option of assistant {name}.*'alpha'"):
        make_assistant(name, alpha=0.5)


@pytest.mark.parametrize("alpha", [-0.1, 1.1])
def test_thresholds_outside_the_unit_interval_are_refused(alpha):
    with pytest.raises(RequestError, match=f"local-q-thresholding.*alpha = {alpha}"):
        make_assistant("local-q-thresholding", alpha=alpha)


def test_an_unknown_assistant_is_refused_with_the_nearest_name():
    with pytest.raises(
        RequestError, match=r"assistant 'stochastic-q-bumper'.*did you mean 'stochastic-q-bumpers'"
    ):
        make_assistant("stochastic-q-bumper", alpha=0.7)


@pytest.mark.parametrize("start_value", [-5.0, 0.0])
def test_the_message_tells_the_lower_bound_and_the_value_of_the_start(start_value):
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.7)
    with pytest.raises(RequestError, match=rf"v_min = 0 .*V\*\(s_0\) = {start_value:g}"):
        assistant.check_start(start_value)


def may_start(assistant, start_value):
    try:
        assistant.check_start(start_value)
    except RequestError:
        return False
    return True


@pytest.mark.parametrize(
    ("name", "options", "lowest"),
    [
        ("stochastic-q-bumpers", {"alpha": 0.7}, 0.0),
        ("stochastic-q-bumpers", {"alpha": 0.0, "v_min": -10.0}, -10.0),
        ("local-q-thresholding", {"alpha": 0.5}, -math.inf),
        ("maximal", {}, -math.inf),
        ("none", {}, -math.inf),
    ],
)
def test_an_episode_may_start_above_the_lower_bound_of_the_rule_if_it_has_one(
    name, options, lowest
):
    assistant = make_assistant(name, **options)
    for start_value in (-1e9, -10.1, -10.0, -9.9, -1e-9, 0.0, 1e-9, 87.0):
        assert may_start(assistant, start_value) == (start_value > lowest)


@pytest.mark.parametrize("protocol", range(2, pickle.HIGHEST_PROTOCOL + 1))
def test_a_pickled_assistant_comes_back_equal(protocol):
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.7, second=True)
    again = pickle.loads(pickle.dumps(assistant, protocol))
    assert again == assistant
    assert again.rule is assistant.rule
    assert type(again.options) is type(assistant.options)


@pytest.mark.usefixtures("own_registry")
def test_a_pickled_own_assistant_takes_the_rule_registered_where_it_arrives():
    register_assistant("guide", NoOptions)(watch)
    sent = pickle.dumps(make_assistant("guide"))
    register_assistant("guide", NoOptions)(guide)
    assert pickle.loads(sent).decide(SITUATION, NOISE) == Decision(2, 1.0)


@pytest.mark.usefixtures("own_registry")
def test_an_own_rule_is_compiled_and_the_function_stays_what_it_was():
    assert register_assistant("guide", NoOptions)(guide) is guide
    assistant = make_assistant("guide")
    assert assistant.rule.compiled
    assert not assistant.rule.built_in
    assert assistant.decide(SITUATION, NOISE) == Decision(2, 1.0)


@pytest.mark.usefixtures("own_registry")
def test_a_rule_that_cannot_be_compiled_warns_once_and_decides_the_same():
    with pytest.warns(UserWarning, match="'guide' cannot be compiled") as caught:
        register_assistant("guide", NoOptions)(guide_with_a_dictionary)
    assert [warning.filename for warning in caught] == [__file__]
    assistant = make_assistant("guide")
    assert not assistant.rule.compiled
    for proposed in range(3):
        situation = SITUATION._replace(proposed=proposed)
        assert assistant.decide(situation, NOISE) == guide(situation, NOISE, NoOptions())


@pytest.mark.usefixtures("own_registry")
def test_a_rule_registered_again_decides_from_then_on():
    register_assistant("guide", NoOptions)(watch)
    before = make_assistant("guide")
    register_assistant("guide", NoOptions)(guide)
    assert make_assistant("guide").decide(SITUATION, NOISE) == Decision(2, 1.0)
    assert before.decide(SITUATION, NOISE) == Decision(0, 0.0)


@pytest.mark.usefixtures("own_registry")
def test_a_rule_with_memory_spends_it():
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    assistant = make_assistant("budget", budget=2)
    memory, probabilities = assistant.start(model_of()), []
    for _ in range(3):
        probabilities.append(assistant.decide(SITUATION, NOISE, memory).probability)
        memory = assistant.observe(memory, overridden_step())
    assert probabilities == [1.0, 1.0, 0.0]


@pytest.mark.usefixtures("own_registry")
def test_bounds_of_own_options_are_checked():
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    with pytest.raises(RequestError, match="assistant budget: budget = -1"):
        make_assistant("budget", budget=-1)


def test_a_memoryless_rule_leaves_memory_alone():
    assistant = make_assistant("maximal")
    assert assistant.start(model_of()) == 0
    assert assistant.observe("anything", overridden_step()) == "anything"


class PreferenceOptions(NamedTuple):
    favourite: Annotated[int, Field(ge=0)]
    insist: bool = True


def insist_on_favourite(situation, noise, options):
    if options.insist and situation.values[options.favourite] > 0:
        return Decision(options.favourite, 1.0)
    return Decision(situation.proposed, 0.0)


@pytest.mark.usefixtures("own_registry")
def test_whole_number_options_may_serve_as_indices_in_a_compiled_rule():
    register_assistant("favourite", PreferenceOptions)(insist_on_favourite)
    assistant = make_assistant("favourite", favourite=1)
    assert assistant.rule.compiled
    assert assistant.decide(SITUATION, NOISE) == Decision(1, 1.0)


@pytest.mark.usefixtures("own_registry")
@pytest.mark.parametrize("options_type", [dict, {"alpha": 1}, None])
def test_options_must_be_a_named_tuple_class(options_type):
    with pytest.raises(RequestError, match=r"options_type of 'guide' is .* NamedTuple"):
        register_assistant("guide", options_type)


@pytest.mark.usefixtures("own_registry")
def test_an_options_class_may_serve_several_rules():
    register_assistant("watch", MaximalOptions)(lambda s, noise, options: Decision(s.proposed, 0.0))
    watching, maximal = make_assistant("watch"), make_assistant("maximal")
    assert not watching.decide(SITUATION, NOISE).probability
    assert maximal.decide(SITUATION, NOISE).probability == 1


@pytest.mark.usefixtures("own_registry")
@pytest.mark.parametrize("given", [{"start": full_budget}, {"observe": spend}])
def test_memory_needs_both_its_functions(given):
    with pytest.raises(RequestError, match=r"'budget'.*both start and observe"):
        register_assistant("budget", BudgetOptions, **given)
