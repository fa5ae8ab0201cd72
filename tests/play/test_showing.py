"""The server of a replay: sessions, episodes and frames, for who knows where."""

import json
import sqlite3
import urllib.error
import urllib.request

import pytest

from qbumpers.errors import RequestError
from qbumpers.play.game import Choice
from qbumpers.play.replaying import replay_file
from tests.play.recording import record
from tests.play.serving import AROUND, UP, replayed

BUMPERS = Choice("stochastic-q-bumpers", {"alpha": 0.5})


@pytest.fixture
def path(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(BUMPERS, AROUND), (BUMPERS, [UP])])
    record(cliff, path, [(BUMPERS, [UP])], session="two")
    return path


def answer(address, path, **headers):
    request = urllib.request.Request(f"http://{address}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=10) as found:
        return found.read()


def status(*asked, **headers):
    with pytest.raises(urllib.error.HTTPError) as refused:
        answer(*asked, **headers)
    with refused.value as error:
        return error.code, error.read().decode()


def test_a_page_finds_sessions_episodes_and_frames(path):
    with replayed(path) as address:
        assert b"/static/replay.js" in answer(address, "/secret/")
        sessions = json.loads(answer(address, "/secret/sessions"))
        assert [each["session"] for each in sessions] == ["one", "two"]
        assert [each["difference"] for each in sessions] == ["", ""]
        one = json.loads(answer(address, "/secret/sessions/0"))
        assert one["task"]["actions"] == ["up", "right", "down", "left"]
        assert [each["length"] for each in one["episodes"]] == [13, 1]
        frames = json.loads(answer(address, "/secret/sessions/0/0"))
        assert [frame["step"] for frame in frames] == list(range(14))


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ("/", 404), ("/sessions", 404), ("/another/sessions", 404), ("/secret/sessions/2", 404),
        ("/secret/sessions/0/2", 404), ("/secret/sessions/-1", 404), ("/socket", 404),
    ],
)  # fmt: skip
def test_what_is_not_there_is_not_there(path, asked, code):
    with replayed(path) as address:
        assert status(address, asked)[0] == code


def test_pages_of_another_name_learn_nothing(path):
    with replayed(path) as address:
        assert status(address, "/secret/sessions", Host="evil.example")[0] == 421


def test_a_task_that_is_not_known_any_more_is_said(path):
    raw = sqlite3.connect(path)
    raw.execute("update sessions set setup = replace(setup, '\"cliff-walking\"', '\"clif\"')")
    raw.commit()
    raw.close()
    with replayed(path) as address:
        assert (
            "unknown task 'clif'"
            in json.loads(answer(address, "/secret/sessions"))[0]["difference"]
        )
        code, message = status(address, "/secret/sessions/0")
    assert code == 409
    assert message.startswith("unknown task 'clif'")


def test_a_session_can_be_chosen(path):
    assert [found.session for found in replay_file(path, ["two"])] == ["two"]
    with pytest.raises(RequestError, match=r"session = 'three': the record has \['one', 'two'\]"):
        replay_file(path, ["two", "three"])
