"""What is done on the pages of a study in a browser, and the server in a process of its own."""

import os
import re
import subprocess
import sys

from tests.browsing import AXE, violations
from tests.narrowing import present

DONE = "https://example.org/done"
"""Where the last page leads."""


class Server:
    """`qbumpers study serve` in a process of its own, at a port that stays."""

    def __init__(self, file, out):
        self._arguments, self._port = [str(file), "--out", str(out)], "0"
        self.start()

    def start(self):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "qbumpers", "study", "serve", *self._arguments, "--no-browser",
             "--port", self._port],
            stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        output = present(self._process.stdout)
        found = re.search(r"http://(127\.0\.0\.1:(\d+))/", output.readline())
        assert found, "it does not say where it serves"
        self.address, self._port = found[1], found[2]
        self.token = output.readline().split()[-1]

    def kill(self):
        self._process.kill()
        self._process.wait(15)
        present(self._process.stdout).close()


def check_page(page, text):
    """Nothing on the page is hard to use; nothing reaches beyond its width."""
    if AXE.is_file():
        assert violations(page) == [], text
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), text


def heading(page, text):
    """Wait for the page of that heading, and check it."""
    page.wait_for_function(
        "text => document.getElementById('heading').textContent === text", arg=text
    )
    check_page(page, text)


def go(page):
    page.click("#form button.primary")


def press(page, device, step):
    """Up, as the step of that number; wait for what it comes to."""
    if device == "phone":
        page.tap("#pad .up")
    else:
        page.keyboard.press("ArrowUp")
    page.wait_for_function(
        "step => Number(document.getElementById('step').textContent) >= step", arg=step + 1
    )


def play(page, device, after=None):
    """Play episodes of 4 steps until the block is over; after() is called in the first."""
    while True:
        page.click("#choices button.primary")
        if not page.evaluate("document.getElementById('game').offsetParent"):
            return  # the next page is there
        page.wait_for_selector("#overlay", state="hidden")
        before = page.inner_text("#episode")
        for step in range(4):
            press(page, device, step)
            if after and step == 1:
                after()
                after = None
        page.wait_for_selector("#choices button.primary:visible")
        check_page(page, "episode over")
        if "over" in page.inner_text("#detail"):
            page.click("#choices button.primary")
            return
        assert page.inner_text("#episode") == before
