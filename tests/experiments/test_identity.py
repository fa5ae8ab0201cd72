"""What decides a condition's numbers beside its content is all in its identity."""

import platform
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest

from qbumpers.assistants import make_assistant, register_assistant
from qbumpers.experiments.identity import Identity, differences, identity_of
from qbumpers.learners import PERCEPTIONS, Perception, learner_type, q_learning, register_learner
from qbumpers.learners.q_learning import QLearner
from qbumpers.tasks import VectorTask, cliff_walking, make_task
from tests.assistants import own_rules_over_the_package as over
from tests.assistants.own_rules import NoOptions

ENGINE = {"revision": 1, "precision": "float64"}


def identity(name="none", learner="q-learning", task=None, engine=ENGINE):
    task = cliff_walking() if task is None else task
    return identity_of(make_assistant(name), learner_type(learner), task, engine)


def test_what_is_of_the_package_is_known_by_its_revisions():
    found = identity()
    assert found.parts == {
        "processor": platform.machine(),
        "precision": "float64",
        "revisions": {"engine": 1, "assistant none": 1, "learner q-learning": 1},
        "own": False,
        "code": {},
        "packages": {},
    }
    assert found.allows_unmarked
    assert found.digest == identity().digest
    assert len(found.digest) == 16


@pytest.mark.parametrize("part", ["engine", "assistant", "learner"])
def test_a_raised_revision_is_another_identity(part):
    before = identity()
    engine = {**ENGINE, "revision": 2} if part == "engine" else ENGINE
    assistant, learner = make_assistant("none"), learner_type("q-learning")
    if part == "assistant":
        assistant = replace(assistant, rule=replace(assistant.rule, revision=2))
    if part == "learner":
        learner = replace(learner, revision=2)
    after = identity_of(assistant, learner, cliff_walking(), engine)
    assert after.digest != before.digest
    assert not after.allows_unmarked
    assert "was 1 and is 2" in differences(before.parts, after.parts)


def test_a_graphics_card_and_what_compiles_for_it_are_part_of_it():
    here = identity()
    engine: dict[str, Any] = {**ENGINE, "gpu": {"revision": 1, "numba-cuda": "0.30.4"}}
    on_card = identity(engine=engine)
    assert not on_card.allows_unmarked
    assert "the processor was gpu" in differences(on_card.parts, here.parts)
    for field, message in (("revision", "engine on a GPU was 1 and is 2"), ("numba-cuda", "is 2")):
        later = identity(engine={**engine, "gpu": {**engine["gpu"], field: 2}})
        assert later.digest not in (here.digest, on_card.digest)
        assert message in differences(on_card.parts, later.parts)


@pytest.mark.parametrize("field", ["processor", "precision"])
def test_processor_and_precision_are_part_of_it(monkeypatch, field):
    before = identity()
    monkeypatch.setattr(platform, "machine", lambda: "other" if field == "processor" else "x")
    after = identity(engine={**ENGINE, "precision": "float32" if field == "precision" else "x"})
    assert after.digest != before.digest
    assert f"the {field} was {before.parts[field]} and is" in differences(before.parts, after.parts)


def test_what_the_user_wrote_is_known_by_its_code(own_files):
    own_files.register_rule()
    before = identity("mine")
    assert not before.allows_unmarked
    own_files.register_rule()
    assert identity("mine") == before
    own_files.edit("own_helper", "+ 1", "+ 2")
    own_files.register_rule()
    after = identity("mine")
    assert after.digest != before.digest
    assert differences(before.parts, after.parts) == (
        "the code of own_helper.chosen changed since they were simulated"
    )


def test_a_rule_over_an_own_rule_has_its_code(own_files):
    def over():
        own_files.register_rule()
        assistant = make_assistant("budget", per_episode=1, of="mine")
        return identity_of(assistant, learner_type("q-learning"), cliff_walking(), ENGINE)

    before = over()
    own_files.edit("own_rule", "1.0)", "0.5)")
    assert differences(before.parts, over().parts).startswith("the code of own_rule.mine changed")


def test_revisions_that_a_user_raises_are_part_of_it(own_files):
    own_files.register_rule()
    own_files.register_learner()
    before = identity("mine", "own")
    own_files.register_rule(revision=2)
    own_files.register_learner(revision=3)
    assert differences(before.parts, identity("mine", "own").parts) == (
        "the revision of assistant mine was 1 and is 2, the revision of learner own was 1 and is 3"
    )


def test_rules_of_the_package_that_own_code_calls_are_named(own_registry):
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("over", over.Options)(over.rule)
    revisions = identity("over").parts["revisions"]
    assert revisions["assistant stochastic-q-bumpers"] == 1


def test_an_own_part_of_a_rule_or_learner_is_enough_to_be_the_user_s_own(own_registry):
    """Its other parts may be of the package."""

    class Settings(QLearner):
        pass

    parts = {p: getattr(q_learning, p) for p in ("start", "choose", "prefer", "policy", "learn")}
    register_learner("mixed", Settings, **parts, begin=q_learning.begin)
    found = identity(learner="mixed")
    assert found.parts["own"]
    assert any(name.endswith("Settings") for name in found.parts["code"])


def test_what_cannot_be_known_equals_nothing(own_registry):
    space: dict[str, Any] = {"__name__": "typed"}
    exec("from qbumpers import Decision\ndef rule(s, n, o):\n    return Decision(0, 0.0)", space)
    register_assistant("typed", NoOptions)(space["rule"])
    first, second = identity("typed"), identity("typed")
    assert first.digest != second.digest
    assert differences(first.parts, second.parts) == (
        "what decides them cannot be known (there is no source of typed.rule)"
    )


def walk():
    return make_task("own/Walk-v0", discount=0.9)


def test_an_environment_of_the_user_s_own_is_known_by_its_code(own_files):
    own_files.register_environment(step=1.0)
    before = identity(learner="double-dqn", task=walk())
    assert before.parts["own"]
    assert set(before.parts["packages"]) == {"gymnasium", "numpy"}
    own_files.register_environment(step=2.0)
    assert identity(learner="double-dqn", task=walk()).digest != before.digest
    own_files.edit("own_environment", "-1.0, ended", "-2.0, ended")
    own_files.register_environment(step=1.0)
    after = identity(learner="double-dqn", task=walk())
    assert differences(before.parts, after.parts) == (
        "the code of own_environment.Walk changed since they were simulated"
    )
    own_files.edit("own_environment", "-2.0, ended", "-1.0, ended")
    own_files.edit("own_environment", "GROUND = 3.0", "GROUND = 4.0")
    own_files.register_environment(step=1.0)
    after = identity(learner="double-dqn", task=walk())
    assert differences(before.parts, after.parts) == (
        "the code of own_environment.GROUND changed since they were simulated"
    )


def test_what_steps_a_vector_task_is_known_by_its_code(own_files):
    def made():
        environment = own_files.imported("own_environment")
        task = make_task("CartPole-v1", discount=0.9)
        return VectorTask(
            "walk", environment.Walk, task.make_environment, 1, 2, 0.9, 9, {}, False, False
        )

    before = identity(learner="double-dqn", task=made())
    own_files.edit("own_environment", "step=1.0", "step=2.0")
    assert identity(learner="double-dqn", task=made()).digest != before.digest


@pytest.mark.parametrize(
    ("name", "packages"),
    [
        ("CartPole-v1", {"gymnasium": gymnasium.__version__, "numpy": np.__version__}),
        ("LunarLander-v3", {"gymnasium", "numpy", "Box2D"}),
        ("lunar-lander", {"gymnasium", "numpy", "Box2D"}),
    ],
)
def test_libraries_that_step_an_environment_are_named_with_their_versions(name, packages):
    pytest.importorskip("Box2D")
    discount: dict[str, Any] = {} if name == "lunar-lander" else {"discount": 0.9}
    found = identity(learner="double-dqn", task=make_task(name, **discount))
    assert not found.parts["own"]
    assert found.allows_unmarked
    assert found.parts["revisions"][f"task {name}"] == 1
    assert found.parts["packages"].keys() == set(packages)
    if isinstance(packages, dict):
        assert found.parts["packages"] == packages
    older = {**found.parts, "packages": {**found.parts["packages"], "gymnasium": "0.1"}}
    assert differences(older, found.parts) == (f"gymnasium was 0.1 and is {gymnasium.__version__}")


def test_the_table_of_a_task_is_all_that_decides_it():
    lake = make_task("FrozenLake-v1", discount=0.9)
    assert identity(task=lake).parts == identity().parts


def test_nobody_adds_a_perception_whose_name_would_be_all_that_results_say():
    with pytest.raises(TypeError):
        PERCEPTIONS["mine"] = Perception(0.5)  # type: ignore[index]


def test_what_was_never_noted_is_said():
    assert differences(None, identity().parts) == "what they were simulated with was not noted"
    unknown = Identity({**identity().parts, "unknown": ["there is no source of x.y"], "run": "1"})
    assert differences(unknown.parts, identity().parts) == (
        "what had decided them cannot be known (there is no source of x.y)"
    )
