"""Modules of others, imported by name before what they register is named."""

import sys

import gymnasium
import pytest

from qbumpers import RequestError, make_task
from qbumpers.experiments.sources import load_experiment, make_experiment
from qbumpers.imports import import_modules, imported, module_and_name
from qbumpers.learners import learners
from tests.learners import own_learners

LAKES = """
import gymnasium
import own_lakes_helper
gymnasium.register(
    "{name}-v0", "gymnasium.envs.toy_text.frozen_lake:FrozenLakeEnv", max_episode_steps=STEPS
)
""".replace("STEPS", "own_lakes_helper.STEPS")


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Writes modules into folders below a current directory, all forgotten afterwards."""
    (tmp_path / "current").mkdir()
    monkeypatch.chdir(tmp_path / "current")
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr("qbumpers.imports._imported", {})
    registered = dict(gymnasium.registry)

    def write(folder, **texts):
        (tmp_path / folder).mkdir(exist_ok=True)
        for name, text in texts.items():
            (tmp_path / folder / f"{name}.py").write_text(text, encoding="utf-8")

    yield write
    for name in [name for name in sys.modules if name.startswith("own_")]:
        del sys.modules[name]
    gymnasium.registry.clear()
    gymnasium.registry.update(registered)


def test_a_module_before_a_colon_is_imported_first(modules):
    modules("current", own_lakes=LAKES.format(name="OwnLake"), own_lakes_helper="STEPS = 7")
    task = make_task("own_lakes:OwnLake-v0", discount=0.9)
    assert (task.name, task.episode_limit, task.states) == ("OwnLake-v0", 7, 16)
    assert task.digest() == make_task("OwnLake-v0", discount=0.9).digest()
    assert imported() == ["own_lakes"]
    assert module_and_name("own_lakes:OwnLake-v0") == ("own_lakes", "OwnLake-v0")
    assert module_and_name("cliff-walking") == ("", "cliff-walking")


EXPERIMENT = """
name = "lake"
assistants = [{ name = "none" }]
IMPORTS
[task]
name = "TASK"
discount = 0.9
"""


@pytest.mark.parametrize(
    ("imports", "task"),
    [('imports = ["own_lakes"]', "OwnLake-v0"), ("", "own_lakes:OwnLake-v0")],
)
def test_a_module_beside_an_experiment_file_is_found(modules, tmp_path, imports, task):
    modules("beside", own_lakes=LAKES.format(name="OwnLake"), own_lakes_helper="STEPS = 7")
    text = EXPERIMENT.replace("IMPORTS", imports).replace("TASK", task)
    (tmp_path / "beside" / "lake.toml").write_text(text, encoding="utf-8")
    found = load_experiment(tmp_path / "beside" / "lake.toml").task.task()
    assert found.episode_limit == 7


def test_imports_come_before_names_are_looked_up(modules, monkeypatch):
    monkeypatch.setattr("qbumpers.learners.registry._learners", learners())
    text = f"from {own_learners.__name__} import register_averaging\nregister_averaging()"
    modules("current", own_people=text)
    settings = {
        "name": "cliff", "task": "cliff-walking", "assistants": [{"name": "none"}],
        "learners": [{"name": "averaging"}],
    }  # fmt: skip
    with pytest.raises(RequestError, match=r"unknown learners\.name 'averaging'"):
        make_experiment(settings)
    assert make_experiment(settings, imports=["own_people"]).imports == ["own_people"]
    assert make_experiment({**settings, "imports": ["own_people"]}).learners[0].name == "averaging"


WRONG = {
    "missing": ("no_such", {}, r"there is no module 'no_such'; install .* put no_such\.py into"),
    "missing part": ("json.no_such", {}, r"there is no module 'json\.no_such'"),
    "needs another": (
        "own_broken", {"own_broken": "import no_such"},
        "module 'own_broken' needs module 'no_such', which is not installed",
    ),
    "fails": (
        "own_broken", {"own_broken": "1 / 0"},
        "module 'own_broken' fails while it is imported: ZeroDivisionError: division by zero",
    ),
    "malformed": ("own_broken", {"own_broken": "def"}, "fails while .*: SyntaxError: "),
    "a file": ("own_lakes.py", {"own_lakes": ""}, "'own_lakes.py' is no name of .*; leave .py out"),
    "a path": ("a/b", {}, "'a/b' is no name of a module, such as 'minigrid'"),
    "a number": (3, {}, "3 is no name of a module"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "texts", "message"), WRONG.values(), ids=list(WRONG))
def test_what_cannot_be_imported_is_named_in_one_line(modules, name, texts, message):
    modules("current", **texts)
    with pytest.raises(RequestError, match=message) as caught:
        import_modules([name], "imports")
    assert str(caught.value).startswith("imports: ")
    assert "\n" not in str(caught.value)


def test_an_unknown_environment_hints_at_its_module():
    with pytest.raises(RequestError, match=r"imports = \['MODULE'\].*--import.*'MODULE:NAME'") as e:
        make_task("MiniGrid-Empty-5x5-v0", discount=0.9)
    assert "did you mean" not in str(e.value)
