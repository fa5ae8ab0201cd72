"""A record is decided again, and says the first thing that comes out differently."""

import json
import re
import sqlite3

import pytest

from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Game
from qbumpers.play.replaying import replay_file
from qbumpers.play.tables import EPISODES, SESSIONS, STEPS, open_records, step_row
from qbumpers.play.writing import Writer


@pytest.fixture
def record(cliff, tmp_path):
    """Three episodes of two assistants, the last one open."""
    path = tmp_path / "play.sqlite"
    writer = Writer(open_records(path))
    game = Game(cliff, 11)
    writer.add([(SESSIONS, {"session": "one", "began": 0.0, "seed": "11",
                            "setup": cliff.described(), "version": "0"})])  # fmt: skip
    for episode, (choice, most) in enumerate([
        (Choice("stochastic-q-bumpers", {"alpha": 0.5}), 200),
        (Choice("undo", {}), 200),
        (Choice("stochastic-q-bumpers", {"alpha": 0.5}), 8),
    ]):  # fmt: skip
        game.begin(choice)
        about = {"assistant": choice.name, "options": json.dumps(choice.options)}
        row = {"session": "one", "episode": episode, "began": 0.0, "assisted": True, **about}
        writer.add([(EPISODES, row)])
        for k in range(most):
            if not game.playing:
                break
            row = step_row("one", game.number, episode, game.propose(k * k % 4))
            writer.add([(STEPS, {**row, "device": "keyboard"})])
    writer.close()
    return path, game.number


def test_a_record_replays_to_its_last_step(record):
    path, steps = record
    [found] = replay_file(path)
    assert found == ("one", "cliff-walking", 3, steps, "")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("reward = -2 where number = 3", r"step 3 \(episode 0\): reward is -1\.0, recorded -2\.0"),
        ("coin = 0.9999 where overridden and probability between 0.01 and 0.99", "(executed|over)"),
        ("executed = 3 - executed where episode = 1", "executed is"),
        ("next_state = '5' where number = 6", "next_state is"),
        ("proposed = 9 where number = 2", r"proposed = 9; it must lie in \[0, 4\)"),
    ],
)
def test_a_changed_record_is_found_out(record, change, message):
    path, _ = record
    raw = sqlite3.connect(path)
    changed = raw.execute(f"update steps set {change}").rowcount
    raw.commit()
    raw.close()
    assert changed
    [found] = replay_file(path)
    assert re.search(message, found.difference)


def test_a_record_of_another_version_is_refused_by_name(record):
    path, _ = record
    raw = sqlite3.connect(path)
    raw.execute("update sessions set setup = replace(setup, '\"revision\": 1', '\"revision\": 0')")
    raw.commit()
    raw.close()
    [found] = replay_file(path)
    assert found.difference == "it was played with another revision of task cliff-walking: 0, now 1"


def test_there_must_be_a_record(tmp_path):
    with pytest.raises(RequestError, match="there is none"):
        replay_file(tmp_path / "absent.sqlite")
