"""How late steps are with many sessions on one server: `python benchmarks/play.py [--quick]`.

A server in a process of its own, on one core; this process is every page at once. A task with
turns is played at five keys per second, and a step is as late as its answer takes. A task in real
time goes at its own rate, and a step is late by what it takes longer than that after the one
before.
Every step is committed to the record.
"""

import asyncio
import contextlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from websockets.asyncio.client import connect
from websockets.typing import Origin

KEYS_PER_SECOND = 5
BUMPERS = {"assistant": "stochastic-q-bumpers", "options": {"alpha": 0.1}}
AROUND = [0, *[1] * 11, 2]  # the cliff


def main() -> None:
    if sys.argv[1:2] == ["--serve"]:
        serve(sys.argv[2], Path(sys.argv[3]))
        return
    quick = "--quick" in sys.argv
    seconds = 3 if quick else 10
    print(f"load of the machine when begun: {os.getloadavg()[0]:.1f}")
    print("task           sessions  steps/s  p50 ms  p99 ms  server    MB")
    for task, counts in [("cliff-walking", (10, 100)), ("lunar-lander", (1, 10, 25))]:
        for sessions in counts[:1] if quick else counts:
            show(task, sessions, seconds)


def serve(task: str, folder: Path) -> None:
    """A server without countdowns, until it is terminated."""
    import uvicorn

    from qbumpers.study.addresses import listening_at
    from qbumpers.study.game import Choice
    from qbumpers.study.running import configuration
    from qbumpers.study.server import Sessions, make_application
    from qbumpers.study.setup import Setup
    from qbumpers.study.tables import open_records

    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    listening = listening_at(0)
    address = f"127.0.0.1:{listening.getsockname()[1]}"
    choice = Choice(BUMPERS["assistant"], BUMPERS["options"])
    sessions = Sessions(Setup(task), choice, open_records(folder / "play.sqlite"), second=0.001)
    print(f"http://{address}/", flush=True)
    uvicorn.Server(configuration(make_application(sessions, [address]))).run([listening])


def show(task: str, sessions: int, seconds: float) -> None:
    """One row: a server of its own, so many sessions, so long."""
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            [sys.executable, __file__, "--serve", task, folder], stdout=subprocess.PIPE, text=True
        ) as server,
    ):
        assert server.stdout is not None
        found = re.search(r"http://([\d.:]+)/", server.stdout.readline())
        assert found is not None
        began = time.monotonic()
        late = asyncio.run(played(found[1], task, sessions, seconds))
        lasted = time.monotonic() - began
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        server.terminate()
        server.wait()
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = (used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime) / lasted
    middle, worst = 1000 * np.percentile(late, [50, 99])
    memory = used.ru_maxrss / 1024
    print(
        f"{task:<14}{sessions:>9}{len(late) / seconds:>9.0f}{middle:>8.1f}{worst:>8.1f}"
        f"{busy:>8.0%}{memory:>6.0f}"
    )


async def played(address: str, task: str, sessions: int, seconds: float) -> list[float]:
    """How late every step of every session was, in seconds; the first second is left out."""
    warm = time.monotonic() + 1.0
    until = warm + seconds
    page = turns if task == "cliff-walking" else clock
    pages = [page(address, k / sessions / KEYS_PER_SECOND, warm, until) for k in range(sessions)]
    return [late for found in await asyncio.gather(*pages) for late in found]


@contextlib.asynccontextmanager
async def joined(address: str):
    async with connect(f"ws://{address}/socket", origin=Origin(f"http://{address}")) as socket:
        await socket.send('{"type": "hello"}')
        await socket.recv()
        yield socket


async def turns(address: str, offset: float, warm: float, until: float) -> list[float]:
    """Around the cliff, key by key, again and again."""
    late, episode, number = [], 0, 0
    async with joined(address) as socket:
        await asyncio.sleep(offset)
        while time.monotonic() < until:
            await begin(socket, episode)
            await socket.recv()
            episode += 1
            for action in AROUND:
                sent = time.monotonic()
                act = {"type": "act", "number": number, "action": action, "device": "keyboard"}
                await socket.send(json.dumps({**act, "pressed": 0.0, "shown": 0.0}))
                state = json.loads(await socket.recv())
                number = state["number"]
                if warm <= sent < until:
                    late.append(time.monotonic() - sent)
                if state["episode"]["over"] or time.monotonic() >= until:
                    break
                await asyncio.sleep(max(0.0, sent + 1 / KEYS_PER_SECOND - time.monotonic()))
    return late


async def clock(address: str, offset: float, warm: float, until: float) -> list[float]:
    """The lander, by changing keys, again and again."""
    late, episode, sequence = [], 0, 0
    async with joined(address) as socket:
        await asyncio.sleep(offset)
        while time.monotonic() < until:
            await begin(socket, episode)
            episode += 1
            arrivals = []
            over = False
            while not over and time.monotonic() < until:
                message = json.loads(await socket.recv())
                if message["type"] != "state":
                    continue
                arrivals.append(time.monotonic())
                over = message["episode"]["over"]
                if len(arrivals) % 10 == 0:
                    sequence += 1
                    hold = {"type": "hold", "sequence": sequence, "action": sequence % 4}
                    await socket.send(json.dumps(hold))
            at = np.array(arrivals[1:])
            counted = (at[1:] >= warm) & (at[1:] < until)
            late += np.maximum(0, np.diff(at) - 1 / 50)[counted].tolist()
    return late


async def begin(socket, episode: int) -> None:
    await socket.send(json.dumps({"type": "begin", "episode": episode, **BUMPERS}))


if __name__ == "__main__":
    main()
