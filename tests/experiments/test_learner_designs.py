"""Learners as data: each kind has its own fields, and suits tasks of one kind."""

import pytest
import tomli_w

from qbumpers.errors import RequestError
from qbumpers.experiments.learner_designs import design_class
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.learners import DoubleDQN, QLearner
from qbumpers.tasks import VectorTask
from tests.experiments.examples import cart, settings, write_toml
from tests.narrowing import of_kind
from tests.values.networks import network_of

DEEP, TABULAR = design_class("double-dqn"), design_class("q-learning")
# The experts of these experiments are random networks.
pytestmark = pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning")

EVERYTHING = {
    "name": "double-dqn",
    "perception": "observant",
    "discount": 0.9,
    "network": {"hidden": [32, 16, 8], "activation": "relu", "dueling": 4},
    "epsilon": {"start": 0.9, "end": 0.1, "fraction": 0.5},
    "learning_rate": 2e-3,
    "batch_size": 8,
    "replay_size": 300,
    "learning_starts": 20,
    "target_every": 7,
    "clip": "variable",
    "gradient_limit": 1.5,
    "penalty": 2.5,
}


def deep(*learners, **changes):
    task = {"name": "CartPole-v1", "discount": 0.99}
    return settings(task=task, learners=list(learners), **changes)


def test_every_field_of_a_deep_learner_is_read_from_toml(tmp_path):
    path = write_toml(tmp_path / "deep.toml", **deep(EVERYTHING))
    [design] = load_experiment(path).learners
    learner = design.learner(task_discount=0.99)
    assert design.perception == "observant"
    assert tuple(learner.network) == ((32, 16, 8), "relu", 4)
    assert tuple(learner.epsilon) == (0.9, 0.1, 0.5)
    assert {k: v for k, v in learner._asdict().items() if k not in ("network", "epsilon")} == {
        k: v
        for k, v in EVERYTHING.items()
        if k not in ("name", "perception", "penalty", "network", "epsilon")
    }
    assert design.penalty == 2.5


def test_designs_without_settings_are_the_learners_without_settings():
    assert DEEP.model_validate({}).learner(0.99) == DoubleDQN()
    assert TABULAR.model_validate({}).learner(1.0) == QLearner()
    assert DEEP.model_validate({}).learner(0.5).discount == 0.5
    assert DEEP.model_validate({"discount": 0.7}).learner(0.5).discount == 0.7


def test_what_is_written_reads_back_as_the_same_experiment(tmp_path):
    networks = [{"hidden": [8]}, {"hidden": [], "activation": "relu"}]
    experiment = make_experiment(deep({**EVERYTHING, "network": networks}))
    path = tmp_path / "again.toml"
    path.write_text(tomli_w.dumps(experiment.model_dump(exclude_none=True)), encoding="utf-8")
    assert load_experiment(path) == experiment


@pytest.mark.parametrize(
    ("task", "name", "values"),
    [
        ("cliff-walking", "q-learning", "exact"),
        ({"name": "FrozenLake-v1", "discount": 0.9}, "q-learning", "exact"),
        ({"name": "CartPole-v1", "discount": 0.9}, "double-dqn", "expert"),
        ("lunar-lander", "double-dqn", "expert"),
    ],
)
@pytest.mark.parametrize("learners", [None, [{}], [{"penalty": [1.0, 2.0]}]])
def test_what_is_left_out_suits_the_task(task, name, values, learners):
    given = settings(task=task) | ({} if learners is None else {"learners": learners})
    experiment = make_experiment(given)
    assert {learner.name for learner in experiment.learners} == {name}
    assert experiment.values == values
    assert make_experiment(experiment.model_dump(exclude_none=True)) == experiment


def test_lists_are_swept_over_and_ids_tell_what_differs():
    swept = {
        "name": "double-dqn",
        "network": [{"hidden": [64, 64]}, {"dueling": 256}],
        "learning_rate": [1e-3, 5e-4],
    }
    experiment = make_experiment(deep(swept, assistants=[{"name": "none"}]))
    assert [named.condition for named in experiment.conditions()] == [
        "none@network=64-64..tanh..0,learning_rate=0.001",
        "none@network=64-64..tanh..0,learning_rate=0.0005",
        "none@network=64-64..tanh..256,learning_rate=0.001",
        "none@network=64-64..tanh..256,learning_rate=0.0005",
    ]
    assert experiment.conditions()[0].learner_id.startswith("double-dqn/network=")


WRONG = {
    "unknown kind": (
        {"name": "q-lerning"},
        r"unknown learners\.name 'q-lerning' \(did you mean 'q-learning'\?\)\. Known: .*'?sarsa",
    ),
    "field of the other": (
        {"name": "double-dqn", "initial_value": 0.0},
        r"learners\.0\.initial_value = 0\.0: unknown field",
    ),
    "field of a network": (
        {"name": "q-learning", "batch_size": 8},
        r"learners\.0\.batch_size = 8: unknown field",
    ),
    "schedule as a rate": (
        {"name": "double-dqn", "learning_rate": {"start": 0.1}},
        r"learners\.0\.learning_rate = \{.*\}: .*valid number",
    ),
    "rate as a schedule": (
        {"name": "q-learning", "learning_rate": 0.1},
        r"learners\.0\.learning_rate = 0\.1: .*ScheduleDesign",
    ),
    "activation": (
        {"name": "double-dqn", "network": {"activation": "sigmoid"}},
        r"learners\.0\.network\.activation = 'sigmoid': .*'tanh' or 'relu'",
    ),
    "no units": (
        {"name": "double-dqn", "network": {"hidden": [64, 0]}},
        r"learners\.0\.network\.hidden\.1 = 0: .*greater than or equal to 1",
    ),
    "typo in a network": (
        {"name": "double-dqn", "network": {"hiden": [64]}},
        r"learners\.0\.network\.hiden = \[64\]: unknown field \(did you mean 'hidden'\?\)",
    ),
    "clip": ({"name": "double-dqn", "clip": "norm"}, r"learners\.0\.clip = 'norm': .*'global'"),
    "batch": ({"name": "double-dqn", "batch_size": 0}, r"learners\.0\.batch_size = 0: "),
    "limit": ({"name": "double-dqn", "gradient_limit": 0.0}, r"gradient_limit = 0\.0: "),
    "perception": (
        {"name": "double-dqn", "perception": "transitoin"},
        r"learners\.perception 'transitoin' \(did you mean 'transition'\?\)",
    ),
}


@pytest.mark.parametrize(("learner", "message"), WRONG.values(), ids=list(WRONG))
def test_a_wrong_learner_is_refused(learner, message):
    with pytest.raises(RequestError, match=message):
        make_experiment(settings(learners=[learner]))


def test_learners_that_observe_differently_are_not_mixed():
    learners = [{"name": "q-learning"}, {"name": "double-dqn"}]
    message = r"learners\.name = 'double-dqn'; it observes vectors, .*'q-learning', .*, states"
    with pytest.raises(RequestError, match=message):
        make_experiment(settings(learners=learners))


@pytest.mark.parametrize(
    ("task", "name", "suitable"),
    [
        ("cliff-walking", "double-dqn", "q-learning"),
        ({"name": "CartPole-v1", "discount": 0.9}, "q-learning", "double-dqn"),
    ],
)
def test_a_learner_that_does_not_suit_the_task_is_refused(task, name, suitable):
    experiment = make_experiment(settings(task=task, learners=[{"name": name}]))
    with pytest.raises(
        RequestError,
        match=rf"learners\.name = '{name}'; it observes .* is learned by .*'{suitable}'",
    ):
        make_plan(experiment)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"values": "exact"}, r"values = 'exact'; for task CartPole-v1, 'expert' or the path"),
        ({"values": "q-learning"}, r"values = 'q-learning'; .*'expert' or the path"),
        ({"values": "expert"}, r"no expert ships for task 'CartPole-v1'"),
        (
            {"task": "cliff-walking", "values": "expert"},
            r"values = 'expert'; for task cliff-walking, 'exact', 'q-learning' or the path",
        ),
        (
            {"task": {"name": "Acrobot-v1", "discount": 0.99}},
            r"values = '.*cart\.npz': they are of task CartPole-v1, not Acrobot-v1",
        ),
        (
            {"task": {"name": "Pendulum-v1", "discount": 0.99}},
            r"'Pendulum-v1': its action space is Box.*numbered actions",
        ),
        (
            {"task": {"name": "lunar-lander", "arguments": {"seeds": 3}}},
            r"'lunar-lander': .*'seeds'; its arguments are: seed",
        ),
    ],
)
def test_values_and_tasks_that_do_not_fit_are_refused_before_anything_runs(
    tmp_path, changes, message
):
    with pytest.raises(RequestError, match=message):
        make_plan(make_experiment(cart(tmp_path, **changes)))


def test_a_network_of_another_shape_is_refused(tmp_path):
    path = tmp_path / "narrow.npz"
    network_of(inputs=3, actions=2, task="CartPole-v1").save(path)
    with pytest.raises(RequestError, match=r"a network of 3 inputs and 2 actions; .* of 4 inputs"):
        make_plan(make_experiment(cart(tmp_path, values=str(path))))


def test_a_registered_task_takes_arguments():
    task = {"name": "lunar-lander", "arguments": {"seed": 5}}
    plan = make_plan(make_experiment(settings(task=task)))
    assert of_kind(VectorTask, plan.task).settings == {"seed": 5}
    other = make_plan(make_experiment(settings(task="lunar-lander")))
    assert plan.conditions.keys().isdisjoint(other.conditions)
