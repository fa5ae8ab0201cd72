"""The script that runs all that the page on Lunar Lander is made of; nothing is run here."""

import importlib
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from qbumpers.experiments.sources import load_experiment
from qbumpers.reproduction.experiments import reproduction
from tests.values.networks import network_of

DOCS = Path(__file__).parents[3] / "docs"
PROFILES = ["dueling", "learning-rate-5e-4", "long-exploration", "relu"]
CONDITIONS = {
    "none",
    "local-q-thresholding/alpha=0.9",
    "stochastic-q-bumpers/alpha=1",
    "stochastic-q-bumpers/alpha=0.8",
}


@pytest.fixture
def script(monkeypatch, tmp_path):
    """The script, about to write into a folder; the commands that it would run are listed."""
    monkeypatch.syspath_prepend(DOCS)
    script = importlib.import_module("run_lunar_lander")
    monkeypatch.setattr(sys, "argv", ["run_lunar_lander.py", str(tmp_path / "all")])
    commands = []

    def python(*arguments):
        commands.append([str(argument) for argument in arguments])
        if "--corrected" in arguments:
            network_of().save(arguments[-1])

    monkeypatch.setattr(script, "python", python)
    monkeypatch.setattr(script, "second_best", lambda expert: network_of(seed=2))
    return SimpleNamespace(module=script, commands=commands)


def test_the_full_figure_comes_first_and_the_page_last(script, tmp_path):
    script.module.main()
    folder = tmp_path / "all"
    first, *_, last = script.commands
    assert first == ["-m", "qbumpers", "reproduce", "lunar-lander", "--out", str(folder / "full")]
    names = [*PROFILES, "second-expert", "corrected-values"]
    ran = [command[-1] for command in script.commands if command[2] == "run"]
    assert ran == [str(folder / name) for name in names]
    page, *arguments = last
    assert Path(page).is_file()
    assert arguments[:3] == ["--keep", str(folder / "full"), "--runs"]
    assert arguments[3:9] == [f"{name}={folder / name}" for name in names]
    checked = ["expert", "corrected-values", "second-expert"]
    assert arguments[9:] == ["--quality", *(f"{name}={folder / name}.npz" for name in checked)]


def test_smaller_runs_differ_from_the_default_in_one_thing(script, tmp_path):
    script.module.main()
    usual = reproduction("lunar-lander")
    for name in (*PROFILES, "second-expert", "corrected-values"):
        path = tmp_path / "all" / f"{name}.toml"
        found = load_experiment(path)
        assert {each.condition for each in found.conditions()} == CONDITIONS
        assert {e.assistant for e in found.conditions()} <= {
            e.assistant for e in usual.conditions()
        }
        assert (found.trials, found.episodes, found.seed) == (4, 2_000, 0)
        changed = (found.learners != usual.learners, found.values != usual.values)
        assert changed == ((True, False) if name in PROFILES else (False, True))


def test_finished_experts_are_not_trained_again(script):
    script.module.main()
    trained = [command for command in script.commands if command[2] == "expert"]
    script.commands.clear()
    script.module.main()
    assert len(trained) == 2
    assert not [command for command in script.commands if command[2] == "expert"]


def test_the_second_expert_is_the_best_of_the_others(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(DOCS)
    script = importlib.import_module("run_lunar_lander")
    experts = [network_of(seed=seed, inputs=8, actions=4, task="lunar-lander") for seed in range(4)]
    merits = [0.5, 0.9, 0.7, 0.8]
    for number, values in enumerate(experts):
        values.save(tmp_path / "expert.npz.work" / f"seed-{number}.npz")
    experts[1].save(tmp_path / "expert.npz")
    known = {e.digest(): m for e, m in zip(experts, merits, strict=True)}
    monkeypatch.setattr(script, "judge", lambda task, values: known[values.digest()])
    monkeypatch.setattr(script, "best", lambda judgements: judgements.index(max(judgements)))
    assert script.second_best(tmp_path / "expert.npz").digest() == experts[3].digest()
