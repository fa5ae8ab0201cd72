"""How late steps are with many sessions on one server: `python benchmarks/play.py [--quick]`.

A server in a process of its own, on one core; this process is every page at once, on another core.
Every step is committed to the record before it is shown.

- A task that waits for keys is played at five keys per second: a step is as late as its answer
  takes.
- A task in real time goes by its own clock, at 50 Hz here: a step is late by what it takes longer
  than a tick after the one before. A key also waits for the next tick, up to 20 ms: the time from
  a key to the state that it led to is in the columns `key`.

What the machine itself adds, with other work going on, is in the column `timer`: how late a bare
timer of the same rate is on the server's core, 99%, just before.
"""

import argparse
import asyncio
import contextlib
import functools
import itertools
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from websockets.asyncio.client import connect
from websockets.typing import Origin

CORES = os.sched_getaffinity(0)
BUMPERS = {"assistant": "stochastic-q-bumpers", "options": {"alpha": 0.1}}
KEYS = {"cliff-walking": (5, [0, *[1] * 11, 2])}
"""Of tasks that wait for them: how many per second, and which, again and again in an episode."""

RATE = 50  # of tasks in real time, per second

TASKS = {
    "cliff-walking": (10, 100, 190),
    "CartPole-v1": (10, 25, 50),
    "lunar-lander": (1, 10, 25, 40),
}
APART = (5**0.5 - 1) / 2  # seconds between two pages, so that no two of them press together
WARM = 2.0  # seconds that are left out


class Times(NamedTuple):
    """Seconds of single steps.

    Attributes:
        late: of every step.
        keys: from a key to the state that it led to.
    """

    late: list[float]
    keys: list[float]


class Episode(msgspec.Struct, frozen=True):
    """What this needs of an episode."""

    over: bool


class Last(msgspec.Struct, frozen=True):
    """What this needs of a step."""

    proposed: int


class State(msgspec.Struct):
    """What this needs of a message."""

    type: str
    number: int = 0
    episode: Episode = Episode(False)
    last: Last | None = None


heard = msgspec.json.Decoder(State).decode


def main() -> None:
    parser = argparse.ArgumentParser(description="How late steps are with many sessions.")
    parser.add_argument("--serve", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--quick", action="store_true", help="few sessions, three seconds")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--task", choices=TASKS, action="append")
    parser.add_argument("--sessions", type=int, action="append")
    given = parser.parse_args()
    if given.serve:
        serve(*given.serve)
        return
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print("                         steps    step, ms       key, ms  timer  server  us per  MB per")
    print("task           sessions  per s   50%    99%    50%   99%    99%    busy    step session")
    for task in given.task or TASKS:
        counts = given.sessions or (TASKS[task][:2] if given.quick else TASKS[task])
        for sessions in counts:
            show(task, sessions, 3 if given.quick else given.seconds)


def serve(task: str, records: str) -> None:
    """A server without countdowns, until it is terminated."""
    from qbumpers.play.addresses import listening_at
    from qbumpers.play.game import Choice
    from qbumpers.play.running import serve_until_stopped
    from qbumpers.play.server import Sessions, make_application
    from qbumpers.play.setup import Setup
    from qbumpers.play.tables import open_records

    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    listening = listening_at(0)
    address = f"127.0.0.1:{listening.getsockname()[1]}"
    choice = Choice(BUMPERS["assistant"], BUMPERS["options"])
    if task == "CartPole-v1":
        values = Path(records).with_name("values.npz")
        balancing().save(values)
        setup = Setup(task, values, discount=0.99)
    else:
        setup = Setup(task)
    if task not in KEYS:
        setup.display = setup.display._replace(rate=RATE)  # CartPole's own is half of it
    sessions = Sessions(setup, choice, open_records(records), second=0.001)
    print(f"http://{address}/", flush=True)
    serve_until_stopped(make_application(sessions, [address]), listening)


def balancing():
    """Values that balance the pole: push to where it falls. Most of their units do nothing."""
    from qbumpers.networks.network import Network, named_parameters
    from qbumpers.values import NetworkValues

    network = Network((64, 64), "relu")
    layout = network.layout(4, 2)
    parameters = np.zeros(layout.parameters(), np.float32)
    named = named_parameters(layout, parameters)
    for unit, sign in enumerate((1, -1)):
        named["hidden_1.weight"][:, unit] = sign * np.array([0.05, 0.2, 1.0, 0.5])
        named["hidden_2.weight"][unit, unit] = 1
        named["values.weight"][unit] = (-20 * sign, 20 * sign)
    named["values.bias"][:] = 50
    return NetworkValues(network, 4, 2, parameters, 0.99, "CartPole-v1", "written by hand")


def show(task: str, sessions: int, seconds: float) -> None:
    """One row: a server of its own, so many sessions, so long."""
    os.sched_setaffinity(0, CORES)
    timer = lateness_of_a_timer()
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [sys.executable, __file__, "--serve", task, f"{folder}/play.sqlite"],
            stdout=subprocess.PIPE, text=True,
        ) as server,
    ):  # fmt: skip
        assert server.stdout is not None
        found = re.search(r"http://([\d.:]+)/", server.stdout.readline())
        assert found is not None
        address = found[1]
        os.sched_setaffinity(0, {min(CORES)})
        asyncio.run(played(address, task, 1, 0.5))  # what is compiled or loaded once
        before = measured(server.pid)
        times, busy = asyncio.run(watched(address, task, sessions, seconds, server.pid))
        memory = measured(server.pid).memory
        server.terminate()
        server.wait()
    late = 1000 * np.percentile(times.late, [50, 99])
    keys = 1000 * np.percentile(times.keys, [50, 99])
    rate = len(times.late) / seconds
    print(
        f"{task:<14}{sessions:>9}{rate:>7.0f}{late[0]:>6.1f}{late[1]:>7.1f}{keys[0]:>7.1f}"
        f"{keys[1]:>6.0f}{timer:>7.1f}{busy:>8.0%}{1e6 * busy / rate:>8.0f}"
        f"{(memory - before.memory) / sessions:>8.2f}",
        flush=True,
    )


TIMER = """
import asyncio, os, time
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
async def tick():
    late = []
    for _ in range(150):
        begun = time.monotonic()
        await asyncio.sleep(0.02)
        late.append(time.monotonic() - begun - 0.02)
    print(sorted(late)[148])
asyncio.run(tick())
"""


def lateness_of_a_timer() -> float:
    """Milliseconds, the 99th percentile, of three seconds on the server's core."""
    found = subprocess.run([sys.executable, "-c", TIMER], stdout=subprocess.PIPE, check=True)
    return 1000 * float(found.stdout)


class Use(NamedTuple):
    """What a process has used.

    Attributes:
        seconds: of its core.
        memory: in MB, now.
    """

    seconds: float
    memory: float


def measured(process: int) -> Use:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    seconds = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return Use(seconds, int(fields[21]) * os.sysconf("SC_PAGE_SIZE") / 2**20)


async def watched(
    address: str, task: str, sessions: int, seconds: float, process: int
) -> tuple[Times, float]:
    """Times of steps, and how busy the server was meanwhile."""
    playing = asyncio.create_task(played(address, task, sessions, seconds))
    await asyncio.sleep(WARM)
    before = measured(process).seconds
    await asyncio.sleep(seconds)
    busy = (measured(process).seconds - before) / seconds
    return await playing, busy


async def played(address: str, task: str, sessions: int, seconds: float) -> Times:
    """Times of every session's steps; those of the beginning are left out."""
    warm = time.monotonic() + WARM
    page = functools.partial(turns, *KEYS[task]) if task in KEYS else clock
    pages = [page(address, k * APART % 1, warm, warm + seconds) for k in range(sessions)]
    found = await asyncio.gather(*pages)
    return Times(*([each for times in found for each in getattr(times, f)] for f in Times._fields))


@contextlib.asynccontextmanager
async def joined(address: str):
    """A socket that was welcomed, and the welcome."""
    async with connect(f"ws://{address}/socket", origin=Origin(f"http://{address}")) as socket:
        await socket.send('{"type": "hello"}')
        yield socket, json.loads(await socket.recv())


async def turns(
    rate: float, keys: list[int], address: str, offset: float, warm: float, until: float
) -> Times:
    """Episodes of a task that waits for keys, key by key."""
    late, episode, number = [], 0, 0
    async with joined(address) as (socket, _):
        await asyncio.sleep(offset)
        while time.monotonic() < until:
            await begin(socket, episode)
            await socket.recv()
            episode += 1
            for action in itertools.cycle(keys):
                sent = time.monotonic()
                act = {"type": "act", "number": number, "action": action, "device": "keyboard"}
                await socket.send(json.dumps({**act, "pressed": 0.0, "shown": 0.0}))
                state = heard(await socket.recv())
                number = state.number
                if warm <= sent < until:
                    late.append(time.monotonic() - sent)
                if state.episode.over or time.monotonic() >= until:
                    break
                await asyncio.sleep(max(0.0, sent + 1 / rate - time.monotonic()))
    return Times(late, late)


async def clock(address: str, offset: float, warm: float, until: float) -> Times:
    """A task in real time, by changing keys, again and again."""
    late, keys, episode = [], [], 0
    async with joined(address) as (socket, welcome):
        rate, actions = welcome["task"]["rate"], len(welcome["task"]["actions"])
        await asyncio.sleep(offset)
        while time.monotonic() < until:
            await begin(socket, episode)
            episode += 1
            arrivals, waits = await lived(socket, actions, until)
            counted = (arrivals[1:] >= warm) & (arrivals[1:] < until)
            late += np.maximum(0, np.diff(arrivals) - 1 / rate)[counted].tolist()
            keys += [wait for sent, wait in waits if warm <= sent < until]
    return Times(late, keys)


async def lived(socket, actions: int, until: float):
    """An episode: when each step arrived, and of each key, when it was sent and how long it took.

    The held action changes every ten steps, to another one than before.
    """
    arrivals, waits, held, sent = [], [], 0, None
    while time.monotonic() < until:
        message = heard(await socket.recv())
        if message.type != "state" or message.last is None:
            continue
        now = time.monotonic()
        arrivals.append(now)
        if sent is not None and message.last.proposed == held:
            waits.append((sent, now - sent))
            sent = None
        if message.episode.over:
            break
        if len(arrivals) % 10 == 0:
            held, sent = (held + 1) % actions, now
            hold = {"type": "hold", "sequence": message.number, "action": held}
            await socket.send(json.dumps(hold))
    return np.array(arrivals), waits


async def begin(socket, episode: int) -> None:
    await socket.send(json.dumps({"type": "begin", "episode": episode, **BUMPERS}))


if __name__ == "__main__":
    main()
