"""`qbumpers expert`: solve, train, check."""

import re

import numpy as np
import pytest
from stable_baselines3 import DQN
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

from qbumpers import load_values, solve
from qbumpers.experts import correcting, visiting
from qbumpers.tasks import make_task
from qbumpers.values import NetworkValues, TabularValues
from tests.narrowing import of_kind, present
from tests.values.networks import constant, network_of

POLE = ("CartPole-v1", "--discount", "0.9")
QUICK = (*POLE, "--steps", "1500", "--opening", "0", "--hidden", "8", "--seeds", "2")


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def pole():
    values = network_of(inputs=4, actions=2, task="CartPole-v1")
    values.save("pole.npz")
    return values


def test_a_tabular_task_is_solved_exactly_and_kept(call):
    status, output, _ = call("expert", "cliff-walking")
    assert status == 0
    assert "V of the start 87; over 148 states and actions the error is at most 0" in output
    exact = solve(make_task("cliff-walking"))
    assert load_values("cliff-walking.npz").digest() == exact.digest()


def test_a_table_is_checked_against_the_exact_solution(call):
    exact = solve(make_task("cliff-walking"))
    wrong = TabularValues(exact.table + 0.25, 1.0, "cliff-walking", "off by a quarter")
    wrong.save("wrong.npz")
    status, output, _ = call("expert", "cliff-walking", "--check", "wrong.npz")
    assert status == 0
    assert "off by a quarter" in output
    assert "the error is at most 0.25, its mean 0.25" in output


@pytest.mark.slow
def test_training_keeps_the_best_with_its_record_and_all_seeds(call, tmp_path):
    status, output, errors = call("expert", *QUICK, "--out", "expert.npz")
    assert status == 0
    assert "return, 10% after 50" in output
    said = " ".join(errors.split())
    assert "counts as solved from 475 on; try more steps, more seeds" in said
    assert "Kept seed" in output
    values = of_kind(NetworkValues, load_values("expert.npz"))
    assert "the best of seeds 0, 1; return" in values.method
    assert values.network.hidden == (8,)
    kept = sorted((tmp_path / "expert.npz.work").iterdir())
    assert [path.name[:7] for path in kept] == ["seed-0-", "seed-1-"]
    before = [path.stat().st_mtime_ns for path in kept]
    digests = [load_values(path).digest() for path in kept]
    assert values.digest() in digests
    assert call("expert", *QUICK, "--out", "expert.npz")[0] == 0
    assert [path.stat().st_mtime_ns for path in kept] == before


def test_an_estimated_table_is_solved_and_says_how_uncertain_it_is(call):
    lake = ("FrozenLake-v1", "--discount", "0.9", "--out", "lake.npz")
    status, output, errors = call("expert", *lake, "--estimated", "12000")
    assert (status, errors) == (0, "")
    assert "The table was estimated from 12,000 steps: 44 pairs" in output
    found = re.search(r"V\* of the start: (\S+), 95% interval (\S+) to (\S+)\b", output)
    value, low, high = (float(each) for each in present(found).groups())
    truth = float(solve(make_task("FrozenLake-v1", discount=0.9))(0).max())
    assert low < truth < high
    assert low < value < high
    assert "estimated from 12,000 steps" in load_values("lake.npz").method


def test_keys_can_be_left_out_only_of_observations_that_have_some(call):
    status, _, errors = call("expert", *QUICK, "--observe", "angle,speed")
    assert status == 2
    assert "observe = ['angle', 'speed']; only an observation of several parts" in errors


def test_a_file_is_checked_and_drawn(call, pole, tmp_path):
    status, output, _ = call("expert", *POLE, "--check", "pole.npz", "--figures", "drawn")
    assert status == 0
    assert "Off the greedy path values differ from what is achieved" in output
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {
        "pole-quality.png", "pole-quality.svg",
    }  # fmt: skip


@pytest.mark.slow
def test_values_are_corrected_into_another_file(call, pole, monkeypatch):
    monkeypatch.setattr(visiting, "_EPISODES", 10)
    monkeypatch.setattr(correcting, "_UPDATES", 300)
    monkeypatch.setattr(correcting, "BRANCHES", 60)
    status, output, _ = call("expert", *POLE, "--check", "pole.npz", "--corrected", "mended.npz")
    assert status == 0
    assert "In states held out the error was" in output
    mended = load_values("mended.npz")
    assert "each state corrected by" in mended.method
    assert load_values("pole.npz").digest() == pole.digest() != mended.digest()


def test_an_expert_worse_than_random_is_warned_of(call):
    constant(0, 4, 2, task="CartPole-v1").save("fall.npz")
    status, _, errors = call("expert", *POLE, "--check", "fall.npz")
    assert status == 0
    assert "warning: values of task CartPole-v1" in errors
    assert "say nothing about the method" in errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("CartPole-v1",), "discount is missing"),
        ((*POLE, "--hidden", "64,x"), "--hidden 64,x: whole numbers"),
        ((*POLE, "--hidden", "0"), "expert: network.hidden.0 = 0"),
        ((*POLE, "--activation", "elu"), "network.activation = 'elu'"),
        ((*POLE, "--learning-rate", "7"), "learning_rate = 7.0"),
        ((*POLE, "--opening", "-1"), "random_start = -1"),
        ((*POLE, "--check", "absent.npz"), "absent.npz: there is none"),
        ((*POLE, "--figures", "drawn"), "--figures drawn: they are of a check"),
        (
            ("Acrobot-v1", "--discount", "0.9", "--check", "pole.npz"),
            "4 inputs and 2 actions; task Acrobot",
        ),
        (("cliff-walking", "--figures", "d", "--check", "pole.npz"), "a table needs none"),
        (("cliff-walking", "--check", "pole.npz"), "a network of 4 inputs"),
        (("cliff-walking", "--corrected", "mended.npz"), "the values of a table are exact"),
        ((*POLE, "--check", "table.npz"), "a table [48, 4]; task CartPole"),
        (("Pendulum-v1", "--discount", "0.9"), "numbered actions"),
    ],
)
def test_wrong_requests_are_named(call, pole, arguments, message):
    solve(make_task("cliff-walking")).save("table.npz")
    status, _, errors = call("expert", *arguments)
    assert status == 2
    assert message in " ".join(errors.split())


def test_the_help_states_the_rule_of_choice(call):
    status, output, _ = call("expert", "--help")
    assert status == 0
    said = " ".join(output.split())
    for part in ("2% random actions", "10% random actions", "after 50 random actions"):
        assert part in said


def test_a_stopped_training_goes_on_with_what_is_missing(call, monkeypatch, tmp_path):
    from qbumpers.experts import choosing

    original = choosing.train_expert

    def stopped(*arguments, seed, **fields):
        if seed == 1:
            raise RuntimeError("the lights went out")
        return original(*arguments, seed=seed, **fields)

    monkeypatch.setattr(choosing, "train_expert", stopped)
    assert call("expert", *QUICK)[0] == 1
    [kept] = (tmp_path / "CartPole-v1.npz.work").iterdir()
    before = kept.stat().st_mtime_ns
    monkeypatch.setattr(choosing, "train_expert", original)
    assert call("expert", *QUICK)[0] == 0
    assert kept.stat().st_mtime_ns == before
    assert of_kind(NetworkValues, load_values("CartPole-v1.npz")).inputs == 4


@pytest.fixture
def model():
    """A model that saw normalised observations, and its statistics, in files."""
    statistics = VecNormalize(make_vec_env("CartPole-v1"), norm_reward=False)
    shape = {"net_arch": [8]}
    model = DQN("MlpPolicy", statistics, learning_starts=50, seed=0, policy_kwargs=shape)
    model.learn(200)
    model.save("model.zip")
    statistics.save("statistics.pkl")
    observations = np.random.default_rng(0).normal(0, 0.1, (50, 4)).astype(np.float32)
    best = model.predict(statistics.normalize_obs(observations), deterministic=True)[0]
    return observations, best


CONVERT = ("expert", *POLE, "--convert", "model.zip", "--out", "values.npz")


def test_a_model_is_converted_with_its_statistics(call, model):
    observations, best = model
    status, output, errors = call(*CONVERT, "--statistics", "statistics.pkl")
    assert status == 0
    assert "200 steps, with the statistics of its observations: mean return" in output
    assert "not known" not in errors
    assert np.array_equal(load_values("values.npz")(observations).argmax(axis=1), best)


def test_a_model_without_statistics_is_converted_with_a_warning(call, model):
    status, _, errors = call(*CONVERT)
    assert status == 0
    assert "warning: model model.zip: it is not known whether it saw normalised" in errors


@pytest.mark.usefixtures("pole")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((*POLE, "--statistics", "s.pkl"), "--statistics s.pkl: they are of a model; give --conv"),
        ((*POLE, "--convert", "m.zip", "--check", "pole.npz"), "give one of the two"),
        (("cliff-walking", "--convert", "m.zip"), "cliff-walking has a table, it is solved"),
        ((*POLE, "--convert", "m.zip"), "model m.zip: there is no such file"),
    ],
)
def test_conversions_that_cannot_be_are_refused(call, arguments, message):
    status, _, errors = call("expert", *arguments)
    assert status == 2
    assert message in errors
