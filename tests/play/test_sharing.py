"""Several servers, one database: a session goes on wherever its page comes next."""

import pytest
from websockets.exceptions import ConnectionClosed

from qbumpers.play import connection
from qbumpers.play.game import Choice
from qbumpers.play.replaying import replay_file
from tests.play.postgresql import AT_ONCE, database
from tests.play.serving import UP, Page, process, served

BUMPERS = Choice("stochastic-q-bumpers", {"alpha": 0.5})


def closing(page):
    found = page.next("closing")
    with pytest.raises(ConnectionClosed):
        page.next()
    return found["code"], found["reason"]


def test_a_session_goes_on_at_another_server_and_the_first_says_so(cliff, store):
    with (
        served(cliff, BUMPERS, store) as here,
        served(cliff, BUMPERS, store) as there,
        Page(here) as first,
    ):
        token = first.next()["token"]
        first.begin()
        first.next("state")
        first.act(0, UP)
        with Page(there, token) as second:
            assert second.next("state")["number"] == 1
            assert second.act(1, UP)["number"] == 2
            first.press(1, UP)
            assert closing(first) == (
                connection.TAKEN_OVER, "this session goes on in another tab or window"
            )  # fmt: skip
            with Page(here, token) as third:
                assert third.next("state")["number"] == 2
                assert third.act(2, UP)["number"] == 3
                second.press(2, UP)
                assert closing(second)[0] == connection.TAKEN_OVER
    [found] = replay_file(store)
    assert (found.steps, found.difference) == (3, "")


def test_a_page_that_comes_back_to_a_server_that_lost_the_session_takes_it_again(cliff, store):
    """The first server still has the game as it was before the other one went on."""
    with (
        served(cliff, BUMPERS, store) as here,
        served(cliff, BUMPERS, store) as there,
        Page(here) as first,
    ):
        token = first.next()["token"]
        first.begin()
        first.next("state")
        with Page(there, token) as second:
            second.next("state")
            second.act(0, UP)
        with Page(here, token) as third:
            assert third.next("state")["number"] == 1
            assert third.act(1, UP)["number"] == 2


@pytest.mark.study
def test_a_killed_server_leaves_its_sessions_to_another(postgresql):
    store = postgresql.new()
    arguments = ("cliff-walking", "--records", store)
    with process(*arguments) as first, process(*arguments) as second:
        with Page(first.address) as page:
            token = page.next()["token"]
            page.begin(assistant="stochastic-q-bumpers", alpha=0.9)
            page.next("state")
            for number in range(3):
                page.act(number, UP)
            first.kill()
        with Page(second.address, token) as page:
            assert page.next("state")["number"] == 3
            page.act(3, UP)
        status, output = second.interrupt()
        assert status == 0
        assert "secret" not in output
        first.start()
        second.start()
    [found] = replay_file(store)
    assert (found.steps, found.difference) == (4, "")


@pytest.mark.study
def test_a_database_that_is_started_again_loses_nothing(cliff):
    with database() as server:
        store = server.new()
        with served(cliff, BUMPERS, store) as address:
            with Page(address) as page:
                token = page.next()["token"]
                page.begin()
                page.next("state")
                for number in range(3):
                    page.act(number, UP)
                server.stop(AT_ONCE)
                page.press(3, UP)
                code, reason = closing(page)
                assert code == connection.AGAIN
                assert "the database cannot be reached just now" in reason
            with Page(address, token) as page:
                assert closing(page) == (
                    connection.AGAIN, "the records cannot be reached just now"
                )  # fmt: skip
            server.start()
            with Page(address, token) as page:
                assert page.next("state")["number"] == 3
                assert page.act(3, UP)["number"] == 4
        [found] = replay_file(store)
        assert (found.steps, found.difference) == (4, "")
