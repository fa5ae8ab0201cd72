"""Takes the pictures of a study for studies.md: `python docs/make_studies.py`.

Needs the extras `dev` and `study`, and Debian's chromium (`.ci/install_browser`).
"""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from make_play import saved
from playwright.sync_api import sync_playwright

EXAMPLE = Path(__file__).parents[1] / "examples" / "study.toml"
AROUND = ["ArrowUp", *["ArrowRight"] * 11, "ArrowDown"]


def go(page: Any) -> None:
    """To the next page."""
    page.click("#form button.primary")


def walk(page: Any, keys: list[str]) -> None:
    """Press keys of an episode, one after the other."""
    page.click("#choices button.primary")
    page.wait_for_selector("#overlay", state="hidden")
    for key in keys:
        page.keyboard.press(key)
        page.wait_for_timeout(150)


def up_to_training(page: Any) -> None:
    """From consent through the pretest."""
    go(page)
    go(page)
    page.wait_for_selector("#form button")
    go(page)
    for episodes in (1, 2):
        for _ in range(episodes):
            page.wait_for_selector("#choices button.primary:visible")
            walk(page, AROUND)
        page.wait_for_selector("#choices button.primary:visible")
        page.click("#choices button.primary")
        if episodes == 1:
            page.get_by_label("100 points").check()
            page.get_by_label("no", exact=True).check()
            saved(page, "study-check.png")
            go(page)
    page.wait_for_function("() => document.getElementById('heading').textContent === 'Training'")


def main() -> None:
    """Take every picture."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        command = [sys.executable, "-m", "qbumpers", "study", "serve", str(EXAMPLE), "--port", "0"]
        with subprocess.Popen(
            [*command, "--no-browser", "--out", folder], stdout=subprocess.PIPE, text=True
        ) as server:
            assert server.stdout is not None
            found = re.search(r"http\S+/", server.stdout.readline())
            token = server.stdout.readline().split()[-1]
            assert found is not None
            browser = running.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
            )
            page = browser.new_page(viewport={"width": 1000, "height": 760})
            page.goto(found[0])
            page.wait_for_selector("#form button.primary")
            saved(page, "study-consent.png")
            up_to_training(page)
            researcher = browser.new_page(viewport={"width": 1000, "height": 620})
            phone = browser.new_page(
                viewport={"width": 390, "height": 760}, color_scheme="dark", has_touch=True
            )
            phone.goto(found[0])
            up_to_training(phone)
            walk(phone, AROUND[:4])
            saved(phone, "study-phone.png")
            researcher.goto(f"{found[0]}researcher")
            researcher.fill("#token", token)
            researcher.click("#form button")
            researcher.wait_for_selector("#people tbody tr")
            saved(researcher, "study-researcher.png")
            browser.close()
            server.terminate()


if __name__ == "__main__":
    main()
