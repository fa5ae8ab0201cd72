"""Takes the pictures of the page for play.md and the README: `python docs/make_play.py`.

Needs the extras `dev` and `study`, and Debian's chromium (`.ci/install_browser`).
"""

import contextlib
import io
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

IMAGES = Path(__file__).parent / "images"
AROUND = ["ArrowUp", *["ArrowRight"] * 11, "ArrowDown"]
TOO_SOON = ["ArrowUp", *["ArrowRight"] * 5, "ArrowDown", *["ArrowRight"] * 5]


@contextlib.contextmanager
def serving(*arguments: str) -> Iterator[str]:
    """The URL of a command that serves a page."""
    command = [sys.executable, "-u", "-m", "qbumpers", *arguments, "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            yield next(found[0] for line in server.stdout if (found := re.search(r"http\S+", line)))
        finally:
            server.terminate()


def saved(page: Any, name: str) -> None:
    """The picture of a page, in few colours."""
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        picture.convert("RGB").quantize(128, dither=Image.Dither.NONE).save(
            IMAGES / name, optimize=True
        )


def begin(page: Any) -> None:
    """Start the next episode."""
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")


def walk(page: Any, keys: list[str]) -> None:
    """Press keys, one after the other."""
    for key in keys:
        page.keyboard.press(key)
        page.wait_for_timeout(200)


def lander(page: Any) -> None:
    """An engine in place of another one."""
    begin(page)
    page.keyboard.down("ArrowRight")
    page.wait_for_selector("#override:visible")
    page.wait_for_timeout(700)
    saved(page, "play-lander.png")


def replay(page: Any) -> None:
    """A step of the lander that was overridden, as it is shown again."""
    page.wait_for_selector("#log button")
    page.click("#log button >> nth=1")
    page.wait_for_timeout(300)
    saved(page, "play-replay.png")


def cliff(page: Any) -> None:
    """Some episodes with and without help, and a step that is overridden."""
    for episode, keys in enumerate([AROUND, [*TOO_SOON, "ArrowRight", "ArrowDown"]] * 2):
        page.set_checked("#assisted", episode % 2 == 1)
        begin(page)
        walk(page, keys)
        while not page.is_visible("#go"):
            walk(page, ["ArrowRight", "ArrowDown"])
            page.wait_for_timeout(500)
    page.set_checked("#assisted", True)
    begin(page)
    walk(page, TOO_SOON[:7])
    saved(page, "play-cliff.png")


def phone(page: Any) -> None:
    """The same step, on a small screen."""
    begin(page)
    walk(page, TOO_SOON[:7])
    saved(page, "play-phone.png")


def shown(
    browser: Any, url: str, take: Callable[[Any], None], width: int, height: int, ready: str
) -> None:
    """Open a page, wait until it is ready, and take its picture."""
    page = browser.new_page(
        viewport={"width": width, "height": height},
        color_scheme="dark" if width < 500 else "light",
        has_touch=width < 500,
    )
    page.goto(url)
    page.wait_for_selector(ready)
    take(page)
    page.close()


def main() -> None:
    """Take every picture."""
    with sync_playwright() as running:
        browser = running.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        for task, take, width, height in [
            ("lunar-lander", lander, 1200, 960),
            ("cliff-walking", cliff, 1200, 940),
            ("cliff-walking", phone, 390, 700),
        ]:
            with tempfile.TemporaryDirectory() as folder:
                with serving("play", task, "--alpha", "0.4", "--out", folder) as url:
                    shown(browser, url, take, width, height, "#go:visible")
                if take is lander:
                    with serving("study", "replay", f"{folder}/play.sqlite") as url:
                        shown(browser, url, replay, width, 980, "#log")
        browser.close()


if __name__ == "__main__":
    main()
