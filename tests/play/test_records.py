"""Records: whole or not there, never changed, read back to the bit."""

import os
import shutil
import sqlite3
import stat
import threading
from importlib.util import find_spec
from pathlib import Path

import pytest
import sqlalchemy as sql
from sqlalchemy.exc import IntegrityError

from qbumpers.errors import RequestError
from qbumpers.play import upgrades
from qbumpers.play.game import Choice, Game, differing
from qbumpers.play.stores import reading
from qbumpers.play.tables import (
    EPISODES,
    NOTES,
    SESSIONS,
    STEPS,
    TENURES,
    Tenure,
    drives,
    open_records,
    read_session,
    secret_of,
    sessions_in,
    step_row,
    take_session,
)
from qbumpers.play.upgrades import SCHEMA
from qbumpers.play.writing import TakenOverError, UnreachableError, Writer
from tests.narrowing import present
from tests.play.postgresql import AT_ONCE, FAST, database
from tests.play.serving import AROUND, RIGHT, UP

DATA = Path(__file__).with_name("data")

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
def writing(store):
    writer = Writer(open_records(store))
    yield writer, store
    writer.close()


def column(store, statement):
    """The first column of what a statement finds in records."""
    engine = open_records(store, new=False)
    with engine.begin() as connection:
        found = list(connection.execute(sql.text(statement)).scalars())
    engine.dispose()
    return found


def step_rows(setup, count):
    game = Game(setup, 2**62)
    game.begin(Choice("maximal", {}))
    steps = [game.propose(k % setup.task.actions) for k in range(count)]
    rows = [(STEPS, {**step_row("s", k, 0, step), **TIMES}) for k, step in enumerate(steps)]
    return steps, rows


@pytest.mark.parametrize("name", ["cliff", "lander"])
def test_steps_are_read_as_they_were(writing, name, request):
    setup = request.getfixturevalue(name)
    writer, store = writing
    steps, rows = step_rows(setup, 11)
    for row in [session_row(setup, 2**62), episode_row(), *rows]:
        writer.add([row]).result(10)
    engine = open_records(store)
    found = read_session(engine, "s")
    assert found is not None
    assert (found.seed, found.setup) == (2**62, setup.description)
    assert found.played[0].choice == Choice("maximal", {})
    assert len(found.played[0].steps) == len(steps)
    assert all(differing(*pair) == "" for pair in zip(found.played[0].steps, steps, strict=True))
    assert sessions_in(engine) == ["s"]
    assert read_session(engine, "t") is None
    engine.dispose()


def test_a_step_is_there_once(writing, cliff):
    writer, store = writing
    _, [row] = step_rows(cliff, 1)
    writer.add([row]).result(10)
    with pytest.raises(IntegrityError, match=r"(?i)unique"):
        writer.add([note(), row]).result(10)
    writer.add([note("after")]).result(10)
    assert column(store, "select count(*) from steps") == [1]
    assert column(store, "select kind from notes") == ["after"]


def test_one_addition_that_fails_takes_no_other_with_it(writing, cliff):
    writer, _ = writing
    _, [row] = step_rows(cliff, 1)
    writer.add([row]).result(10)
    found = [writer.add([each]) for each in [note(), row, note(), row, note()]]
    assert [future.exception(10) is None for future in found] == [True, False, True, False, True]


def test_many_threads_add_at_once(writing):
    writer, store = writing

    def add():
        for _ in range(50):
            writer.add([note()], lasting=False).result(10)

    threads = [threading.Thread(target=add) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert column(store, "select count(*) from notes") == [200]


def test_what_waits_is_written_before_the_end(store):
    writer = Writer(open_records(store))
    found = [writer.add([note()], lasting=True) for _ in range(20)]
    writer.close()
    assert all(future.done() for future in found)
    assert column(store, "select count(*) from notes") == [20]


def test_what_lasts_is_flushed_first_and_nothing_else_waits_for_it(tmp_path, monkeypatch):
    synchronise, flushed, asked = os.fsync, threading.Event(), []

    def fsync(descriptor):
        asked.append(os.path.basename(os.readlink(f"/proc/self/fd/{descriptor}")))
        assert flushed.wait(10)
        synchronise(descriptor)

    writer = Writer(open_records(tmp_path / "play.sqlite"))
    monkeypatch.setattr("qbumpers.play.flushing.os.fsync", fsync)
    lasting = writer.add([note()], lasting=True)
    writer.add([note()]).result(10)
    assert not lasting.done()
    flushed.set()
    lasting.result(10)
    assert asked == ["play.sqlite-wal"]
    writer.close()


def test_a_disk_that_does_not_flush_is_said(tmp_path, monkeypatch):
    def fsync(_):
        raise OSError(5, "Input/output error")

    writer = Writer(open_records(tmp_path / "play.sqlite"))
    monkeypatch.setattr("qbumpers.play.flushing.os.fsync", fsync)
    with pytest.raises(OSError, match="Input/output error"):
        writer.add([note()], lasting=True).result(10)
    writer.add([note()]).result(10)
    writer.close()


def test_the_log_is_put_into_the_file_while_it_is_written(tmp_path):
    path = tmp_path / "play.sqlite"
    writer = Writer(open_records(path))
    (table, row) = note()
    large = (table, {**row, "content": "x" * 100_000})
    for _ in range(60):
        writer.add([large], lasting=True).result(10)
    assert path.stat().st_size > 3_000_000
    writer.close()


def test_only_who_took_a_session_last_adds_to_it(writing):
    writer, store = writing
    first = Tenure("s", 0)
    writer.add([(TENURES, first.row()), (TENURES, Tenure("t", 0).row())]).result(10)
    writer.add([note("mine")], first).result(10)
    engine = open_records(store)
    second = present(take_session(engine, "s"))
    assert second == Tenure("s", 1)
    assert [drives(engine, tenure) for tenure in (first, second)] == [False, True]
    others = [writer.add([note("other")], Tenure("t", 0)) for _ in range(2)]
    late = writer.add([note("late")], first)
    taken = writer.add([note("taken")], second)
    with pytest.raises(TakenOverError, match="goes on in another tab"):
        late.result(10)
    for future in [*others, taken]:
        future.result(10)
    assert sorted(column(store, "select kind from notes")) == ["mine", "other", "other", "taken"]
    assert take_session(engine, "absent") is None
    engine.dispose()


def test_of_two_who_take_a_session_at_once_one_has_it(store):
    """Each adds the number after the last one it saw, as servers add steps: none is there twice."""
    writer = Writer(open_records(store))
    writer.add([(TENURES, Tenure("s", 0).row())]).result(10)
    writer.close()
    added, problems = [], []

    def drive():
        try:
            for _ in range(10):
                engine = open_records(store)
                tenure = take_session(engine, "s")
                numbers = column(store, "select count(*) from notes")
                mine = Writer(engine)
                try:
                    for number in range(numbers[0], numbers[0] + 3):
                        mine.add([note(str(number))], tenure).result(10)
                        added.append(number)
                except TakenOverError:
                    pass
                mine.close()
        except Exception as error:
            problems.append(error)

    threads = [threading.Thread(target=drive) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert problems == []
    found = sorted(map(int, column(store, "select kind from notes")))
    assert found == sorted(added) == list(range(len(added)))


def test_whoever_reads_keeps_no_writer_out(writing):
    writer, store = writing
    writer.add([note()]).result(10)
    engine = open_records(store)
    with reading(engine) as connection:
        count = sql.select(sql.func.count()).select_from(NOTES)
        assert connection.execute(count).scalar_one() == 1
        writer.add([note()]).result(1)
        assert connection.execute(count).scalar_one() == 1  # as at its first look
    engine.dispose()


@pytest.mark.study
@pytest.mark.parametrize("how", [FAST, AT_ONCE])
def test_a_database_that_was_away_has_all_that_was_promised(how):
    with database() as server:
        store = server.new()
        writer = Writer(open_records(store))
        promised = 0
        for _ in range(2):
            for _ in range(20):
                writer.add([note()]).result(10)
                promised += 1
            server.stop(how)
            with pytest.raises(UnreachableError):
                writer.add([note("lost")]).result(20)
            server.start()
        writer.add([note()]).result(10)
        writer.close()
        assert column(store, "select count(*) from notes") == [promised + 1]
        assert column(store, "select count(*) from notes where kind = 'lost'") == [0]


def test_a_file_keeps_its_secret_and_nobody_else_can_read_it(tmp_path):
    secrets = {secret_of(open_records(tmp_path / name)) for name in ("a", "a", "b")}
    assert len(secrets) == 2
    assert all(len(secret) == 64 for secret in secrets)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o600


def test_records_of_the_first_version_are_brought_up_to_date(tmp_path, cliff):
    path = tmp_path / "play.sqlite"
    shutil.copy(DATA / "version-1.sqlite", path)
    engine = open_records(path)
    [session] = sessions_in(engine)
    found = read_session(engine, session)
    assert found is not None
    first, second = found.played
    assert [int(step.proposed) for step in first.steps] == AROUND
    assert sum(step.reward for step in first.steps) == 87
    assert [int(step.proposed) for step in second.steps] == [UP, RIGHT, RIGHT, 2, RIGHT]
    assert [step.overridden for step in second.steps] == [False, False, False, True, False]
    assert take_session(engine, session) == Tenure(session, 1)
    with sqlite3.connect(DATA / "version-1.sqlite") as raw:
        assert raw.execute("select schema, secret from about").fetchall() == [
            (1, secret_of(engine))
        ]
    raw.close()
    engine.dispose()
    assert column(path, "select schema from about") == [SCHEMA]


def test_records_that_were_brought_up_to_date_have_the_tables_of_new_ones(tmp_path):
    shutil.copy(DATA / "version-1.sqlite", tmp_path / "old")

    def tables(name):
        inspector = sql.inspect(open_records(tmp_path / name))
        return {
            table: (
                [{**each, "type": str(each["type"])} for each in inspector.get_columns(table)],
                inspector.get_pk_constraint(table)["constrained_columns"],
            )
            for table in inspector.get_table_names()
        }

    assert tables("old") == tables("new")


def test_an_upgrade_that_fails_leaves_the_records_as_they_were(tmp_path, monkeypatch):
    path = tmp_path / "old"
    shutil.copy(DATA / "version-1.sqlite", path)
    broken = {1: (*upgrades.UPGRADES[1], "INSERT INTO absent VALUES (1)")}
    monkeypatch.setattr(upgrades, "UPGRADES", broken)
    with pytest.raises(RequestError, match="no such table: absent"):
        open_records(path)
    with sqlite3.connect(path) as raw:
        assert raw.execute("select schema from about").fetchall() == [(1,)]
        names = raw.execute("select name from sqlite_master where type = 'table'").fetchall()
        assert ("tenures",) not in names
    raw.close()


def test_records_of_a_newer_version_or_of_something_else_are_refused(tmp_path, store):
    open_records(store).dispose()
    assert column(store, "update about set schema = 99 returning schema") == [99]
    with pytest.raises(RequestError, match="tables are of version 99, newer than 2, the newest"):
        open_records(store)
    (tmp_path / "text.sqlite").write_text("no database " * 200)
    with pytest.raises(RequestError, match=r"text\.sqlite: file is not a database"):
        open_records(tmp_path / "text.sqlite")
    with sqlite3.connect(tmp_path / "diary") as raw:
        raw.execute("create table notes (day text)")
    raw.close()
    with pytest.raises(RequestError, match="diary: it has a table notes that is not qbumpers'"):
        open_records(tmp_path / "diary")


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ("mysql://root@localhost/x", "records of mysql://: a file, or postgresql://USER@HOST/DATA"),
        pytest.param(
            "postgresql://a:secret@127.0.0.1:1/x",
            r"a:\*\*\*@127\.0\.0\.1:1/x: .*[Cc]onnection",
            marks=pytest.mark.skipif(not find_spec("psycopg"), reason="psycopg is missing"),
        ),
        ("postgresql://a:secret@127.0.0.1:port/x", "not a URL"),
        ("absent.sqlite", "records file absent.sqlite: there is none"),
    ],
)
def test_records_that_are_not_there_are_refused_in_one_line(records, message):
    with pytest.raises(RequestError, match=message) as refused:
        open_records(records, new=False)
    assert "\n" not in str(refused.value)
    assert "secret" not in str(refused.value)
