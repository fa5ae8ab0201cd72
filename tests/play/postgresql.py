"""A PostgreSQL server of the tests' own, with its own user, folder and port."""

import contextlib
import itertools
import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

FAST, AT_ONCE = 2, 3
"""Ways to stop: SIGINT ends connections and flushes; SIGQUIT drops everything, as a crash does."""

_USERS = ("postgres", "nobody")  # it refuses to run as root


def programs():
    """The folder of Debian's programs, the newest version's; None if there are none."""
    found = sorted(
        Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda p: float(p.parts[4])
    )
    on_path = shutil.which("initdb")
    return found[-1].parent if found else Path(on_path).parent if on_path else None


class Database:
    """A server that can be stopped and started again, at a port that stays."""

    def __init__(self, programs):
        self._programs = programs
        self._folder = Path(tempfile.mkdtemp(prefix="qbumpers-postgresql-"))
        self._user = None
        if os.geteuid() == 0:
            self._user = next(user for user in _USERS if _is_there(user))
            shutil.chown(self._folder, self._user)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self._address = f"postgresql://tester:secret@127.0.0.1:{self._port}/"
        self._databases = itertools.count()
        self._run(
            "initdb", "-D", self._data, "-U", "tester", "-A", "trust", "--no-sync", "-E", "UTF8"
        )
        self.start()

    @property
    def _data(self):
        return str(self._folder / "data")

    def _run(self, program, *arguments):
        found = subprocess.run(
            [self._programs / program, *arguments], user=self._user, cwd=self._folder,
            capture_output=True, text=True,
        )  # fmt: skip
        assert found.returncode == 0, found.stderr

    def new(self):
        """The URL of a new database in it, as `--records` takes it."""
        name = f"records{next(self._databases)}"
        address = ["-h", "127.0.0.1", "-p", str(self._port), "-U", "tester"]
        self._run("createdb", *address, name)
        return self._address + name

    def start(self):
        self._server = subprocess.Popen(
            [self._programs / "postgres", "-D", self._data, "-p", str(self._port),
             "-k", str(self._folder), "-c", "listen_addresses=127.0.0.1"],
            user=self._user, cwd=self._folder,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        ready = [self._programs / "pg_isready", "-q", "-h", "127.0.0.1", "-p", str(self._port)]
        for _ in range(300):
            if subprocess.run(ready).returncode == 0:
                return
            time.sleep(0.1)
        raise AssertionError("PostgreSQL does not start")

    def stop(self, how=FAST):
        self._server.send_signal(how)
        self._server.wait(30)

    def close(self):
        with contextlib.suppress(OSError):
            self.stop(AT_ONCE)
        shutil.rmtree(self._folder)


def _is_there(user):
    try:
        pwd.getpwnam(user)
    except KeyError:
        return False
    return True


@contextlib.contextmanager
def database():
    """A server; the test is skipped, and says so, if PostgreSQL is not installed."""
    found = programs()
    if found is None:
        pytest.skip("PostgreSQL is not installed: .ci/install_postgresql")
    pytest.importorskip("psycopg", reason="psycopg is missing: pip install 'qbumpers[study]'")
    running = Database(found)
    try:
        yield running
    finally:
        running.close()
