"""A recorded session on the page of a real browser."""

import sqlite3

import pytest

from qbumpers.play.game import Choice
from tests.browsing import AXE, WIDTHS, violations
from tests.play.recording import record
from tests.play.serving import AROUND, DOWN, RIGHT, UP, replayed

pytestmark = pytest.mark.study

MAXIMAL = Choice("maximal", {})
WALK = [UP, RIGHT, RIGHT, DOWN, RIGHT, DOWN, *[RIGHT] * 6, DOWN]
"""Around the cliff under maximal help: steps 4 and 6 are overridden."""


@pytest.fixture
def path(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(MAXIMAL, WALK), (MAXIMAL._replace(assisted=False), AROUND[:12])])
    return path


@pytest.fixture
def page(path, opened):
    with replayed(path) as address:
        page = opened(f"{address}/secret")
        at(page, 0)
        yield page


def at(page, step):
    page.wait_for_function(
        "step => document.getElementById('place').textContent.startsWith(`Step ${step} of`)",
        arg=step,
    )


def test_a_recorded_episode_is_stepped_through(page):
    assert page.inner_text("#verdict") == (
        "Decided again: rule and task come to the same in every step."
    )
    assert page.inner_text("#place") == "Step 0 of 13"
    assert "row 4 of 4, column 1 of 12" in page.inner_text("#words").lower()
    blank = page.locator("#canvas").screenshot()
    page.click("#forward")
    at(page, 1)
    assert "Step 1: up. Row 3 of 4, column 1 of 12." in page.inner_text("#words")
    assert (page.inner_text("#pressed"), page.inner_text("#executed")) == ("up", "up")
    assert page.locator("#canvas").screenshot() != blank
    page.click("#next")
    at(page, 4)
    assert (page.inner_text("#pressed"), page.inner_text("#executed")) == ("down", "right")
    assert page.inner_text("#override") == "Assistant: right instead of down"
    assert "overridden with probability 100 %" in page.inner_text("#how")
    assert "400 ms after it was shown" in page.inner_text("#how")
    assert "down" in page.inner_text("#view .proposed")
    assert "right" in page.inner_text("#view .best")
    page.click("#next")
    at(page, 6)
    page.click("#previous")
    at(page, 4)
    page.click("#back")
    at(page, 3)
    assert page.is_hidden("#override")
    assert page.inner_text("#log").splitlines() == [
        "Step 4: right instead of down", "Step 6: right instead of down",
    ]  # fmt: skip
    page.click("#log button >> nth=1")
    at(page, 6)
    assert page.inner_text("#overrides") == "2"


def test_keys_step_and_play(page):
    page.focus("#focus")
    for key, step in [
        ("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1), ("End", 13), ("ArrowRight", 13),
        ("Home", 0), ("ArrowLeft", 0), ("n", 4), ("n", 6), ("n", 6), ("p", 4),
    ]:  # fmt: skip
        page.keyboard.press(key)
        at(page, step)
    page.focus("#slider")
    page.keyboard.press("ArrowRight")
    at(page, 5)
    assert page.get_attribute("#slider", "aria-valuetext").startswith("Step 5: right. Row 3 of 4")


def test_it_is_played_as_fast_as_it_was_and_faster(page):
    took = """async () => {
        const began = performance.now();
        document.getElementById("play").click();
        while (document.getElementById("play").textContent !== "Play")
            await new Promise(requestAnimationFrame);
        return performance.now() - began;
    }"""
    page.select_option("#speed", "4")  # half a second a step, as it was recorded
    slow = page.evaluate(took)
    at(page, 13)
    page.select_option("#speed", "16")
    fast = page.evaluate(took)
    assert 12 * 500 / 4 <= slow < 13 * 500 / 4 + 2500
    assert 12 * 500 / 16 <= fast < slow / 2


def test_another_episode_is_shown(page):
    page.select_option("#episode", "1")
    page.wait_for_function("() => document.getElementById('place').textContent === 'Step 0 of 12'")
    assert page.is_visible("#none")
    page.focus("#focus")
    page.keyboard.press("End")
    at(page, 12)
    assert page.inner_text("#return") == "\N{MINUS SIGN}12"


def test_what_comes_out_differently_is_said(path, opened):
    raw = sqlite3.connect(path)
    raw.execute("update steps set reward = -7 where number = 2")
    raw.commit()
    raw.close()
    with replayed(path) as address:
        page = opened(f"{address}/secret")
        at(page, 0)
        verdict = page.inner_text("#verdict")
        assert "step 2 (episode 0): reward is -1.0, recorded -7.0" in verdict
        page.click("#log button >> nth=1")
        at(page, 6)
        assert page.inner_text("#return") == "\N{MINUS SIGN}12"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", WIDTHS)
def test_the_page_is_accessible_and_fits(path, opened, device, scheme):
    if not AXE.is_file():
        pytest.skip("axe-core is not installed: .ci/install_browser")
    with replayed(path) as address:
        page = opened(f"{address}/secret", device, scheme, reduced_motion="reduce")
        at(page, 0)
        assert violations(page) == []
        page.click("#next")
        at(page, 4)
        assert violations(page) == []
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        for button in page.query_selector_all(".transport button"):
            assert button.bounding_box()["height"] >= 44
