"""A server that is far away, and a player in the page who feels it.

`python -m tests.play.distance` says what it comes to, for some round trips.
"""

import argparse
import contextlib
import os
import queue
import shutil
import socket
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from qbumpers.play.game import Choice
from tests.browsing import FLAGS
from tests.play.serving import served

PILOT = (Path(__file__).parent / "pilot.js").read_text(encoding="utf-8")
"""Measures what a page feels, and lands: see there."""

ON_BOTH_ENDS = 0.04
"""Seconds: two steps of the lander."""

KEYS = ["ArrowUp", *["ArrowRight"] * 11, "ArrowDown"]


class Far:
    """Another address of a server, so far away that each way takes some time; it can be cut off."""

    def __init__(self, seconds):
        self._seconds, self._near, self._open = seconds, ("", 0), []
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listening.getsockname()[1]}"
        self._is_cut = False
        threading.Thread(target=self._accept, daemon=True).start()

    def lead_to(self, address):
        host, port = address.split(":")
        self._near = host, int(port)

    def cut(self):
        """As if a cable were pulled; who tries again finds nobody."""
        self._is_cut = True
        for end in self._open:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._open.clear()

    def mend(self):
        self._is_cut = False

    def close(self):
        self.cut()
        with contextlib.suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                here = self._listening.accept()[0]
                if self._is_cut:
                    here.close()
                    continue
                there = socket.create_connection(self._near)
                self._open += [here, there]
                for ends in ((here, there), (there, here)):
                    threading.Thread(target=self._carry, args=ends, daemon=True).start()

    def _carry(self, source, sink):
        waiting = queue.SimpleQueue()
        threading.Thread(target=_deliver, args=[waiting, sink], daemon=True).start()
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                waiting.put((time.monotonic() + self._seconds, data))
        waiting.put((0.0, b""))


def _deliver(waiting, sink):
    with contextlib.suppress(OSError), sink:
        while True:
            due, data = waiting.get()
            if not data:
                break
            time.sleep(max(0.0, due - time.monotonic()))
            sink.sendall(data)


@contextlib.contextmanager
def far_served(setup, choice, records, round_trip, second=0.2):
    """The far address of a server, and the distance."""
    with (
        contextlib.closing(Far(round_trip / 2)) as far,
        served(setup, choice, records, second=second, also=[far.address]) as near,
    ):
        far.lead_to(near)
        yield far


def begin(page):
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")


def steps_felt(page, keys=KEYS):
    """Milliseconds from each key to its echo on the page, and to the state that comes of it."""
    begin(page)
    return [page.evaluate("code => pilot.step(code)", key) for key in keys]


def holds_felt(page, times=2):
    """The same of a task in real time."""
    found = []
    for _ in range(times):
        begin(page)
        found += [
            page.evaluate("([code, action]) => pilot.hold(code, action)", held)
            for held in [("ArrowUp", 2), ("ArrowLeft", 1), ("ArrowUp", 2)]  # before it is down
        ]
        page.wait_for_selector("#go:visible", timeout=60_000)
    return found


def landings(page, round_trip, episodes):
    """Returns and successes of the pilot, who sees what is drawn and presses keys.

    It reckons with the round trip, and with what it takes until the server uses a key and until
    the page has drawn what comes of it.
    """
    found = []
    for _ in range(episodes):
        begin(page)
        page.evaluate("delay => pilot.fly(delay)", round_trip + ON_BOTH_ENDS)
        page.wait_for_selector("#go:visible", timeout=60_000)
        found.append(page.evaluate("() => pilot.ended()"))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=5)
    episodes = parser.parse_args().episodes
    from playwright.sync_api import sync_playwright

    from qbumpers.play.setup import Setup

    print(f"load of the machine when begun: {os.getloadavg()[0]:.1f}")
    print("round trip  echo  step seen  held seen  landed  return")
    cliff, lander = Setup("cliff-walking"), Setup("lunar-lander")
    with sync_playwright() as running, tempfile.TemporaryDirectory() as folder:
        browser = running.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)

        def felt(setup, choice, round_trip, what, *arguments):
            records = Path(folder) / f"{setup.task.name}-{round_trip}.sqlite"
            with far_served(setup, choice, records, round_trip) as far:
                page = browser.new_page(viewport={"width": 1280, "height": 860})
                page.add_init_script(PILOT)
                page.goto(f"http://{far.address}/")
                page.wait_for_selector("#go:visible")
                result = what(page, *arguments)
                page.close()
            return result

        for round_trip in (0.0, 0.1, 0.2):
            steps = felt(cliff, Choice("none", {}), round_trip, steps_felt)
            holds = felt(lander, Choice("none", {}), round_trip, holds_felt)
            flown = felt(lander, Choice("none", {}), round_trip, landings, round_trip, episodes)
            landed = sum(each["success"] for each in flown)
            print(
                f"{1000 * round_trip:7.0f} ms"
                f"{np.median([each['echo'] for each in steps + holds]):6.0f}"
                f"{np.median([each['seen'] for each in steps]):11.0f}"
                f"{np.median([each['seen'] for each in holds]):11.0f}"
                f"{landed:5d} of {episodes}"
                f"{np.mean([each['total'] for each in flown]):8.0f}"
            )
        browser.close()


if __name__ == "__main__":
    main()
