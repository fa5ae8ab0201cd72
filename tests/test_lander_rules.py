"""The rules that were tried at Lunar Lander do what they say, and what they bring is judged."""

import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from qbumpers import make_assistant, shipped_expert
from qbumpers.conformance import check_conformance
from qbumpers.decisions import Model, Noise, Situation, Step
from qbumpers.tasks.corridors import vector_corridor
from qbumpers.tasks.dynamics import TERMINATED

DOCS = Path(__file__).parents[1] / "docs"
VALUES = np.array([3.0, 10.0, 8.0, 9.5])
MODEL = Model(0, 2, 4, -1, 0.9, None, 1 - np.eye(4))
RULES = {
    "scheduled-bumpers": {"begin": 0.5, "over": 10, "until": 30},
    "recent": {"alpha": 0.5},
    "watchful": {"alpha": 1.0},
    "governed": {"share": 0.1},
    "mirrored": {"alpha": 0.2},
}


@pytest.fixture
def script(monkeypatch):
    """The script, with its rules registered for the time of a test."""
    monkeypatch.syspath_prepend(str(DOCS))
    for name in ("lander_rules", "run_lander_rules"):
        sys.modules.pop(name, None)
    return importlib.import_module("run_lander_rules")


def situation(proposed=0, episode=0, step=0, earned=0.0, discount=1.0):
    return Situation(
        np.zeros(2, np.float32), VALUES, np.zeros((0, 4)), proposed, earned, discount, 10.0,
        episode, step,
    )  # fmt: skip


def step_of(proposed, executed, reward=0.0, events=0, episode=0):
    state = np.array([0.5, -0.5], np.float32)
    return Step(
        episode, state, proposed, executed, False, proposed, proposed != executed, 0.0, 0.0, 0.0,
        VALUES, 0.0, reward, state, events,
    )  # fmt: skip


def probability(assistant, memory=0, **where):
    return assistant.decide(situation(**where), Noise(0.0, 0.0), memory).probability


def bumpers(alpha, **where):
    return probability(make_assistant("stochastic-q-bumpers", alpha=alpha), **where)


def test_scheduled_bumpers_are_bumpers_of_the_alpha_of_the_episode(script):
    assistant = make_assistant("scheduled-bumpers", begin=0.2, over=8, until=20)
    for episode, alpha in ((0, 0.2), (2, 0.4), (8, 1.0), (19, 1.0)):
        for proposed in range(4):
            found = probability(assistant, proposed=proposed, episode=episode)
            assert found == pytest.approx(bumpers(alpha, proposed=proposed))
    assert bumpers(1.0) > 0
    assert probability(assistant, episode=20) == 0


def test_losses_of_late_count_most(script):
    assistant = make_assistant("recent", alpha=0.9, kept=0.5)
    memory = assistant.start(MODEL)
    for executed in (2, 3, 0):  # which lose 2, 0.5 and 7
        memory = assistant.observe(memory, step_of(0, executed))
    lost = 7 + 0.5 * 0.5 + 0.25 * 2
    # 8 loses 2 more, of the 9 that may be lost: the logistic through f(1) = 0.999.
    ratio = (0.5 * lost + 2) / 9
    expected = 1 / (1 + (0.999 / 0.001) ** (1 - 2 * ratio))
    assert probability(assistant, memory, proposed=2) == pytest.approx(expected)
    assert probability(assistant, memory, proposed=2, episode=1) < 0.03  # nothing lost as yet


def test_the_watchful_look_at_what_a_discounted_account_has_forgotten(script):
    assistant = make_assistant("watchful", alpha=0.5)
    late = {"earned": 9.9, "discount": 0.01, "step": 400}
    assert bumpers(0.5, **late) < 0.01
    assert probability(assistant, **late) == bumpers(0.5) == 1
    assert probability(assistant, proposed=1, **late) == 0


def test_alpha_follows_the_share_of_overrides(script):
    assistant = make_assistant("governed", share=0.25, rate=0.1)
    memory = assistant.start(MODEL)
    for _ in range(40):
        memory = assistant.observe(memory, step_of(1, 1))
    assert memory == pytest.approx(np.exp(-1))
    for executed in (1, 0, 0, 0) * 3:  # a share of 0.25 is overridden
        memory = assistant.observe(memory, step_of(0, executed))
    assert memory == pytest.approx(np.exp(-1))
    for _ in range(30):
        memory = assistant.observe(memory, step_of(0, 1))
    assert memory == 1


@pytest.mark.slow
def test_a_mirror_credits_the_proposal_and_lets_pass_what_is_meant(script):
    assistant = make_assistant("mirrored", alpha=0.0, meant=1.0)
    memory = assistant.start(MODEL)
    for number in range(4_000):  # to propose 2 brings 5, whatever is executed; all else nothing
        proposed = number % 4
        brought = 5.0 if proposed == 2 else 0.0
        memory = assistant.observe(memory, step_of(proposed, 1, brought, TERMINATED))
    there = situation(proposed=2)._replace(state=np.array([0.5, -0.5], np.float32))
    meant = assistant.decide(there, Noise(0.0, 0.0), memory)
    slip = assistant.decide(there._replace(proposed=3), Noise(0.0, 0.0), memory)
    assert meant.probability == pytest.approx(bumpers(1.0, proposed=2))
    assert slip == (1, 1.0, False)


@pytest.mark.slow
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", RULES)
def test_a_tried_rule_does_the_same_in_every_host(script, name):
    assistant = make_assistant(name, **RULES[name])
    assert assistant.compiled
    assert all(found.steps for found in check_conformance(assistant, tasks=[vector_corridor()]))


def rows(returns):
    return pl.DataFrame([
        {"rule": name, "learner": learner, "assisted": assisted + learner / 10,
         "unassisted": unassisted - learner / 10}
        for name, (assisted, unassisted) in returns.items() for learner in range(4)
    ])  # fmt: skip


def test_the_verdict_names_what_is_ahead_and_what_is_beyond_the_frontier(script, capsys):
    found = script.judged(rows({
        script.BUMPERS: (210.0, 190.0), "both": (214.0, 195.0), "one": (228.0, 100.0),
        "neither": (205.0, 150.0),
    }))  # fmt: skip
    assert script.frontier_with(found) == ["both", "one"]
    printed = capsys.readouterr().out
    assert f"Ahead of {script.BUMPERS} in both returns: both\n" in printed
    more = found["one"]["unassisted_more"]
    assert more["low"] < -90 < more["high"] + 1
    assert more["mean"] == pytest.approx(-90)


@pytest.mark.slow
def test_what_was_tried_can_be_measured_again(tmp_path):
    shipped_expert("lunar-lander").save(tmp_path / "corrected.npz")  # correcting takes minutes
    command = [sys.executable, str(DOCS / "run_lander_rules.py"), str(tmp_path)]
    given = ("--learners", "1", "--episodes", "2")
    once, again = (
        subprocess.run([*command, *given], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert "Beyond the frontier of all settings of bumpers" in once
    assert again == once
