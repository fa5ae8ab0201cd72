"""Wrong experiments: each message names the field, its value and what is allowed."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.reproduction.experiments import reproduction
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.experiments.examples import settings, write_toml


def bumpers(**options):
    return {"assistants": [{"name": "stochastic-q-bumpers", **options}]}


WRONG = {
    "trials below 1": ({"trials": 0}, r"trials = 0: .*greater than or equal to 1"),
    "negative trials": ({"trials": -4}, r"trials = -4: .*greater than or equal to 1"),
    "episodes below 1": ({"episodes": 0}, r"episodes = 0: .*greater than or equal to 1"),
    "negative seed": ({"seed": -1}, r"seed = -1: .*greater than or equal to 0"),
    "trials as text": ({"trials": "100"}, r"trials = '100': .*integer"),
    "trials as a truth": ({"trials": True}, r"trials = True: .*integer"),
    "half a trial": ({"trials": 2.5}, r"trials = 2\.5: .*integer"),
    "task as a number": ({"task": 3}, r"task = 3: .*TaskDesign"),
    "no assistants": ({"assistants": []}, r"assistants = \[\]: .*at least 1"),
    "assistant as a name": ({"assistants": ["none"]}, r"assistants\.0 = 'none': .*AssistantDesign"),
    "assistant without a name": (
        {"assistants": [{"alpha": 0.5}]},
        r"assistants\.0\.name: .*requir",
    ),
    "name with a slash": ({"name": "../x"}, r"name = '\.\./x': .*pattern"),
    "empty name": ({"name": ""}, r"name = '': .*pattern"),
    "unknown field": ({"trails": 9}, r"trails = 9: unknown field \(did you mean 'trials'\?\)"),
    "unknown field of the task": (
        {"task": {"name": "cliff-walking", "episode_limits": 9}},
        r"task\.episode_limits = 9: unknown field \(did you mean 'episode_limit'\?\)",
    ),
    "unknown field of the learner": (
        {"learners": [{"perceptoin": "transition"}]},
        r"learners\.0\.perceptoin = 'transition': unknown field \(did you mean 'perception'\?\)",
    ),
    "unknown field of a schedule": (
        {"learners": [{"epsilon": {"fractoin": 0.5}}]},
        r"learners\.0\.epsilon\.fractoin = 0\.5: unknown field \(did you mean 'fraction'\?\)",
    ),
    "unknown learner": (
        {"learners": [{"name": "sarsaa"}]},
        r"unknown learners\.name 'sarsaa' \(did you mean 'sarsa'\?\)",
    ),
    "unknown perception": (
        {"learners": [{"perception": "transitoin"}]},
        r"learners\.perception 'transitoin' \(did you mean 'transition'\?\)\. Known: .*observant",
    ),
    "fraction above 1": (
        {"learners": [{"epsilon": {"fraction": 1.5}}]},
        r"learners\.0\.epsilon\.fraction = 1\.5: .*less than or equal to 1",
    ),
    "learning rate that is no number": (
        {"learners": [{"learning_rate": {"end": float("nan")}}]},
        r"learners\.0\.learning_rate\.end = nan: ",
    ),
    "infinite initial value": (
        {"learners": [{"initial_value": float("inf")}]},
        r"learners\.0\.initial_value = inf: .*finite",
    ),
    "discount of 0": (
        {"learners": [{"discount": 0.0}]},
        r"learners\.0\.discount = 0\.0: .*greater than 0",
    ),
    "discount above 1": (
        {"task": {"name": "Taxi-v4", "discount": 1.01}},
        r"task\.discount = 1\.01: .*less than or equal to 1",
    ),
    "unknown assistant": (
        {"assistants": [{"name": "stochastic-q-bumper", "alpha": 0.7}]},
        r"unknown assistant 'stochastic-q-bumper' \(did you mean 'stochastic-q-bumpers'\?\)",
    ),
    "unknown option": (
        bumpers(alfa=0.7),
        r"option of assistant stochastic-q-bumpers: 'alfa' \(did you mean 'alpha'\?\)",
    ),
    "missing option": (bumpers(second=True), r"assistant stochastic-q-bumpers: alpha: .*required"),
    "alpha above 1": (
        bumpers(alpha=1.5),
        r"assistant stochastic-q-bumpers: alpha = 1\.5: .*less than or equal to 1",
    ),
    "alpha out of range in a list": (
        bumpers(alpha=[0.2, -0.1, 0.4]),
        r"assistant stochastic-q-bumpers: alpha = -0\.1: .*greater than or equal to 0",
    ),
    "alpha as text": (bumpers(alpha="0.7"), r"alpha = '0\.7': .*number"),
    "a list within a list": (bumpers(alpha=[[0.2]]), r"alpha = \[0\.2\]: .*number"),
    "option of another kind": (bumpers(alpha=0.7, second=1), r"second = 1: .*boolean"),
    "empty list": (
        bumpers(alpha=[]),
        r"assistant stochastic-q-bumpers: alpha = \[\]; at least one value is needed",
    ),
    "duplicate condition": (
        {"assistants": [{"name": "none"}, {"name": "none"}]},
        r"condition none occurs 2 times; keep one",
    ),
    "duplicate value": (
        bumpers(alpha=[0.7, 0.2, 0.7]),
        r"condition stochastic-q-bumpers/alpha=0\.7 occurs 2 times",
    ),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=list(WRONG))
def test_a_wrong_experiment_is_refused(tmp_path, changes, message):
    path = write_toml(tmp_path / "wrong.toml", **changes)
    with pytest.raises(RequestError, match=rf"experiment file .*wrong\.toml: .*{message}"):
        load_experiment(path)


def test_a_missing_field_is_named():
    with pytest.raises(RequestError, match=r"^here: .*name: field required"):
        make_experiment({"task": "cliff-walking", "assistants": [{"name": "none"}]}, "here")


def test_all_wrong_fields_are_named_at_once():
    with pytest.raises(RequestError, match=r"trials = 0: .*; episodes = 0: .*; seed = -1: "):
        make_experiment(settings(trials=0, episodes=0, seed=-1))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'name = "x', "not valid TOML: "),
        (b'name = "x"\ntrials =\n', r"not valid TOML: .*line 2"),
        (b'name = "x"\nname = "y"\n', "not valid TOML: "),
        (b'name = "\xff"', "not valid TOML: byte 9 is not UTF-8"),
        (b"", r"name: field required; task: field required; assistants: field required"),
    ],
    ids=["open string", "no value", "twice", "not UTF-8", "empty"],
)
def test_a_file_that_is_no_experiment_is_refused(tmp_path, content, message):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(RequestError, match=rf"experiment file .*broken\.toml: {message}"):
        load_experiment(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RequestError, match=r"experiment file .*absent\.toml: No such file"):
        load_experiment(tmp_path / "absent.toml")


def test_a_folder_is_no_experiment_file(tmp_path):
    with pytest.raises(RequestError, match=r"experiment file .*: Is a directory"):
        load_experiment(tmp_path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"task": "cliff-waking"}, r"task 'cliff-waking' \(did you mean 'cliff-walking'\?\)"),
        ({"task": {"name": "FrozenLake-v1"}}, r"'FrozenLake-v1': discount is missing"),
        (
            {"task": {"name": "cliff-walking", "discount": 0.9}},
            r"'cliff-walking' takes no arguments",
        ),
        (
            {"task": {"name": "FrozenLake-v1", "discount": 0.9, "arguments": {"size": 3}}},
            r"'FrozenLake-v1': .*size",
        ),
        ({"values": "absent.npz"}, r"values file absent\.npz: there is none"),
        (bumpers(alpha=0.5, v_min=87.0), r"v_min = 87 must be below .*V\*\(s_0\) = 87"),
    ],
    ids=["task", "no discount", "discount", "argument", "values", "v_min"],
)
def test_what_only_the_task_can_tell_is_refused_before_anything_runs(changes, message):
    with pytest.raises(RequestError, match=message):
        make_plan(make_experiment(settings(**changes)))


def test_values_of_another_task_are_refused(tmp_path):
    path = tmp_path / "cliff.npz"
    solve(cliff_walking()).save(path)
    lake = {"name": "FrozenLake-v1", "discount": 0.9}
    with pytest.raises(
        RequestError, match=r"values = '.*cliff\.npz': .*task cliff-walking, not FrozenLake-v1"
    ):
        make_plan(make_experiment(settings(task=lake, values=str(path))))


@pytest.mark.parametrize(
    ("arguments", "changes", "message"),
    [
        (["clif-walking"], {}, r"unknown reproduction 'clif-walking' \(did you mean 'cliff-walk"),
        (["cliff-walking", "figure"], {}, r"unknown profile 'figure' \(did you mean 'figures'\?\)"),
        (["cliff-walking", "../text"], {}, r"unknown profile '\.\./text'"),
        (
            ["cliff-walking"],
            {"trials": 0},
            r"cliff-walking, profile figures: trials = 0: .*equal to 1",
        ),
        (["cliff-walking", "text"], {"seed": -2}, r"profile text: seed = -2: .*equal to 0"),
        (["cliff-walking"], {"people": 3}, r"people = 3: unknown field"),
    ],
)
def test_a_wrong_reproduction_is_refused(arguments, changes, message):
    with pytest.raises(RequestError, match=message):
        reproduction(*arguments, **changes)


def test_an_unknown_published_experiment_is_named_with_the_nearest():
    settings = {"name": "mine", "task": "cliff-walking", "assistants": [{"name": "none"}]}
    with pytest.raises(RequestError, match=r"reproduces 'clif-walking' .*'cliff-walking'"):
        make_experiment({**settings, "reproduces": "clif-walking"})
