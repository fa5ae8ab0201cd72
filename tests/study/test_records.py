"""Records: whole or not there, never changed, read back to the bit."""

import sqlite3
import stat
import threading

import pytest
from sqlalchemy.exc import IntegrityError

from qbumpers.errors import RequestError
from qbumpers.study.game import Choice, Game, differing
from qbumpers.study.tables import (
    EPISODES,
    NOTES,
    SESSIONS,
    STEPS,
    open_records,
    read_session,
    secret_of,
    sessions_in,
    step_row,
)
from qbumpers.study.writing import Writer

TIMES = {"device": "touch", "shown": 1.0, "pressed": None, "received": 2.0, "applied": 3.0}


def note(kind="focus"):
    return (NOTES, {"session": "s", "time": 1.0, "kind": kind, "content": "{}"})


def session_row(setup, seed):
    return (
        SESSIONS,
        {"session": "s", "began": 1.0, "seed": str(seed), "setup": setup.described(),
         "version": "0"},
    )  # fmt: skip


def episode_row(number=0):
    return (
        EPISODES,
        {"session": "s", "episode": number, "began": 1.0, "assistant": "maximal",
         "options": "{}", "assisted": True},
    )  # fmt: skip


@pytest.fixture
def writing(tmp_path):
    path = tmp_path / "folder" / "play.sqlite"
    writer = Writer(open_records(path))
    yield writer, path
    writer.close()


def step_rows(setup, count):
    game = Game(setup, 2**62)
    game.begin(Choice("maximal", {}))
    steps = [game.propose(k % setup.task.actions) for k in range(count)]
    rows = [(STEPS, {**step_row("s", k, 0, step), **TIMES}) for k, step in enumerate(steps)]
    return steps, rows


@pytest.mark.parametrize("name", ["cliff", "lander"])
def test_steps_are_read_as_they_were(writing, name, request):
    setup = request.getfixturevalue(name)
    writer, path = writing
    steps, rows = step_rows(setup, 11)
    for row in [session_row(setup, 2**62), episode_row(), *rows]:
        writer.add([row]).result(10)
    found = read_session(open_records(path), "s")
    assert found is not None
    assert (found.seed, found.setup) == (2**62, setup.description)
    assert found.played[0].choice == Choice("maximal", {})
    assert len(found.played[0].steps) == len(steps)
    assert all(differing(*pair) == "" for pair in zip(found.played[0].steps, steps, strict=True))
    assert sessions_in(open_records(path)) == ["s"]
    assert read_session(open_records(path), "t") is None


def test_a_step_is_there_once(writing, cliff):
    writer, path = writing
    _, [row] = step_rows(cliff, 1)
    writer.add([row]).result(10)
    with pytest.raises(IntegrityError, match="UNIQUE"):
        writer.add([note(), row]).result(10)
    writer.add([note("after")]).result(10)
    with sqlite3.connect(path) as raw:
        assert raw.execute("select count(*) from steps").fetchone() == (1,)
        assert raw.execute("select kind from notes").fetchall() == [("after",)]
    raw.close()


def test_one_addition_that_fails_takes_no_other_with_it(writing, cliff):
    writer, _ = writing
    _, [row] = step_rows(cliff, 1)
    writer.add([row]).result(10)
    found = [writer.add([each]) for each in [note(), row, note(), row, note()]]
    assert [future.exception(10) is None for future in found] == [True, False, True, False, True]


def test_many_threads_add_at_once(writing):
    writer, path = writing

    def add():
        for _ in range(50):
            writer.add([note()], lasting=False).result(10)

    threads = [threading.Thread(target=add) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with sqlite3.connect(path) as raw:
        assert raw.execute("select count(*) from notes").fetchone() == (200,)
    raw.close()


def test_what_waits_is_written_before_the_end(tmp_path):
    path = tmp_path / "play.sqlite"
    writer = Writer(open_records(path))
    found = [writer.add([note()], lasting=True) for _ in range(20)]
    writer.close()
    assert all(future.done() for future in found)
    raw = sqlite3.connect(path)
    assert raw.execute("select count(*) from notes").fetchone() == (20,)
    raw.close()


def test_a_file_keeps_its_secret_and_nobody_else_can_read_it(tmp_path):
    secrets = {secret_of(open_records(tmp_path / name)) for name in ("a", "a", "b")}
    assert len(secrets) == 2
    assert all(len(secret) == 64 for secret in secrets)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o600


def test_a_file_of_other_tables_is_refused(tmp_path):
    path = tmp_path / "play.sqlite"
    open_records(path).dispose()
    with sqlite3.connect(path) as raw:
        raw.execute("update about set schema = 99")
    raw.close()
    with pytest.raises(RequestError, match=r"play\.sqlite: its tables are of version 99, these"):
        open_records(path)
    (tmp_path / "text.sqlite").write_text("no database " * 200)
    with pytest.raises(RequestError, match=r"text\.sqlite: file is not a database"):
        open_records(tmp_path / "text.sqlite")
