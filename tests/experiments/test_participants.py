"""What people played, exported: their steps to the bit, in files that everything else reads."""

import json

import numpy as np
import polars as pl
import pytest

pytest.importorskip("sqlalchemy", reason="the extra study is not installed")

import qbumpers
from qbumpers.analysis.measures import learning_curve, trial_measures
from qbumpers.analysis.report import write_report
from qbumpers.errors import RequestError
from qbumpers.experiments.participants import export_records
from qbumpers.experiments.steps import load_steps
from qbumpers.play.game import Choice, Game
from qbumpers.play.setup import Setup
from qbumpers.play.tables import (
    EPISODES,
    NOTES,
    SESSIONS,
    STEPS,
    TENURES,
    Tenure,
    open_records,
    step_row,
)
from qbumpers.play.writing import Writer

AROUND = [0, *[1] * 11, 2]
HELPED = Choice("stochastic-q-bumpers", {"alpha": 0.5})
ALONE = HELPED._replace(assisted=False)
FULL = Choice("maximal", {})


@pytest.fixture(scope="module")
def cliff():
    return Setup("cliff-walking")


class Diary:
    """Records that are written as a server writes them, and what was written."""

    def __init__(self, path):
        self.path = path
        self._writer = Writer(open_records(path))
        self.games = {}

    def play(self, session, setup, episodes):
        """Episodes of a choice with the actions that are proposed, until they run out."""
        number = len(self.games)
        game = self.games[session] = Game(setup, number)
        row = {"session": session, "began": float(number), "seed": str(number),
               "setup": setup.described(), "version": "0"}  # fmt: skip
        self._add((SESSIONS, row), (TENURES, Tenure(session, 0).row()))
        self._add((NOTES, {"session": session, "time": 1.0, "kind": "joined", "content": "{}"}))
        log = []
        for episode, (choice, actions) in enumerate(episodes):
            game.begin(choice)
            row = {"session": session, "episode": episode, "began": 0.0, "assistant": choice.name,
                   "options": json.dumps(choice.options), "assisted": choice.assisted}  # fmt: skip
            self._add((EPISODES, row))
            for action in actions:
                if not game.playing:
                    break
                step = game.propose(action)
                own = {"device": "keyboard", "shown": 1.0, "pressed": 2.0 + len(log)}
                row = step_row(session, game.number - 1, episode, step)
                self._add((STEPS, {**row, **own, "received": 3.0, "applied": 4.0}))
                log.append(step._replace(episode=episode))
        return log

    def _add(self, *rows):
        self._writer.add(rows).result(10)

    def close(self):
        self._writer.close()


@pytest.fixture
def diary(tmp_path):
    made = Diary(tmp_path / "play.sqlite")
    yield made
    made.close()


def stray(seed):
    """Keys of someone who mostly walks around the cliff."""
    chance = np.random.default_rng(seed)
    return [int(chance.integers(4)) if chance.random() < 0.2 else key for key in AROUND * 20]


def fields(table):
    """A table of steps as rows of plain numbers, those of vectors as tuples."""
    columns = [np.asarray(column) for column in table]
    return [
        tuple(np.ravel(column[k]).tolist() for column in columns) for k in range(len(columns[0]))
    ]


def test_a_table_of_steps_is_the_log_step_by_step(diary, cliff, tmp_path):
    logs = {
        "one": diary.play("one", cliff, [(HELPED, stray(0)), (ALONE, stray(1)), (FULL, stray(2))]),
        "two": diary.play("two", cliff, [(Choice("undo", {}), stray(3))]),
    }
    export_records(diary.path, tmp_path / "out")
    found = load_steps(tmp_path / "out" / "steps.parquet")
    assert list(found) == ["one", "two"]
    for name, log in logs.items():
        assert fields(found[name]) == [tuple(np.ravel(f).tolist() for f in step) for step in log]
    table = pl.read_parquet(tmp_path / "out" / "steps.parquet")
    assert table["pressed"].to_list() == [2.0 + k for log in logs.values() for k in range(len(log))]
    own = table.filter(participant="one").group_by("episode", maintain_order=True).first()
    assert own["assisted"].to_list() == [True, False, True]
    assert own["condition"].to_list() == [
        "stochastic-q-bumpers/alpha=0.5", "stochastic-q-bumpers/alpha=0.5", "maximal",
    ]  # fmt: skip
    assert pl.read_parquet(tmp_path / "out" / "notes.parquet")["kind"].to_list() == ["joined"] * 2


def test_vectors_are_exported_to_the_bit(diary, tmp_path):
    log = diary.play("one", Setup("lunar-lander"), [(HELPED, [2, 1, 3, 0] * 5)])
    [found] = export_records(diary.path, tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / "steps.parquet")
    np.testing.assert_array_equal(table["state"].to_numpy(), [step.state for step in log])
    assert table["state"].to_numpy().dtype == np.float32
    assert (found.episodes, found.unfinished, found.pairs) == (0, 1, 0)
    with pytest.raises(RequestError, match="vectors cannot be fitted"):
        load_steps(tmp_path / "out" / "steps.parquet")


def test_a_pair_is_an_assisted_episode_and_the_unassisted_one_after_it(diary, cliff, tmp_path):
    diary.play("one", cliff, [
        (ALONE, AROUND),  # of no pair
        (HELPED, AROUND), (ALONE, [1, *AROUND]),
        (FULL, AROUND), (HELPED, [3, *AROUND]), (ALONE, AROUND),  # FULL is of no pair
        (ALONE, AROUND),  # nor is this
        (HELPED, AROUND), (ALONE, AROUND[:5]),  # not ended
    ])  # fmt: skip
    diary.play("two", cliff, [(FULL, AROUND), (ALONE, AROUND)])
    diary.play("idle", cliff, [])
    [found] = export_records(diary.path, tmp_path / "out")
    assert found._replace(folder=tmp_path) == (tmp_path, "cliff-walking", 2, 10, 3, 4, 1, 1)
    results = qbumpers.load(tmp_path / "out")
    assert results.missing == {}
    assert (results.experiment.trials, results.experiment.episodes) == (2, 2)
    assert results.values.digest() == cliff.values(()).digest()
    rows = results.episodes.select(
        "condition", "trial", "episode", "assisted_return", "unassisted_return", "assisted_length",
        "unassisted_crash",
    ).rows()  # fmt: skip
    bumpers = "stochastic-q-bumpers/alpha=0.5"
    assert rows == [
        (bumpers, 0, 0, 87.0, -13.0, 13, True),
        (bumpers, 0, 1, 86.0, 87.0, 14, False),
        ("maximal", 1, 0, 87.0, 87.0, 13, False),
    ]
    played = pl.read_parquet(tmp_path / "out" / "played.parquet")
    assert played["ended"].to_list() == [*[True] * 8, False, True, True]
    assert played["assisted"].sum() == 5


def test_participants_may_play_as_much_as_they_like(diary, cliff, tmp_path):
    for number, rounds in enumerate([1, 2, 3]):
        keys = [(choice, stray(number + k)) for k in range(rounds) for choice in (HELPED, ALONE)]
        diary.play(f"p{number}", cliff, keys)
    diary.play("full", cliff, [(FULL, AROUND), (ALONE, stray(9))])
    export_records(diary.path, tmp_path / "out")
    episodes = qbumpers.load(tmp_path / "out").episodes
    measured = trial_measures(episodes)
    for row in measured.iter_rows(named=True):
        own = episodes.filter(condition=row["condition"], trial=row["trial"]).sort("episode")
        returns = own["unassisted_return"].to_list()
        assert row["unassisted"] == pytest.approx(np.mean(returns))
        assert row["unassisted_last"] == returns[-1]
        assert row["unassisted_area"] == pytest.approx(np.trapezoid(returns))
    bumpers = episodes["condition"][0]
    curve = learning_curve(episodes, bumpers, "unassisted_return")
    for episode in range(3):
        there = episodes.filter(condition=bumpers, episode=episode)["unassisted_return"]
        assert curve[0, episode] == pytest.approx(there.mean())
    assert np.isnan(learning_curve(episodes, "maximal", "unassisted_return")[0, 1:]).all()
    findings = write_report(tmp_path / "out")
    assert findings.summary["trials"].to_list() == [3, 1]
    page = (tmp_path / "out" / "report.html").read_text()
    assert "4 participants" in page
    assert "Not finished" not in page


def test_every_task_has_a_folder_and_nobody_else_loses_one(diary, cliff, tmp_path):
    diary.play("one", cliff, [(HELPED, AROUND), (ALONE, AROUND)])
    diary.play("idle", Setup("mountain-car"), [])
    diary.play("two", Setup("inventory"), [(Choice("maximal", {}), [0, 1, 0])])
    found = export_records(diary.path, tmp_path / "out")
    assert [each.folder.name for each in found] == ["cliff-walking", "inventory"]
    again = export_records(diary.path, tmp_path / "out")
    assert again == found
    assert not (tmp_path / "out" / "inventory" / "experiment.toml").exists()
    design = (tmp_path / "out" / "cliff-walking" / "experiment.toml").read_text()
    other = tmp_path / "other" / "inventory" / "experiment.toml"
    other.parent.mkdir(parents=True)
    other.write_text(design.replace('"participant"', '"q-learning"'))
    with pytest.raises(RequestError, match="inventory holds an experiment; choose another folder"):
        export_records(diary.path, tmp_path / "other")


def test_records_of_nothing_are_refused(diary, cliff, tmp_path):
    with pytest.raises(RequestError, match="nobody has played yet"):
        export_records(diary.path, tmp_path / "out")
    diary.play("idle", cliff, [])
    with pytest.raises(RequestError, match="nobody has played yet"):
        export_records(diary.path, tmp_path / "out")
    with pytest.raises(RequestError, match=r"absent\.sqlite: there is none"):
        export_records(tmp_path / "absent.sqlite", tmp_path / "out")
