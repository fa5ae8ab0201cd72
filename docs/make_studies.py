"""Takes the pictures of a study for studies.md: `python docs/make_studies.py`.

Needs the extras `dev` and `study`, and Debian's chromium (`.ci/install_browser`).
"""

import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from make_play import saved
from playwright.sync_api import sync_playwright

from qbumpers.study.bots.rehearsing import rehearse
from qbumpers.study.design.sources import load_study, setups_of
from qbumpers.study.flow.running import opened

EXAMPLE = Path(__file__).parents[1] / "examples" / "study.toml"
LEARNERS = 24
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


def participant(browser: Any, url: str) -> None:
    """Consent, and the comprehension check; then on to the training."""
    page = browser.new_page(viewport={"width": 1000, "height": 760})
    page.goto(url)
    page.wait_for_selector("#form button.primary")
    saved(page, "study-consent.png")
    up_to_training(page)


def phone(browser: Any, url: str) -> None:
    """The training, on a small screen in the dark."""
    page = browser.new_page(
        viewport={"width": 390, "height": 760}, color_scheme="dark", has_touch=True
    )
    page.goto(url)
    up_to_training(page)
    walk(page, AROUND[:4])
    saved(page, "study-phone.png")


def researcher(browser: Any, url: str, token: str) -> None:
    """Who is where, and the learning curves."""
    page = browser.new_page(viewport={"width": 900, "height": 1130})
    page.goto(f"{url}researcher")
    page.fill("#token", token)
    page.click("#form button")
    page.wait_for_selector("#curves canvas")
    saved(page, "study-researcher.png")


def pilot(folder: Path) -> None:
    """Let simulated learners come before, so that there are curves."""
    study = load_study(EXAMPLE)
    setups = setups_of(study)
    engine = opened(EXAMPLE, study, setups, folder, "pilot")
    rehearse(study, setups, engine, LEARNERS)
    engine.dispose()


def main() -> None:
    """Take every picture."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        with ThreadPoolExecutor(1) as pool:  # this thread's loop is the browser's
            pool.submit(pilot, Path(folder)).result()
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
            participant(browser, found[0])
            phone(browser, found[0])
            researcher(browser, found[0], token)
            browser.close()
            server.terminate()


if __name__ == "__main__":
    main()
