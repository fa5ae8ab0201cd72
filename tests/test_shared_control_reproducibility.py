"""Shared control again: the same seed, the same noise, a copy, a specification, a file."""

import copy
import json
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from qbumpers import SharedControl, make_assistant, register_assistant
from tests.assistants.own_rules import BudgetOptions, full_budget, guide_within_budget, spend
from tests.narrowing import of_kind, present
from tests.shared_control_examples import CLIFF, LAKE, Dial, bumpers, plain, play, skating, walking

ACTIONS = np.random.default_rng(5).integers(4, size=100).tolist()
LAKE_BUMPERS = bumpers(alpha=0.9, v_min=-0.1)


def session(environment: gymnasium.Env, episodes: int = 4, **reset) -> list:
    """What several episodes returned; only the first is seeded. Their numbers start at 0."""
    returned = plain(play(environment, ACTIONS, **reset))
    for _ in range(episodes - 1):
        returned += plain(play(environment, ACTIONS))
    records = [step[-1]["assistance"] for step in returned if "assistance" in step[-1]]
    before = records[0]["episode"] if records else 0
    for record in records:
        record["episode"] -= before
    return returned


def coins(returned: list) -> list[float]:
    return [step[-1]["assistance"]["coin"] for step in returned if len(step) == 5]


@pytest.mark.parametrize(
    ("make", "arguments"), [(walking, bumpers()), (skating, LAKE_BUMPERS), (skating, {})]
)
def test_equal_seeds_give_equal_sessions(make, arguments):
    first = session(make(**arguments), seed=11)
    assert session(make(**arguments), seed=11) == first
    assert session(make(**arguments), seed=12) != first


def test_a_used_environment_is_seeded_afresh():
    environment = walking(**bumpers())
    first = session(environment, seed=11)
    assert session(environment, seed=11) == first


def test_an_episode_without_a_seed_continues_the_streams():
    environment = walking("none")
    first, second = (coins(plain(play(environment, ACTIONS, **r))) for r in ({"seed": 1}, {}))
    assert len(set(first + second)) == len(first + second) >= 200


def test_two_unseeded_environments_draw_different_noise():
    first, second = (coins(plain(play(walking("none"), ACTIONS))) for _ in range(2))
    assert first != second


def test_noise_depends_on_the_seed_alone():
    lake, cliff = (coins(plain(play(m("none"), ACTIONS, seed=3))) for m in (skating, walking))
    assert lake == cliff[: len(lake)]
    assert lake


def test_the_environments_chances_are_those_of_the_environment_alone():
    alone = gymnasium.make("FrozenLake-v1", is_slippery=True)
    without = session(alone, episodes=20, seed=4)
    for step in without:
        assert step[-1].keys() <= {"prob"}
    shared = session(skating("none"), episodes=20, seed=4)
    for step in shared:
        step[-1] = {key: value for key, value in step[-1].items() if key == "prob"}
    assert shared == without


def test_what_was_executed_leads_to_the_same_states_without_an_assistant():
    shared = plain(play(skating("maximal"), ACTIONS, seed=9))
    executed = [step[-1]["assistance"]["executed"] for step in shared[1:]]
    assert executed != ACTIONS[: len(executed)]
    alone = plain(play(gymnasium.make("FrozenLake-v1", is_slippery=True), executed, seed=9))
    assert [step[:-1] for step in alone] == [step[:-1] for step in shared]


def test_recorded_noise_plays_the_same_decisions_again():
    recorded = plain(play(walking(**bumpers()), ACTIONS, seed=1))
    assert recorded[-1][-1]["assisted_episode"]["overrides"] > 3
    notes = [step[-1]["assistance"] for step in recorded[1:]]
    noise = [(note["coin"], note["tie"]) for note in notes]
    proposed = [note["proposed"] for note in notes]
    replayed = play(walking(**bumpers()), proposed, seed=2, options={"noise": noise})
    assert plain(replayed) == recorded


def test_recorded_noise_decides_whether_and_what():
    # Half way between 87 and 0 the bumpers override with probability 1/2; both ways are best.
    values = [87.0, 43.5, 87.0]
    environment = SharedControl(Dial(), values=lambda _: values, discount=1.0, **bumpers(alpha=1.0))
    executed = {}
    for coin in (0.49, 0.51):
        for tie in (0.49, 0.51):
            environment.reset(options={"noise": [(coin, tie)]})
            record = environment.step(6)[-1]["assistance"]
            assert record["probability"] == pytest.approx(0.5)
            assert (record["coin"], record["tie"]) == (coin, tie)
            executed[coin, tie] = record["executed"]
    assert executed == {(0.49, 0.49): 5, (0.49, 0.51): 7, (0.51, 0.49): 6, (0.51, 0.51): 6}


def test_other_reset_options_reach_the_environment_and_the_noise_does_not():
    environment = SharedControl(Dial(), "none", lambda _: [1, 2, 3], discount=1.0)
    given = {"noise": [(0.5, 0.5)], "tilt": 3}
    environment.reset(options=given)
    assert of_kind(Dial, environment.unwrapped).options == {"tilt": 3}
    assert given == {"noise": [(0.5, 0.5)], "tilt": 3}


def duplicated(environment: gymnasium.Env) -> list[gymnasium.Env]:
    return [copy.deepcopy(environment), pickle.loads(pickle.dumps(environment))]


@pytest.mark.parametrize(
    ("make", "arguments"), [(walking, bumpers()), (skating, LAKE_BUMPERS), (walking, {})]
)
def test_copies_continue_as_the_original_does(make, arguments):
    environment = make(**arguments)
    environment.reset(seed=21)
    for action in (3, 0):
        environment.step(action)
    copies = duplicated(environment)
    going_on = [[plain(e.step(2)), plain(e.step(0)), *session(e)] for e in (environment, *copies)]
    assert going_on[0] == going_on[1] == going_on[2]


def test_copies_share_nothing_that_changes():
    environment = walking(**bumpers())
    environment.reset(seed=21)
    copies = duplicated(environment)
    alone = session(walking(**bumpers()), seed=22)
    for other in copies:
        session(other, seed=23)
    assert session(environment, seed=22) == alone


def test_copies_remember_what_the_rule_remembers(own_registry):
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    environment = walking("budget", budget=2)
    environment.reset(seed=0)
    environment.step(1)  # spends one: right is the cliff
    for other in (environment, *duplicated(environment)):
        other.reset(seed=0)
        assert [other.step(1)[1] for _ in range(3)] == [-1.0, -1.0, -1.0]
        other.reset(seed=0)
        assert other.step(1)[1] == -100.0


@pytest.mark.parametrize("named", [True, False])
def test_a_specification_makes_the_environment_again(named):
    assistant = bumpers(alpha=0.4, second=True)
    if not named:
        assistant = {"assistant": make_assistant("stochastic-q-bumpers", alpha=0.4, second=True)}
    environment = walking(**assistant, perception="observant")
    again = gymnasium.make(present(environment.spec))
    assert isinstance(again, SharedControl)
    assert again.assistant == environment.assistant
    assert session(again, seed=6) == session(environment, seed=6)


def written(tmp_path) -> tuple[SharedControl, str]:
    CLIFF.save(tmp_path / "cliff.npz")
    environment = walking(values=str(tmp_path / "cliff.npz"), **bumpers(alpha=0.4))
    return environment, present(environment.spec).to_json()


def test_a_specification_goes_through_json(tmp_path):
    environment, text = written(tmp_path)
    arguments = json.loads(text)["additional_wrappers"][0]["kwargs"]
    assert arguments["assistant"] == "stochastic-q-bumpers"
    assert arguments["values"] == str(tmp_path / "cliff.npz")
    assert arguments["alpha"] == 0.4
    again = gymnasium.make(EnvSpec.from_json(text))
    assert session(again, seed=6) == session(environment, seed=6)


def test_a_specification_makes_the_same_environment_in_another_process(tmp_path):
    environment, text = written(tmp_path)
    program = (
        "import sys, gymnasium\n"
        "from gymnasium.envs.registration import EnvSpec\n"
        "environment = gymnasium.make(EnvSpec.from_json(sys.stdin.read()))\n"
        "environment.reset(seed=6)\n"
        "print([environment.step(1)[4]['assistance']['coin'] for _ in range(3)])\n"
    )
    printed = subprocess.run(
        [sys.executable, "-c", program], input=text, capture_output=True, text=True, check=True
    ).stdout
    environment.reset(seed=6)
    expected = [environment.step(1)[4]["assistance"]["coin"] for _ in range(3)]
    assert json.loads(printed) == expected


def test_the_lake_is_skated_under_bumpers():
    # What the comparisons above compare: sessions with overrides, and with none.
    returned = session(skating(values=LAKE, **LAKE_BUMPERS), seed=11)
    overridden = [step[-1]["assistance"]["overridden"] for step in returned if len(step) == 5]
    assert {True, False} == set(overridden)


def test_recorded_noise_is_for_one_episode():
    environment = walking("none")
    play(environment, [3], seed=1, options={"noise": [(0.25, 0.75)] * 50})
    assert 0.25 not in coins(plain(play(environment, ACTIONS)))
