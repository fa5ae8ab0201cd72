"""The server, as pages see it."""

import contextlib
import json
import sqlite3
import time
import urllib.error
import urllib.request
from typing import NamedTuple

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from qbumpers import register_assistant
from qbumpers.decisions import Decision
from qbumpers.play import connection
from qbumpers.play.game import Choice
from qbumpers.play.replaying import replay_file
from qbumpers.play.setup import Setup
from qbumpers.play.tables import open_records, read_session, sessions_in
from tests.narrowing import present
from tests.play.serving import AROUND, LEFT, RIGHT, UP, Page, process, served
from tests.values.networks import network_of

BUMPERS = Choice("stochastic-q-bumpers", {"alpha": 0.5})


@pytest.fixture
def records(tmp_path):
    return tmp_path / "play.sqlite"


@pytest.fixture
def address(cliff, records):
    with served(cliff, BUMPERS, records) as address:
        yield address


def recorded(records):
    engine = open_records(records)
    found = [present(read_session(engine, session)) for session in sessions_in(engine)]
    engine.dispose()
    return found


def test_a_page_learns_what_it_plays_and_plays_it(address, records):
    with Page(address) as page:
        welcome = page.next()
        assert welcome["type"] == "welcome"
        assert welcome["task"]["actions"] == ["up", "right", "down", "left"]
        assert welcome["choice"]["assistant"] == "stochastic-q-bumpers"
        assert "maximal" in [offer["name"] for offer in welcome["offers"]]
        page.begin()
        first = page.next("state")
        assert (first["number"], first["words"]) == (0, "row 4 of 4, column 1 of 12, the start")
        assert first["view"]["values"] == [87.0, -13.0, 86.0, 86.0]
        state = [page.act(number, action) for number, action in enumerate(AROUND)][-1]
        assert state["episode"]["total"] == 87
        assert state["episode"]["success"]
        assert state["view"] is None
    [found] = replay_file(records)
    assert (found.task, found.episodes, found.steps) == ("cliff-walking", 1, 13)
    assert found.difference == ""


def test_what_the_assistant_does_is_told_with_what_was_pressed(address):
    with Page(address) as page:
        page.begin(assistant="maximal")
        page.next("state")
        last = page.act(0, RIGHT)["last"]
        assert (last["proposed"], last["executed"], last["overridden"]) == (RIGHT, UP, True)
        assert last["probability"] == 1


def test_late_and_repeated_messages_change_nothing(address):
    with Page(address) as page:
        page.begin()
        page.begin()
        page.begin(episode=5)
        page.next("state")
        page.act(0, UP)
        for number in (0, 0, 7):
            page.press(number, RIGHT)
        assert page.act(1, UP)["number"] == 2
        page.press(2, 99)
        assert page.next()["message"] == "action = 99; it must lie in [0, 4)"
        assert page.act(2, UP)["number"] == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nonsense", "message: JSON is malformed"),
        ('{"type": "hello"}', "hello: it has been said already"),
        ('{"type": "begin", "episode": 0, "assistant": "angel"}', "unknown assistant 'angel'"),
        (
            '{"type": "begin", "episode": 0, "assistant": "fading", "options": {"half_life": 0}}',
            "assistant fading: ",
        ),
        (
            json.dumps({"type": "begin", "episode": 0, "assistant": "stochastic-q-bumpers",
                        "options": {"alpha": 1, "v_min": 500}}),
            "v_min = 500 must be below the value of the start state",
        ),
        (
            '{"type": "begin", "episode": 0, "assistant": "undo", "options": {"name": "maximal"}}',
            "unknown option",
        ),
        ('{"type": "hold", "sequence": 1, "action": 44}', "action = 44; it must lie in [0, 4)"),
    ],
)  # fmt: skip
def test_a_wrong_message_is_answered_and_loses_nothing(address, text, message):
    with Page(address) as page:
        page.next("welcome")
        page.socket.send(text)
        problem = page.next()
        assert problem["type"] == "problem"
        assert message in problem["message"]
        page.begin()
        assert page.next("state")["number"] == 0


def test_bytes_are_no_message(address):
    with Page(address) as page:
        page.next("welcome")
        page.socket.send(b"{}")
        assert "a JSON text is needed" in page.next()["message"]


def test_a_page_that_comes_back_goes_on_in_mid_episode(address, records):
    with Page(address) as page:
        token = page.next()["token"]
        page.begin()
        page.next("state")
        for number in range(4):
            page.act(number, UP)
    with Page(address, token) as page:
        welcome = page.next()
        assert [episode["length"] for episode in welcome["history"]] == [4]
        assert page.next()["number"] == 4
        assert page.act(4, LEFT)["number"] == 5
    [session] = recorded(records)
    assert len(session.played[0].steps) == 5


def test_a_second_page_takes_over_and_the_first_learns_why(address):
    with Page(address) as first:
        token = first.next()["token"]
        first.begin()
        first.next("state")
        first.act(0, UP)
        with Page(address, token) as second:
            assert first.next()["reason"] == "this session goes on in another tab or window"
            with pytest.raises(ConnectionClosed) as closed:
                first.next()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == connection.TAKEN_OVER
            assert second.next("state")["number"] == 1
            assert second.act(1, UP)["number"] == 2


def closing(page):
    found = page.next("closing")
    with pytest.raises(ConnectionClosed):
        page.next()
    return found["code"], found["reason"]


def test_a_token_of_someone_else_is_none(address, cliff, tmp_path):
    with Page(address) as page:
        token = page.next()["token"]
    # The last character of a signature has bits that count for nothing; the first has none.
    start = token.rindex(".") + 1
    forged = token[:start] + ("A" if token[start] != "A" else "B") + token[start + 1 :]
    with Page(address, forged) as page:
        assert closing(page) == (connection.UNKNOWN_SESSION, "this server knows no such session")
    with served(cliff, BUMPERS, tmp_path / "other.sqlite") as other, Page(other, token) as page:
        assert closing(page)[0] == connection.UNKNOWN_SESSION


def test_a_session_of_another_task_is_refused_by_what_differs(address, records):
    with Page(address) as page:
        token = page.next()["token"]
    with served(Setup("inventory"), BUMPERS, records) as other, Page(other, token) as page:
        code, reason = closing(page)
    assert code == connection.UNKNOWN_SESSION
    assert "another task of task cliff-walking: 'cliff-walking', now 'inventory'" in reason


def test_whoever_sends_too_much_is_sent_away(address):
    with Page(address) as page:
        page.next("welcome")
        with contextlib.suppress(ConnectionClosed):
            for _ in range(2000):
                page.send(type="focus", focused=True, at=0)
        code, reason = closing(page)
    assert code == connection.TOO_MUCH
    assert reason == "more than 100 messages per second; the page may send fewer"


def test_whoever_greets_wrongly_is_told_so(address):
    with connect(f"ws://{address}/socket", origin=Origin(f"http://{address}")) as socket:
        socket.send('{"type": "pause"}')
        assert json.loads(socket.recv())["reason"] == "the first message of a page is hello"


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null", "https://{address}"])
def test_a_page_of_another_site_gets_no_socket(address, origin):
    given = None if origin is None else Origin(origin.format(address=address))
    with pytest.raises(InvalidStatus, match="403"), connect(f"ws://{address}/socket", origin=given):
        pass


def answer(address, path, **headers):
    request = urllib.request.Request(f"http://{address}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10) as found:
            return found.status, dict(found.headers), found.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, dict(error.headers), error.read()


def test_every_answer_has_a_strict_policy(address):
    for path, status in (("/", 200), ("/static/main.js", 200), ("/static/../server.py", 404)):
        found = answer(address, path)
        assert found[0] == status
        headers = {name.lower(): value for name, value in found[1].items()}
        assert "default-src 'none'; script-src 'self'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert "server" not in headers
    assert answer(address, "/", Host="evil.example")[0] == 421


def test_a_task_in_real_time_goes_by_its_clock(lander, records):
    with served(lander, Choice("none", {}), records) as address, Page(address) as page:
        page.begin()
        assert [page.next("countdown")["seconds"] for _ in range(3)] == [3, 2, 1]
        page.next("running")
        page.send(type="hold", sequence=5, action=2, pressed=1.0, shown=2.0)
        page.send(type="hold", sequence=4, action=1)  # late
        began = time.monotonic()
        first = page.next("state")["number"]
        numbers = [page.next("state")["number"] for _ in range(25)]
        lasted = time.monotonic() - began
        assert numbers == list(range(first + 1, first + 26))
        assert 0.4 < lasted < 3  # 26 steps at 50 Hz
        page.send(type="pause")
        page.next("paused")
        page.send(type="continue")
        page.next("running")
        assert page.next("state")["last"]["proposed"] == 0  # released by the pause
        page.send(type="focus", focused=False, at=3.0)
        assert page.next("paused")["why"] == "the page is not in front"
    [session] = recorded(records)
    actions = [int(step.proposed) for step in session.played[0].steps]
    assert set(actions) == {0, 2}
    assert next(replay_file(records)).difference == ""


def test_the_clock_stops_while_the_page_is_away(records):
    with served(Setup("mountain-car"), Choice("none", {}), records) as address:
        with Page(address) as page:
            token = page.next()["token"]
            page.begin()
            page.next("running")
            page.next("state")
        time.sleep(0.3)
        before = len(recorded(records)[0].played[0].steps)
        time.sleep(0.3)
        assert len(recorded(records)[0].played[0].steps) == before
        with Page(address, token) as page:
            assert page.next("state")["number"] == before
            page.next("running")
            assert page.next("state")["number"] == before + 1
            assert page.next("paused", timeout=20)["why"] == "the page has not been heard of"


def test_half_speed_is_half_as_fast(lander, records):
    with served(lander, Choice("none", {}), records) as address, Page(address) as page:
        page.begin()
        page.send(type="speed", share="1/2")
        page.next("running")
        page.next("state")
        began = time.monotonic()
        for _ in range(15):
            page.next("state")
        assert 15 / 25 * 0.9 < time.monotonic() - began < 3


def test_without_a_key_the_actions_of_cart_pole_take_turns(tmp_path, records):
    network_of(inputs=4, actions=2, task="CartPole-v1").save(tmp_path / "pole.npz")
    pole = Setup("CartPole-v1", tmp_path / "pole.npz", discount=0.9)
    with served(pole, Choice("none", {}), records) as address, Page(address) as page:
        page.begin()
        page.next("running")
        began = time.monotonic()
        while page.next("state")["number"] < 6:
            pass
        assert time.monotonic() - began > 4 / 25  # half of its own 50 Hz
        page.send(type="hold", sequence=1, action=1)
        while page.next("state")["number"] < 12:
            pass
    [session] = recorded(records)
    actions = [int(step.proposed) for step in session.played[0].steps]
    assert actions[:6] == [0, 1, 0, 1, 0, 1]
    assert actions[9:12] == [1, 1, 1]


class NoOptions(NamedTuple):
    pass


def test_an_assistant_that_fails_loses_only_the_step(address, records):
    @register_assistant("fails-at-right", NoOptions)
    def fails_at_right(situation, noise, options):
        return Decision(9 if situation.proposed == 1 else situation.proposed, 0.0)

    with Page(address) as page:
        token = page.next()["token"]
        page.begin(assistant="fails-at-right")
        page.next("state")
        page.act(0, UP)
        page.press(1, RIGHT)
        code, reason = closing(page)
    assert code == connection.FAILED
    assert "assistant fails-at-right: Decision(action=9" in reason
    with Page(address, token) as page:
        assert page.next("state")["number"] == 1
        assert page.act(1, UP)["number"] == 2
    assert len(recorded(records)[0].played[0].steps) == 2


def test_what_cannot_be_written_is_not_shown(address, records):
    with Page(address) as page:
        token = page.next()["token"]
        page.begin()
        page.next("state")
        page.act(0, UP)
        raw = sqlite3.connect(records)
        raw.execute(
            "create trigger full before insert on steps begin select raise(abort, 'disk full'); end"
        )
        raw.commit()
        page.press(1, UP)
        code, reason = closing(page)
        assert code == connection.NOT_KEPT
        assert "the record cannot be written: IntegrityError" in reason
        assert "disk full" in reason
    raw.execute("drop trigger full")
    raw.commit()
    raw.close()
    with Page(address, token) as page:
        assert page.next("state")["number"] == 1
        assert page.act(1, UP)["number"] == 2


def test_a_killed_server_loses_nothing_and_doubles_nothing(tmp_path):
    out = tmp_path / "records"
    with process("cliff-walking", "--assistant", "maximal", "--out", str(out)) as server:
        numbers = []
        token = ""
        for kill in range(3):
            with Page(server.address, token) as page:
                token = page.next()["token"]
                if kill == 0:
                    page.begin(assistant="stochastic-q-bumpers", alpha=0.9)
                number = page.next("state")["number"]
                assert number == len(numbers)
                numbers += [page.act(number + k, UP)["number"] for k in range(3)]
                server.kill()
            server.start()
        assert numbers == list(range(1, 10))
        with Page(server.address, token) as page:
            assert page.next("state")["number"] == 9
        assert server.interrupt()[0] == 0
        [found] = replay_file(out / "play.sqlite")
        assert (found.steps, found.difference) == (9, "")
        server.start()
