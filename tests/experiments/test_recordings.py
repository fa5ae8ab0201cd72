"""Recorded steps as Minari reads them back, against the run's own tables."""

import warnings
from contextlib import closing

import numpy as np
import polars as pl
import pytest

import qbumpers
from qbumpers.decisions import Step
from qbumpers.errors import RequestError
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.recordings import INFOS, _episodes, export_recording
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experts import ExpertWarning
from qbumpers.tasks import registry
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, TRUNCATED
from tests.experiments.examples import run_into
from tests.tasks.lakes import Tabled
from tests.values.networks import network_of

minari = pytest.importorskip("minari")

CONDITION = "stochastic-q-bumpers/alpha=0.3"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The rows of two trials of a run with retention, and the dataset made from them."""
    folder = run_into(tmp_path_factory.mktemp("recorded") / "out", retention=2)
    rows = qbumpers.load(folder).episodes.filter(
        pl.col("condition") == CONDITION, pl.col("trial").is_in([1, 2])
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(tmp_path_factory.mktemp("datasets")))
        written = export_recording(folder, CONDITION, "cliff/bumpers-v0", trials=range(1, 3))
        dataset = minari.load_dataset("cliff/bumpers-v0")
        with pytest.raises(RequestError, match=r"'cliff/bumpers-v0': .*already exists"):
            export_recording(folder, CONDITION, "cliff/bumpers-v0")
        episodes = [dataset[number] for number in range(dataset.total_episodes)]
        assert written == len(episodes) == rows.height
        assert dataset.action_space.n == 4
        assert dataset.observation_space.n == 48
    return folder, list(zip(rows.iter_rows(named=True), episodes, strict=True))


def test_returns_lengths_and_overrides_are_those_of_the_run(recorded):
    for row, episode in recorded[1]:
        assert episode.rewards.sum() == row["assisted_return"]
        assert len(episode.actions) == row["assisted_length"]
        assert episode.infos["overridden"].sum() == row["overrides"]
        assert set(episode.infos["trial"]) == {row["trial"]}
        assert set(episode.infos["episode"]) == {row["episode"]}


def test_observations_follow_from_the_executed_actions(recorded):
    moves = [(-1, 0), (0, 1), (1, 0), (0, -1)]
    for _, episode in recorded[1]:
        assert episode.observations[0] == 36
        for state, action, after in zip(
            episode.observations, episode.actions, episode.observations[1:], strict=False
        ):
            row, column = (np.array(divmod(state, 12)) + moves[action]).clip((0, 0), (3, 11))
            fell = row == 3 and 0 < column < 11
            assert after == (36 if fell else 12 * row + column)


def test_an_episode_ends_at_the_goal_or_is_cut(recorded):
    for _, episode in recorded[1]:
        assert not episode.terminations[:-1].any()
        assert not episode.truncations[:-1].any()
        assert episode.terminations[-1] == (episode.observations[-1] == 47)
        assert episode.truncations[-1] == (not episode.terminations[-1])
        assert episode.terminations[-1] or len(episode.actions) == 100
        assert not episode.infos["undone"].any()


def test_ends_follow_the_events_and_an_undone_step_leads_back():
    """Two episodes: one ends for good after an undone step, one is cut in the midst of a step."""
    numbers, real = np.array([0, 0, 1]), np.zeros(3)
    steps = Step(
        episode=numbers, state=np.array([5, 5, 7]), proposed=numbers, executed=numbers,
        undone=np.array([True, False, True]), credited=numbers, overridden=np.zeros(3, bool),
        probability=real, coin=real, tie=real, values=np.zeros((3, 2)), projected_return=real,
        reward=real, next_state=np.array([6, 8, 9]),
        events=np.array([0, TERMINATED, LIMIT], np.uint8),
    )  # fmt: skip
    first, second = _episodes(4, steps)
    assert first["observations"].tolist() == [5, 5, 8]
    assert first["infos"]["undone"].tolist() == [False, True, False]
    assert (first["terminations"].tolist(), first["truncations"].any()) == ([False, True], False)
    assert second["observations"].tolist() == [7, 7]
    assert (second["terminations"].tolist(), second["truncations"].tolist()) == ([False], [True])
    [cut] = _episodes(0, Step(*(a[2:] for a in steps))._replace(events=np.array([TRUNCATED])))
    assert cut["truncations"].tolist() == [True]


def test_infos_have_one_structure_with_an_entry_for_the_reset(recorded):
    values = qbumpers.solve(qbumpers.make_task("cliff-walking"))
    for row, episode in recorded[1]:
        infos = episode.infos
        assert set(infos) == {*INFOS, "trial", "episode"}
        assert {len(infos[name]) for name in infos} == {len(episode.actions) + 1}
        assert (infos["proposed"][0], infos["overridden"][0]) == (-1, False)
        assert np.isnan(infos["probability"][0])
        assert (infos["values"][1:] == values.table[episode.observations[:-1]]).all()
        different = infos["proposed"][1:] != episode.actions
        assert (infos["overridden"][1:] == different).all()
        if row["retention"]:
            assert (infos["probability"][1:] == 0).all()


def plan_of(task, **changes):
    assistants = [{"name": "none"}]
    settings = {"name": "kept", "task": task, "assistants": assistants, "trials": 1, "episodes": 1}
    return make_plan(make_experiment(settings | changes))


SPECS = {
    "cliff-walking": ("cliff-walking", "qbumpers/CliffWalking-v0", 100, {}),
    "lunar-lander": (
        {"name": "lunar-lander", "arguments": {"seed": 3}}, "qbumpers/LunarLander-v0", 1000,
        {"seed": 3},
    ),
    "a lake": (
        {"name": "FrozenLake-v1", "discount": 0.9, "episode_limit": 30,
         "arguments": {"is_slippery": False}},
        "FrozenLake-v1", 30, {"is_slippery": False},
    ),
    "a pole": ({"name": "CartPole-v1", "discount": 0.9}, "CartPole-v1", 500, {}),
}  # fmt: skip


@pytest.mark.parametrize(("task", "name", "limit", "arguments"), SPECS.values(), ids=list(SPECS))
def test_the_environment_can_be_made_again_from_a_dataset(
    tmp_path, monkeypatch, task, name, limit, arguments
):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    values = {}
    if name == "CartPole-v1":
        network_of(inputs=4, actions=2, task=name).save(tmp_path / "values.npz")
        values = {"values": str(tmp_path / "values.npz")}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExpertWarning)  # of a random network
        plan = plan_of(task, **values)
        run_experiment(plan, tmp_path / "out", backend=ThisMachine(1))
        export_recording(tmp_path / "out", "none", "again/none-v0")
    dataset = minari.load_dataset("again/none-v0")
    with closing(dataset.recover_environment()) as environment:
        assert environment.spec.id == name
        assert environment.spec.max_episode_steps == limit
        for argument, value in arguments.items():
            assert environment.unwrapped.spec.kwargs[argument] == value
        assert environment.action_space == dataset.action_space
        first, _ = environment.reset(seed=0)
        assert environment.observation_space.contains(first)
        assert np.shape(first) == np.shape(dataset[0].observations[0])


WRONG = {
    "condition": (
        {"condition": "stochastic-q-bumpers/alpha=0.2"},
        r"unknown condition .*did you mean 'stochastic-q-bumpers/alpha=0\.[37]'",
    ),
    "trial": ({"trials": range(4, 6)}, r"trials = range\(4, 6\); .* 0 to 4, are needed"),
    "no trial": ({"trials": 0}, r"trials = 0; at least 1"),
    "name": ({"dataset": "cliff/bumpers"}, r"'cliff/bumpers'; a name with a version"),
    "malformed name": ({"dataset": "a b-v0"}, r"dataset = 'a b-v0': Malformed"),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=list(WRONG))
def test_what_cannot_be_exported_is_named(recorded, tmp_path, monkeypatch, changes, message):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    arguments = {"condition": CONDITION, "dataset": "other-v0", **changes}
    with pytest.raises(RequestError, match=message):
        export_recording(recorded[0], **arguments)
    assert list(tmp_path.rglob("*.hdf5")) == []


def test_states_and_actions_are_numbered_as_in_the_environment(tmp_path, monkeypatch):
    """Whose actions are 2, 3 and 4 and whose states begin with 7: its table has every step."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    monkeypatch.setattr(registry, "_tasks", dict(registry._tasks))
    environment = Tabled(3, first_state=7, first_action=2)
    task = qbumpers.TabularTask.from_gymnasium(environment, discount=0.9, episode_limit=20)
    qbumpers.register_task("numbered", lambda: task)
    experiment = {"name": "numbered", "task": "numbered", "trials": 1, "episodes": 4,
                  "assistants": [{"name": "maximal"}]}  # fmt: skip
    plan = make_plan(make_experiment(experiment))
    run_experiment(plan, tmp_path / "out", backend=ThisMachine(1))
    export_recording(tmp_path / "out", "maximal", "numbered/maximal-v0")
    dataset = minari.load_dataset("numbered/maximal-v0")
    assert dataset.action_space == environment.action_space
    assert dataset.observation_space == environment.observation_space
    steps = 0
    for number in range(dataset.total_episodes):
        episode = dataset[number]
        for state, action, to, reward, ended in zip(
            episode.observations, episode.actions, episode.observations[1:], episode.rewards,
            episode.terminations, strict=False,
        ):  # fmt: skip
            rows = environment.P[int(state)][int(action)]
            assert any(row[1:] == (to, reward, ended) for row in rows)
            steps += 1
        infos = episode.infos
        assert set(infos["proposed"][1:]) | set(infos["credited"][1:]) <= {2, 3, 4}
        assert (infos["proposed"][0], infos["credited"][0]) == (-1, -1)
    assert steps > 10
