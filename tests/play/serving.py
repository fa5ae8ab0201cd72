"""Servers and pages for tests: in a thread of this process, or in a process that can be killed."""

import contextlib
import json
import os
import re
import subprocess
import sys
import threading

from websockets.sync.client import connect
from websockets.typing import Origin

from tests.narrowing import present

ADDRESS = re.compile(r"https?://([\w.]+:\d+)/")


@contextlib.contextmanager
def running(make):
    """The address of a server in a thread; `make` is called with it."""
    import uvicorn

    from qbumpers.play.addresses import listening_at
    from qbumpers.play.running import configuration

    with contextlib.closing(listening_at(0)) as listening:
        address = f"127.0.0.1:{listening.getsockname()[1]}"
        server = uvicorn.Server(configuration(make(address)))
        thread = threading.Thread(target=server.run, args=[[listening]])
        thread.start()
        try:
            yield address
        finally:
            server.should_exit = True
            thread.join(10)
            assert not thread.is_alive()


def served(setup, choice, path, second=0.01, also=()):
    """The address of a server that is played on; pages may address it by others `also`."""
    from qbumpers.play.server import Sessions, make_application
    from qbumpers.play.tables import open_records

    return running(
        lambda address: make_application(
            Sessions(setup, choice, open_records(path), second), [address, *also]
        )
    )


def replayed(path):
    """The address, with a path, of a server that shows what is recorded."""
    from qbumpers.play.replaying import replay_file
    from qbumpers.play.showing import Showing, make_showing
    from qbumpers.play.tables import open_records

    showing = Showing(open_records(path, new=False), list(replay_file(path)))
    return running(lambda address: make_showing(showing, [address], "secret"))


class Process:
    """`qbumpers play` in a process of its own, at a port that stays when it is started again."""

    def __init__(self, *arguments, port=0, errors=None):
        self._arguments, self._port, self._errors = arguments, port, errors
        self.start()

    @property
    def pid(self):
        return self._process.pid

    def start(self):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "qbumpers", "play", *self._arguments, "--no-browser", "--port",
             str(self._port)],
            stdout=subprocess.PIPE, stderr=self._errors, text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        found = ADDRESS.search(present(self._process.stdout).readline())
        assert found, "it does not say where it serves"
        self.url, self.address = found[0], found[1]
        self._port = self._port or int(self.address.rpartition(":")[2])

    def kill(self):
        """SIGKILL: nothing can be written any more."""
        self._process.kill()
        self._end()

    def interrupt(self):
        """Ctrl-C; the exit status and what was printed last."""
        self._process.send_signal(2)
        output = present(self._process.stdout).read()
        self._end()
        return self._process.returncode, output

    def _end(self):
        self._process.wait(15)
        present(self._process.stdout).close()


@contextlib.contextmanager
def process(*arguments, port=0, errors=None):
    playing = Process(*arguments, port=port, errors=errors)
    try:
        yield playing
    finally:
        playing.kill()


class Page:
    """What a browser's page is to the server, without a browser."""

    def __init__(self, address, token="", hello=None):
        self._connecting = connect(f"ws://{address}/socket", origin=Origin(f"http://{address}"))
        self._hello = {"token": token, **(hello or {})}

    def __enter__(self):
        self.socket = self._connecting.__enter__()
        self.send(type="hello", **self._hello)
        return self

    def __exit__(self, *error):
        self._connecting.__exit__(*error)

    def send(self, **message):
        self.socket.send(json.dumps(message))

    def next(self, kind=None, timeout=10.0):
        """The next message, or the next of a kind."""
        while True:
            message = json.loads(self.socket.recv(timeout=timeout))
            if kind in (None, message["type"]):
                return message

    def begin(self, episode=0, assisted=True, assistant="none", **options):
        self.send(
            type="begin", episode=episode, assistant=assistant, options=options, assisted=assisted
        )

    def act(self, number, action):
        """Press a key; what it comes to."""
        self.press(number, action)
        return self.next("state")

    def press(self, number, action):
        self.send(
            type="act", number=number, action=action, device="keyboard", pressed=2.5, shown=1.5
        )


UP, RIGHT, DOWN, LEFT = range(4)
AROUND = [UP, *[RIGHT] * 11, DOWN]
"""The shortest way around the cliff: 13 steps of -1 each, and 100 at the goal."""
