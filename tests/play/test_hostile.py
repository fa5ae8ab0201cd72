"""Whoever sends nonsense, or nothing, keeps nobody else from playing, and loses nobody's steps."""

import contextlib
import random
import socket
import time

import numpy as np
import pytest

from qbumpers.play import prompt, server
from qbumpers.play.game import Choice
from qbumpers.play.replaying import replay_file
from tests.play.hostile import attacked, check_records, session_of
from tests.play.nonsense import nonsense
from tests.play.serving import AROUND, UP, Page, served

NONE = Choice("none", {})


def check(found):
    check_records(found)
    assert len(found.acknowledged) == 3
    assert min(found.acknowledged.values()) >= len(AROUND)
    assert "Traceback" not in found.output
    assert "Error" not in found.output
    assert found.most_files < 3000


def test_others_play_on_while_someone_is_hostile(tmp_path):
    found = attacked(tmp_path, seconds=6, half_open=150)
    check(found)
    assert np.median(found.late) < 0.5
    assert all(count > 10 for count in found.attacks.values())


@pytest.mark.slow
def test_others_play_on_while_thousands_of_connections_are_half_open(tmp_path):
    found = attacked(tmp_path, seconds=60, half_open=3000, seed=1)
    check(found)
    assert np.percentile(found.late, 99) < 2
    assert found.attacks["nothing sent"] == 3000


def closed_within(connection, seconds):
    """Whether a server closes a connection so soon, whatever it says before."""
    connection.settimeout(seconds)
    with contextlib.suppress(ConnectionError):
        try:
            while connection.recv(4096):
                pass
        except TimeoutError:
            return False
    return True


@pytest.fixture
def records(tmp_path):
    return tmp_path / "play.sqlite"


def opened(address, first=b""):
    host, port = address.split(":")
    connection = socket.create_connection((host, int(port)), 5)
    connection.sendall(first)
    return connection


def handshake(address):
    return (
        f"GET /socket HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    ).encode()


@pytest.mark.parametrize("first", [b"", b"GET / HTTP/1.1\r\nHos"])
def test_who_asks_for_nothing_is_cut_off(cliff, records, monkeypatch, first):
    monkeypatch.setattr(prompt, "REQUEST_WITHIN", 0.3)
    with served(cliff, NONE, records) as address, opened(address, first) as connection:
        assert not closed_within(connection, 0.1)
        for _ in range(4):  # bytes that trickle in are no request
            with contextlib.suppress(OSError):
                connection.sendall(b"a")
            time.sleep(0.1)
        assert closed_within(connection, 5)


def test_no_connection_that_is_no_socket_lasts(cliff, records, monkeypatch):
    monkeypatch.setattr(prompt, "LASTS", 0.5)
    request = b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 9999\r\n\r\n"
    with served(cliff, NONE, records) as address, opened(address, request) as connection:
        for _ in range(8):
            with contextlib.suppress(OSError):
                connection.sendall(b"slow")
            time.sleep(0.1)
        assert closed_within(connection, 5)


def test_idle_connections_make_way_for_others(cliff, records, monkeypatch):
    monkeypatch.setattr(prompt, "MOST_IDLE", 5)
    with served(cliff, NONE, records) as address, contextlib.ExitStack() as stack:
        idle = [stack.enter_context(opened(address)) for _ in range(8)]
        with Page(address) as page:
            assert page.next()["type"] == "welcome"
        assert all(closed_within(connection, 2) for connection in idle[:4])
        assert not closed_within(idle[-1], 0.2)


def test_who_does_not_greet_is_sent_away(cliff, records, monkeypatch):
    monkeypatch.setattr(server, "GREETING", 0.3)
    with served(cliff, NONE, records) as address, opened(address, handshake(address)) as connection:
        connection.settimeout(5)
        said = b""
        while more := connection.recv(4096):
            said += more
        assert b"no hello within" in said


def test_sockets_that_do_not_greet_make_way_for_pages(cliff, records, monkeypatch):
    monkeypatch.setattr(server, "MOST_SILENT", 3)
    with served(cliff, NONE, records) as address, contextlib.ExitStack() as stack:
        silent = [stack.enter_context(opened(address, handshake(address))) for _ in range(6)]
        with Page(address) as page:
            page.begin()
            page.next("state")
            assert page.act(0, UP)["number"] == 1
        assert all(closed_within(connection, 4) for connection in silent[:3])
        assert not closed_within(silent[-1], 0.2)


def test_so_many_pages_may_be_open(cliff, records, monkeypatch):
    monkeypatch.setattr(server, "MOST_CONNECTIONS", 2)
    with served(cliff, NONE, records) as address:
        with Page(address) as first, Page(address) as second:
            assert (first.next()["type"], second.next()["type"]) == ("welcome", "welcome")
            with Page(address) as third:
                assert third.next()["reason"] == "too many pages are open"
        time.sleep(0.2)
        with Page(address) as fourth:
            assert fourth.next()["type"] == "welcome"


@pytest.mark.parametrize("seed", range(3))
def test_a_session_goes_on_through_nonsense(cliff, records, seed):
    chance, sent = random.Random(seed), []
    with served(cliff, NONE, records) as address:
        with Page(address) as page:
            token = page.next("welcome")["token"]
            page.begin()
            number = page.next("state")["number"]
            for _ in range(150):
                sent.append(nonsense(chance, sent))
                with contextlib.suppress(UnicodeEncodeError):
                    page.socket.send(sent[-1])
                with contextlib.suppress(TimeoutError):
                    while True:
                        found = page.next(timeout=0.01)
                        assert found["type"] in ("problem", "state")
                        if found["type"] == "state":
                            number = found["number"]
        with Page(address, token) as page:
            state = page.next("state")
            assert state["number"] == number
            if not state["episode"]["over"]:
                assert page.act(number, UP)["number"] == number + 1
    [found] = replay_file(records)
    assert found.difference == ""
    assert found.steps >= number


def test_a_token_is_of_one_session(cliff, records):
    with served(cliff, NONE, records) as address, Page(address) as one, Page(address) as two:
        tokens = [page.next("welcome")["token"] for page in (one, two)]
    assert len({session_of(token) for token in tokens}) == 2


@pytest.mark.slow
def test_a_page_that_takes_nothing_is_dropped(cliff, records):
    hello = b'{"type": "hello"}'
    with served(cliff, NONE, records) as address, opened(address, handshake(address)) as connection:
        time.sleep(0.5)
        connection.sendall(bytes([0x81, 0x80 | len(hello)]) + bytes(4) + hello)
        time.sleep(17.5)  # nothing is read meanwhile, and no ping is answered
        assert closed_within(connection, 1)
