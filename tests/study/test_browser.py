"""The example study in a real browser, from consent to completion, at both sizes."""

import os
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.narrowing import present

pytestmark = pytest.mark.study

ROOT = Path(__file__).parents[2]
AXE = ROOT / ".browser" / "node_modules" / "axe-core" / "axe.min.js"
SIZES = {"desktop": (1280, 860), "phone": (390, 844)}
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
DONE = "https://example.org/done"


@pytest.fixture
def open_page(browser):
    """Opens pages; whatever goes wrong in one is an error of the test."""
    wrong, contexts = [], []

    def open_page(device="desktop", scheme="light"):
        width, height = SIZES[device]
        context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme,
            has_touch=device == "phone", reduced_motion="reduce",
        )  # fmt: skip
        context.route(f"{DONE}**", lambda route: route.fulfill(body="<title>back</title>"))
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(15_000)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: said.type == "error" and wrong.append(said.text))
        return page

    yield open_page
    for context in contexts:
        context.close()
    # A server that is gone is what some tests are about; a wrong token is refused.
    assert [text for text in wrong if "ERR_CONNECTION" not in text and "403" not in text] == []


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


@pytest.fixture
def example(tmp_path):
    """The example study, shortened, with a link to go back to."""
    text = (ROOT / "examples" / "study.toml").read_text(encoding="utf-8")
    for before, now in [
        ("step_limit = 60", "step_limit = 4"),
        ("episodes = 8 ", "episodes = 2 "),
        ("# codes = {", f'return_link = "{DONE}?cc={{code}}"\ncodes = {{'),
    ]:
        assert before in text
        text = text.replace(before, now)
    path = tmp_path / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def server(example, tmp_path):
    running = Server(example, tmp_path / "records")
    yield running
    running.kill()


def violations(page):
    if not AXE.is_file():
        return []
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("tags => axe.run({runOnly: tags})", TAGS)
    return [(each["id"], [n["target"] for n in each["nodes"]]) for each in found["violations"]]


def heading(page, text):
    page.wait_for_function(
        "text => document.getElementById('heading').textContent === text", arg=text
    )
    assert violations(page) == [], text
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), text


def go(page):
    page.click("#form button.primary")


def play(page, device, after=None):
    """Play episodes until the block is over; after(step) is called between."""
    while True:
        page.click("#choices button.primary")
        if not page.evaluate("document.getElementById('game').offsetParent"):
            return  # the next page is there
        page.wait_for_selector("#overlay", state="hidden")
        before = page.inner_text("#episode")
        for step in range(4):
            if device == "phone":
                page.tap("#pad .up")
            else:
                page.keyboard.press("ArrowUp")
            page.wait_for_function(
                "step => Number(document.getElementById('step').textContent) >= step", arg=step + 1
            )
            if after and step == 1:
                after()
                after = None
        page.wait_for_selector("#choices button.primary:visible")
        assert violations(page) == []
        if "over" in page.inner_text("#detail"):
            page.click("#choices button.primary")
            return
        assert page.inner_text("#episode") == before


@pytest.mark.parametrize(("device", "scheme"), [("desktop", "light"), ("phone", "dark")])
def test_the_example_from_consent_to_the_way_back(server, open_page, device, scheme):
    page = open_page(device, scheme)
    page.goto(f"http://{server.address}/")
    heading(page, "Consent")
    assert page.is_hidden("#withdraw")
    go(page)
    heading(page, "Instructions")
    go(page)
    heading(page, "Checking your device")
    page.wait_for_selector("#form button")
    go(page)
    heading(page, "Practice")
    play(page, device)
    heading(page, "Before you begin")
    go(page)
    assert page.locator(".wrong:visible").count() == 2
    page.get_by_label("nothing").check()
    page.get_by_label("no", exact=True).check()
    go(page)
    page.wait_for_selector("#notice:visible")
    page.get_by_label("100 points").check()
    page.get_by_label("no", exact=True).check()
    go(page)
    heading(page, "First round")
    play(page, device)
    heading(page, "Training")

    def killed():
        server.kill()
        page.wait_for_selector("#overlay:visible")
        server.start()
        page.wait_for_selector("#overlay", state="hidden", timeout=20_000)
        page.wait_for_function("() => document.getElementById('step').textContent === '2'")

    play(page, device, after=killed)
    heading(page, "Final round")
    page.reload()
    heading(page, "Final round")
    play(page, device)
    heading(page, "Some questions")
    for slider in page.get_by_role("slider").all():
        slider.press("ArrowRight")
    go(page)
    heading(page, "About you")
    page.get_by_label("sometimes").check()
    go(page)
    heading(page, "Thank you")
    go(page)
    heading(page, "The study is complete")
    assert page.inner_text(".code") == "Your code: C1"
    page.click("a.button")
    page.wait_for_url(f"{DONE}?cc=C1")


def test_withdrawing_is_asked_twice_and_deletes(server, open_page, tmp_path):
    page = open_page()
    page.goto(f"http://{server.address}/")
    go(page)
    heading(page, "Instructions")
    page.click("#withdraw")
    assert violations(page) == []
    page.click("#stay")
    page.click("#withdraw")
    page.click("#leave")
    heading(page, "The study has ended")
    assert "Your data were deleted" in page.inner_text("#text")
    page.reload()
    heading(page, "Consent")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", SIZES)
def test_the_researcher_sees_who_is_where(server, open_page, device, scheme):
    participant, page = open_page(), open_page(device, scheme)
    participant.goto(f"http://{server.address}/")
    go(participant)
    heading(participant, "Instructions")
    page.goto(f"http://{server.address}/researcher")
    assert violations(page) == []
    page.fill("#token", "guess")
    page.click("#form button")
    page.wait_for_function(
        "() => document.getElementById('link').textContent.startsWith('Not opened')"
    )
    page.fill("#token", server.token)
    page.click("#form button")
    page.wait_for_selector("#people tbody tr")
    assert "1 came, 1 are here now" in page.inner_text("#summary")
    assert "instructions" in page.inner_text("#people")
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert server.token not in page.url
    with page.expect_download() as download:
        page.click("#export")
    assert download.value.suggested_filename == "study.zip"


def test_simulated_learners_take_part_in_the_browser(tmp_path):
    if shutil.which("chromium") is None:
        pytest.skip("chromium is not installed: .ci/install_browser")
    pytest.importorskip("playwright.async_api")
    from qbumpers.study.bots.browser import by_browser
    from qbumpers.study.bots.rehearsing import rehearse
    from qbumpers.study.design.sources import setups_of
    from qbumpers.study.flow.tables import open_study
    from qbumpers.study.outcomes.reading import read_participants
    from tests.study.flow.studies import CHECK, block, study_of

    study = study_of(
        {"kind": "device-check"}, CHECK, block("training", 1, probe_every=1, attribution=3),
        {"kind": "questionnaire", "instrument": "nasa-tlx"},
        {"kind": "questionnaire", "instrument": "trust"},
        {"kind": "questionnaire", "instrument": "background"},
        rehearsal={"drop_out": 0.0, "reload": 1.0},
    )  # fmt: skip
    path, setups = tmp_path / "simulated.sqlite", setups_of(study)
    engine = open_study(path, study.name, "simulated", "digest")
    with ThreadPoolExecutor(1) as pool:  # the browser of other tests has this thread's loop
        found = pool.submit(
            rehearse, study, setups, engine, 2, take_part=by_browser, at_once=1
        ).result()
    assert found.outcomes == {"complete": 2}
    engine = open_study(path, study.name, "simulated", "digest")
    for participant in read_participants(engine, study):
        assert [episode.length for episode in participant.blocks[0].episodes] == [4, 4]
        assert {step["device"] for step in participant.blocks[0].times} == {"keyboard"}
        answers = participant.answers()
        assert answers["nasa-tlx"].content["content"]["effort"] % 5 == 0
        assert answers["device-check"].content["content"]["refresh"] > 0
    engine.dispose()
