"""Everything that someone without a page can do to a server, while others play on it.

`python -m tests.play.hostile [--seconds N] [--half-open N]` says what it comes to.
"""

import argparse
import asyncio
import contextlib
import json
import os
import random
import resource
import secrets
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from itsdangerous import URLSafeSerializer
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Origin

from qbumpers.play.replaying import replay_file
from tests.play.nonsense import frames, nonsense, requests
from tests.play.serving import AROUND, process

KEYS_PER_SECOND = 10
EXPECTED = {"welcome", "state", "problem", "closing", "countdown", "running", "paused"}
GONE = (OSError, WebSocketException, asyncio.IncompleteReadError, TimeoutError)


class Found(NamedTuple):
    """What became of a server under attack.

    Attributes:
        late: seconds from each key of honest players to its answer.
        acknowledged: by session, how many steps a page was shown, of honest players.
        fuzzed: the same of those who also sent nonsense.
        attacks: how many of each kind.
        most_files: open at once in the server.
        output: of the server, of errors.
        records: the file.
    """

    late: list[float]
    acknowledged: dict[str, int]
    fuzzed: dict[str, int]
    attacks: dict[str, int]
    most_files: int
    output: str
    records: Path


def attacked(folder, seconds, half_open, seed=0):
    """A server in a process, attacked for so long, with so many half-open connections of a kind."""
    folder = Path(folder)
    allow_files()
    with (folder / "errors").open("w+") as errors:
        arguments = ["cliff-walking", "--assistant", "none", "--out", str(folder)]
        with process(*arguments, errors=errors) as server:
            attack = _Attack(server, seconds, half_open, seed)
            asyncio.run(attack.run())
            status, printed = server.interrupt()
        errors.seek(0)
        assert (status, "Stopped" in printed) == (0, True), (status, printed, errors.read())
        return Found(**attack.found, output=errors.read(), records=folder / "play.sqlite")


def check_records(found):
    """Every step that a page was shown is in the record, and the record replays."""
    steps = {each.session: each for each in replay_file(found.records)}
    assert {each.difference for each in steps.values()} == {""}
    for session, acknowledged in found.acknowledged.items():
        assert steps[session].steps == acknowledged
    for session, acknowledged in found.fuzzed.items():
        assert steps[session].steps >= acknowledged


def allow_files():
    """As many open files as the system lets this process have."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


class _Attack:
    def __init__(self, server, seconds, half_open, seed):
        self.address, self.pid = server.address, server.pid
        self.host, port = server.address.split(":")
        self.port = int(port)
        self.half_open, self.chance = half_open, random.Random(seed)
        self.until = time.monotonic() + seconds
        self.found = {
            "late": [], "acknowledged": {}, "fuzzed": {}, "attacks": {}, "most_files": 0,
        }  # fmt: skip

    @property
    def going(self):
        return time.monotonic() < self.until

    async def run(self):
        await asyncio.gather(
            *(self.honest() for _ in range(3)),
            *(self.fuzz() for _ in range(2)),
            self.wrong_tokens(),
            self.wrong_frames(),
            self.wrong_requests(),
            self.half_opened("nothing sent", b""),
            self.half_opened("slow request", b"GET / HTTP/1.1\r\n", slow=True),
            self.half_opened("no greeting", self.handshake()),
            self.half_opened("takes nothing", self.handshake(), greets=True),
            self.watch(),
        )

    def count(self, kind):
        self.found["attacks"][kind] = self.found["attacks"].get(kind, 0) + 1

    async def watch(self):
        """How many files the server has open."""
        while self.going:
            with contextlib.suppress(OSError):
                files = len(os.listdir(f"/proc/{self.pid}/fd"))
                self.found["most_files"] = max(self.found["most_files"], files)
            await asyncio.sleep(0.2)

    def joined(self):
        return connect(f"ws://{self.address}/socket", origin=Origin(f"http://{self.address}"))

    async def honest(self):
        """Around the cliff, key by key; nothing may get lost or wait for long."""
        async with self.joined() as socket:
            await socket.send('{"type": "hello"}')
            token = json.loads(await socket.recv())["token"]
            number = episode = 0
            while self.going:
                begin = {"type": "begin", "episode": episode, "assistant": "none"}
                await socket.send(json.dumps(begin))
                assert json.loads(await socket.recv())["number"] == number
                for action in AROUND:
                    sent = time.monotonic()
                    act = {"type": "act", "number": number, "action": action}
                    times = {"device": "keyboard", "pressed": 1.0, "shown": 0.0}
                    await socket.send(json.dumps({**act, **times}))
                    number += 1
                    assert json.loads(await socket.recv())["number"] == number
                    self.found["late"].append(time.monotonic() - sent)
                    await asyncio.sleep(1 / KEYS_PER_SECOND)
                episode += 1
        self.found["acknowledged"][session_of(token)] = number

    async def fuzz(self):
        """Sessions that send nonsense among what is right."""
        while self.going:
            with contextlib.suppress(*GONE):
                async with self.joined() as socket:
                    await socket.send('{"type": "hello"}')
                    answer = json.loads(await socket.recv())
                    if answer["type"] == "closing":  # others have taken every place
                        await asyncio.sleep(0.2)
                        continue
                    session = session_of(answer["token"])
                    hearing = asyncio.create_task(self.hear(socket, session))
                    sent = []
                    for _ in range(self.chance.randrange(300)):
                        if not self.going:
                            break
                        sent.append(nonsense(self.chance, sent))
                        self.count("wrong messages")
                        with contextlib.suppress(UnicodeEncodeError):
                            await socket.send(sent[-1])
                        await asyncio.sleep(0.005)
                    hearing.cancel()

    async def hear(self, socket, session):
        with contextlib.suppress(*GONE):
            async for text in socket:
                message = json.loads(text)
                assert message["type"] in EXPECTED, text
                assert "Traceback" not in text
                if message["type"] == "state":
                    known = self.found["fuzzed"].get(session, 0)
                    assert message["number"] >= known
                    self.found["fuzzed"][session] = message["number"]

    async def wrong_tokens(self):
        while self.going:
            token = self.chance.choice([
                secrets.token_urlsafe(30), ".", '"a".b', "a" * 200, f'"{secrets.token_hex(8)}".x',
            ])  # fmt: skip
            with contextlib.suppress(*GONE):
                async with self.joined() as socket:
                    await socket.send(json.dumps({"type": "hello", "token": token}))
                    assert json.loads(await socket.recv())["type"] == "closing"
                    self.count("wrong tokens")
            await asyncio.sleep(0.02)

    def handshake(self):
        return (
            f"GET /socket HTTP/1.1\r\nHost: {self.address}\r\nOrigin: http://{self.address}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        ).encode()

    async def wrong_frames(self):
        while self.going:
            await self.raw("wrong frames", self.handshake(), frames(self.chance))

    async def wrong_requests(self):
        while self.going:
            await self.raw("wrong requests", requests(self.chance, self.address))

    async def raw(self, kind, *parts):
        with contextlib.suppress(*GONE):
            reader, writer = await asyncio.open_connection(self.host, self.port)
            with contextlib.closing(writer):
                for part in parts:
                    writer.write(part)
                    await asyncio.wait_for(writer.drain(), 1)
                    await asyncio.sleep(0.01)
                self.count(kind)
                if self.chance.random() < 0.5:
                    await asyncio.wait_for(reader.read(1000), 0.2)
                if self.chance.random() < 0.5:
                    writer.transport.abort()

    async def half_opened(self, kind, first, *, slow=False, greets=False):
        """So many connections that stop in the middle, opened as fast as may be and left."""
        writers = []
        while self.going and len(writers) < self.half_open:
            with contextlib.suppress(*GONE):
                # With this limit, what comes is left where it is after some bytes.
                _, writer = await asyncio.open_connection(self.host, self.port, limit=1)
                writers.append(writer)
                writer.write(first)
                if greets:
                    await asyncio.sleep(0.05)
                    writer.write(masked(b'{"type": "hello"}'))
                self.count(kind)
            await asyncio.sleep(0.002)
        while self.going:
            if slow:
                for writer in writers:
                    if not writer.is_closing():
                        writer.write(b"a")
            await asyncio.sleep(0.5)
        for writer in writers:
            writer.transport.abort()


def masked(text):
    """A text in a frame, whose mask is zero."""
    return bytes([0x81, 0x80 | len(text)]) + bytes(4) + text


def session_of(token):
    """The session that a token is of, as is written in it."""
    return URLSafeSerializer("any").loads_unsafe(token)[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--half-open", type=int, default=3000)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = attacked(folder, given.seconds, given.half_open)
        check_records(found)
        middle, high = 1000 * np.percentile(found.late, [50, 99])
        print(f"load of the machine at the end: {os.getloadavg()[0]:.1f}")
        for kind, count in sorted(found.attacks.items()):
            print(f"{kind:<16}{count:>8}")
        print(f"keys of three honest players: {len(found.late)}")
        print(f"until answered: median {middle:.1f} ms, 99th percentile {high:.1f} ms")
        print(f"longest: {1000 * max(found.late):.0f} ms")
        print(f"files open in the server at once, at most: {found.most_files}")
        print(f"tracebacks in its output: {found.output.count('Traceback')}")


if __name__ == "__main__":
    main()
