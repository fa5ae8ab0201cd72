"""Play for long while everything fails: `python -m tests.play.soak --minutes 30`.

Pages play over real sockets, three servers share the records, connections are dropped in several
ways, servers are killed by SIGKILL, and a PostgreSQL server is stopped, or crashes, and is started
again. Every page has its own log of what it pressed and what it was shown. In the end the records
are held to these logs: nothing that was shown may be lost, no press may be recorded twice, and rule
and task must come to the same again.
"""

import argparse
import asyncio
import collections
import contextlib
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException
from websockets.typing import Origin

from qbumpers.play.connection import AGAIN, TAKEN_OVER
from qbumpers.play.replaying import replay_session
from qbumpers.play.tables import open_records, read_moments, read_session, sessions_in
from tests.narrowing import present
from tests.play.postgresql import AT_ONCE, FAST, database
from tests.play.serving import Process

STORES = ("sqlite", "postgresql")
KILLS, RESTARTS = 10, 4
TASKS = ("cliff-walking", "cliff-walking", "lunar-lander")  # of the servers
PAGES = {"cliff-walking": 6, "lunar-lander": 2}
CHOICE = {"assistant": "stochastic-q-bumpers", "options": {"alpha": 0.5}}


class Page:
    """A participant's page, which loses its connection again and again.

    Attributes:
        token: of its session.
        sent: the action of each press, by step and by the time of the press, which is unique.
        seen: what it was shown of each step, by its number.
        problems: what went wrong, in words.
    """

    def __init__(self, servers, seed):
        self._servers, self._chance = servers, np.random.default_rng(seed)
        self.token = ""
        self.sent = collections.defaultdict(dict)
        self.seen = {}
        self.problems = []
        self.connections = 0
        self._presses = 0
        self._abandoned = []

    async def play(self, until):
        while time.monotonic() < until:
            with contextlib.suppress(OSError, WebSocketException, TimeoutError):
                await self._connected(until)
            await asyncio.sleep(0.2)
        for socket in self._abandoned:
            await socket.close()

    async def _connected(self, until):
        address = self._servers[self._chance.integers(len(self._servers))].address
        socket = await connect(
            f"ws://{address}/socket", origin=Origin(f"http://{address}"), open_timeout=5
        )
        self.connections += 1
        await send(socket, "hello", token=self.token)
        lasts = min(until, time.monotonic() + self._chance.uniform(2, 10))
        try:
            while time.monotonic() < lasts:
                async with asyncio.timeout(30):
                    message = json.loads(await socket.recv())
                await self._take(socket, message)
        finally:
            await self._drop(socket)

    async def _drop(self, socket):
        """End a connection: by a close, by a cut, or not at all, until another page takes over."""
        how = self._chance.integers(3)
        if how == 0:
            await socket.close()
        elif how == 1:
            socket.transport.abort()
        else:
            self._abandoned.append(socket)

    async def _take(self, socket, message):
        match message["type"]:
            case "welcome":
                self.token = message["token"]
                self._real_time = message["task"]["rate"] > 0
                self._actions = len(message["task"]["actions"])
                if not message["history"]:
                    await send(socket, "begin", episode=0, **CHOICE)
            case "state":
                self._log(message)
                await self._answer(socket, message)
            case "paused":
                await send(socket, "continue")
            case "problem":
                self.problems.append(message["message"])
            case "closing" if message["code"] not in (AGAIN, TAKEN_OVER):
                self.problems.append(f"{message['code']}: {message['reason']}")

    def _log(self, state):
        number, last = state["number"], state["last"]
        latest = max(self.seen, default=-1)
        if number <= latest:
            self.problems.append(f"step {latest} was shown, and later a state before it, {number}")
        if last is not None:
            shown = (last["proposed"], last["executed"], last["overridden"], last["reward"])
            if self.seen.setdefault(number - 1, shown) != shown:
                self.problems.append(f"step {number - 1} was shown in two ways")

    async def _answer(self, socket, state):
        number, episode = state["number"], state["episode"]
        if episode["over"]:
            following, assisted = episode["episode"] + 1, bool(self._chance.integers(2))
            await send(socket, "begin", episode=following, assisted=assisted, **CHOICE)
        elif not self._real_time:
            await asyncio.sleep(0.1 * self._chance.random())
            await self._press(socket, "act", number, number=number, shown=0.0)
        elif number % 10 == 0:
            await self._press(socket, "hold", number, sequence=number)

    async def _press(self, socket, kind, step, /, **fields):
        self._presses += 1
        pressed = float(self._presses)
        action = int(self._chance.integers(self._actions))
        if kind == "act":
            self.sent[step][pressed] = action
        await send(socket, kind, action=action, device="keyboard", pressed=pressed, **fields)


async def send(socket, kind, **fields):
    await socket.send(json.dumps({"type": kind, **fields}))


async def trouble(servers, server, until):
    """Kill servers, and stop the database, evenly over the time; how often each happened."""
    events = ["kill"] * KILLS + ["restart"] * (RESTARTS if server else 0)
    np.random.default_rng(0).shuffle(events)
    begun, counts = time.monotonic(), collections.Counter()
    for place, event in enumerate(events):
        due = begun + (until - begun) * (place + 0.5) / len(events)
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        number = counts[event]
        if event == "kill":
            chosen = servers[number % len(servers)]
            await asyncio.to_thread(chosen.kill)
            await asyncio.to_thread(chosen.start)
        else:
            await asyncio.to_thread(server.stop, AT_ONCE if number % 2 else FAST)
            await asyncio.sleep(1)
            await asyncio.to_thread(server.start)
        counts[event] += 1
        say(f"{event} {counts[event]}")
    return counts


def say(text):
    print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)


def differences(store, pages):
    """How many steps are recorded, and everything in which the records differ from the logs."""
    engine = open_records(store, new=False)
    found, steps = [problem for page in pages for problem in page.problems], 0
    by_token = {page.token.partition(".")[0]: page for page in pages}
    for session in sessions_in(engine):
        recorded = present(read_session(engine, session))
        replayed = replay_session(recorded)
        if replayed.difference:
            found.append(f"{session}: {replayed.difference}")
        steps += len(recorded.steps)
        page = by_token.pop(_payload(session), None)
        if page is not None:
            times = read_moments(engine, session)
            found += [f"{session}: {text}" for text in held(page, recorded.steps, times)]
        elif recorded.steps:
            found.append(f"{session}: no page played it")
    found += [f"a page's session is not there: {token}" for token in by_token]
    engine.dispose()
    return steps, found


def _payload(session):
    """How a session begins its token, see itsdangerous."""
    from itsdangerous import URLSafeSerializer

    return URLSafeSerializer("", salt="session").dumps(session).partition(".")[0]


def held(page, steps, times):
    """In what recorded steps differ from the log of their page."""
    for number, shown in page.seen.items():
        if number >= len(steps):
            yield f"step {number} was shown, and is lost"
            continue
        step = steps[number]
        there = (int(step.proposed), int(step.executed), bool(step.overridden), float(step.reward))
        if there != shown:
            yield f"step {number} was shown as {shown}, and is recorded as {there}"
    if not page.sent:
        return
    presses = [each.pressed for each in times]
    for pressed, count in collections.Counter(presses).items():
        if count > 1:
            yield f"press {pressed} is recorded {count} times"
    for number, (step, pressed) in enumerate(zip(steps, presses, strict=True)):
        if page.sent[number].get(pressed) != step.proposed:
            yield f"step {number}: press {pressed} was not sent for it"


async def played(servers, server, minutes):
    until = time.monotonic() + 60 * minutes
    pages = [
        Page([s for s, task in zip(servers, TASKS, strict=True) if task == name], [k, len(name)])
        for name, count in PAGES.items()
        for k in range(count)
    ]
    causing = asyncio.create_task(trouble(servers, server, until))
    await asyncio.gather(*(page.play(until) for page in pages))
    return pages, await causing


def soak(kind, minutes):
    """Play on a store; a line that says how it went, and what went wrong."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        server = stack.enter_context(database()) if kind == "postgresql" else None
        store = server.new() if server else str(folder / "play.sqlite")
        place = ("--records", store) if server else ("--out", str(folder))
        servers = []
        for task in TASKS:
            servers.append(Process(task, "--assistant", "none", *place))
            stack.callback(servers[-1].kill)
        pages, counts = asyncio.run(played(servers, server, minutes))
        steps, found = differences(store, pages)
    connections = sum(page.connections for page in pages)
    shown = sum(len(page.seen) for page in pages)
    line = (
        f"{kind}: {minutes:g} minutes, {len(pages)} pages, {connections} connections, "
        f"{counts['kill']} kills, {counts['restart']} restarts of the database; "
        f"{steps} steps recorded, {shown} shown, {len(found)} lost, doubled or different"
    )
    return line, found


def main():
    parser = argparse.ArgumentParser(description="Play for long while everything fails.")
    parser.add_argument("--minutes", type=float, default=30, help="in all, shared by the stores")
    parser.add_argument("--store", choices=STORES, action="append", help="both if left out")
    given = parser.parse_args()
    stores = given.store or STORES
    wrong = []
    for kind in stores:
        try:
            line, found = soak(kind, given.minutes / len(stores))
        except pytest.skip.Exception as skipped:
            say(f"{kind} is left out: {skipped.msg}")
            continue
        say(line)
        for text in found[:20]:
            say(f"  {text}")
        wrong += found
    say("FAILED" if wrong else "not one step is lost or doubled")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
