"""Every rule and learner of the package does the same in every host, and differences are found."""

from typing import NamedTuple

import numpy as np
import pytest

from qbumpers import make_assistant, register_assistant
from qbumpers.assistants import assistants
from qbumpers.conformance import (
    ConformanceError,
    check_conformance,
    check_policy,
    slippery_corridor,
    small_tasks,
    vector_corridor,
)
from qbumpers.decisions import Decision
from qbumpers.learners import (
    PERCEPTIONS,
    Motor,
    Perception,
    PowerLaw,
    learners,
    make_learner,
    register_learner,
)
from qbumpers.learners import q_learning as q
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.remapping import remapped
from tests.assistants.examples import EXAMPLES

TABLES = (slippery_corridor(), cliff_walking())
HOSTS = {"plain Python", "Session", "SharedControl"}
OF_TABLES = [
    name
    for name, rule in assistants().items()
    if {"states", "dynamics", "distance"} & set(rule.needs)
]
OF_STATES = [name for name, learner in learners().items() if learner.observes == "states"]


class NoOptions(NamedTuple):
    pass


def test_every_rule_has_options_to_be_tried_with():
    assert set(EXAMPLES) == set(assistants())


SHARED = "model-free-learner-aware-bumpers"  # nearly all of it is learner-aware bumpers


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n == SHARED else []) for n in EXAMPLES],
)
def test_a_rule_does_the_same_in_every_host(name):
    assistant = make_assistant(name, **EXAMPLES[name])
    tables = [task for task in small_tasks(assistant) if task.states]
    found = check_conformance(assistant, tasks=tables)
    assert {each.host for each in found} == HOSTS
    # Cliff Walking has neither an action that does nothing nor distances.
    assert {each.task for each in found} >= {"corridor"}
    assert len(tables) == 1 + (not assistant.needs & {"distance", "no_op"})
    assert all(each.steps > 20 for each in found)
    if name != "none":
        assert all(0 < each.overridden < each.steps for each in found)


@pytest.mark.parametrize("rule", ["maximal", "stochastic-q-bumpers"])
@pytest.mark.parametrize("name", [name for name in OF_STATES if name != "q-learning"])
def test_a_learner_does_the_same_in_every_host(name, rule):
    assistant = make_assistant(rule, **EXAMPLES[rule])
    found = check_conformance(assistant, tasks=TABLES, learner=make_learner(name))
    assert {each.host for each in found} == HOSTS


@pytest.mark.parametrize("perception", [*PERCEPTIONS, Perception(0.4, "executed", 1.5)])
def test_a_perception_is_the_same_in_every_host(perception):
    assistant = make_assistant("stochastic-q-bumpers", **EXAMPLES["stochastic-q-bumpers"])
    assert check_conformance(assistant, tasks=TABLES, perception=perception)


def test_layers_around_a_learner_are_the_same_in_every_host():
    assistant = make_assistant("maximal")
    for forgetting in (0.1, PowerLaw()):
        layers = {"motor": Motor(slip=0.2, lag=0.3), "forgetting": forgetting}
        assert check_conformance(assistant, tasks=TABLES, **layers)


@pytest.mark.slow
@pytest.mark.parametrize("rule", EXAMPLES)
@pytest.mark.parametrize("name", OF_STATES)
def test_every_pair_does_the_same_in_every_host(name, rule):
    assistant = make_assistant(rule, **EXAMPLES[rule])
    tables = [task for task in small_tasks(assistant) if task.states]
    assert check_conformance(assistant, tasks=tables, learner=make_learner(name))


@pytest.mark.parametrize("name", ["stochastic-q-bumpers", "undo"])
def test_a_rule_does_the_same_in_every_host_if_keys_are_exchanged(name):
    task = remapped(slippery_corridor(), (1, 3, 0, 2))
    found = check_conformance(make_assistant(name, **EXAMPLES[name]), tasks=[task])
    assert {each.host for each in found} == HOSTS
    assert all(0 < each.overridden < each.steps for each in found)


@pytest.mark.slow
@pytest.mark.parametrize("rule", [name for name in EXAMPLES if name not in OF_TABLES])
def test_a_rule_does_the_same_for_learners_of_vectors(rule):
    found = check_conformance(make_assistant(rule, **EXAMPLES[rule]), tasks=[vector_corridor()])
    assert {each.host for each in found} == HOSTS


@pytest.mark.parametrize("name", OF_STATES)
def test_a_policy_is_that_of_the_choices(name):
    assert check_policy(make_learner(name)) < 1


@pytest.mark.usefixtures("own_registry")
def test_a_rule_that_is_not_a_function_of_its_arguments_is_found():
    calls = []

    def moody(situation, noise, options):
        calls.append(0)
        action = 0 if len(calls) <= 20 else 1
        return Decision(action, 1.0 if action != situation.proposed else 0.0)

    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("moody", NoOptions)(moody)
    with pytest.raises(ConformanceError, match="corridor, plain Python: "):
        check_conformance(make_assistant("moody"), tasks=[slippery_corridor()])


def test_a_policy_that_is_not_that_of_the_choices_is_found(own_registry):
    def uniform(settings, memory, state, rates, out):
        out[:] = 1 / len(out)

    class Settings(NamedTuple):
        discount: float = 1.0
        epsilon: q.Schedule = q.Schedule(0.1, 0.1)
        learning_rate: q.Schedule = q.Schedule()
        initial_value: float = 0.0

    kind = register_learner(
        "impostor", Settings, start=q.start, begin=q.begin, choose=q.choose, prefer=q.prefer,
        policy=uniform, learn=q.learn,
    )  # fmt: skip
    with pytest.raises(ConformanceError, match="impostor: choose does not follow its policy"):
        check_policy(kind())
    assert np.isfinite(check_policy(make_learner("q-learning")))
