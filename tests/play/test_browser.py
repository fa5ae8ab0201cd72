"""The page in a real browser: keys, touch, gamepad, reloads, a killed server, accessibility."""

import time

import pytest

from qbumpers.play.game import Choice
from qbumpers.play.tables import open_records, read_session, sessions_in
from tests.browsing import AXE, WIDTHS, violations
from tests.narrowing import present
from tests.play.serving import process, served

pytestmark = pytest.mark.study

KEYS = ["ArrowUp", *["KeyD"] * 11, "ArrowDown"]
"""Around the cliff."""
MINUS_13 = "\N{MINUS SIGN}13"
SINCE = "step => Number(document.getElementById('step').textContent) >= step"
ALONE = Choice("stochastic-q-bumpers", {"alpha": 0.5}, assisted=False)


@pytest.fixture
def records(tmp_path):
    return tmp_path / "play.sqlite"


@pytest.fixture
def cliff_server(cliff, records):
    with served(cliff, ALONE, records, second=0.2) as address:
        yield address


@pytest.fixture
def lander_server(lander, records):
    with served(lander, Choice("none", {}), records, second=0.2) as address:
        yield address


def rows_of(records):
    """Columns of every recorded step that `Step` does not have."""
    import sqlalchemy as sql

    from qbumpers.play.tables import STEPS

    engine = open_records(records)
    with engine.connect() as connection:
        rows = connection.execute(sql.select(STEPS).order_by(STEPS.c.number)).mappings().all()
    engine.dispose()
    return rows


def played(records):
    engine = open_records(records)
    [session] = [read_session(engine, each) for each in sessions_in(engine)]
    engine.dispose()
    return present(session).played


def begin(page):
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")


def walk(page, keys=KEYS):
    """Press keys as a person does, each when the one before is seen."""
    first = int(page.inner_text("#step"))
    for k, key in enumerate(keys):
        page.keyboard.press(key)
        expect_step(page, first + k + 1)


def expect_step(page, step):
    page.wait_for_function(
        "step => document.getElementById('step').textContent === String(step)", arg=step
    )


def test_the_cliff_is_walked_by_keys(cliff_server, records, opened):
    page = opened(cliff_server)
    assert page.inner_text("#task") == "cliff-walking"
    begin(page)
    assert "row 4 of 4, column 1 of 12" in page.inner_text("#words").lower()
    blank = page.locator("#canvas").screenshot()
    walk(page)
    page.wait_for_selector("#go:visible")
    assert page.inner_text("#headline") == "You made it"
    assert page.inner_text("#return") == "87"
    assert page.locator("#canvas").screenshot() != blank
    assert page.evaluate("() => document.activeElement.id") == "go"
    page.click("#episodes summary")
    assert page.inner_text("#rows").split() == ["1", "none", "87", "13", "0", "success"]
    assert page.inner_text("#progress") == "1 unassisted, mean return 87, best 87."
    rows = rows_of(records)
    assert {row["device"] for row in rows} == {"keyboard"}
    for row in rows:
        assert row["shown"] < row["pressed"]
        assert row["received"] <= row["applied"]
    page.focus("#go")
    page.keyboard.press("Enter")
    page.wait_for_selector("#overlay", state="hidden")
    assert page.inner_text("#episode") == "2"


def test_a_key_that_is_held_is_one_press(cliff_server, opened):
    page = opened(cliff_server)
    begin(page)
    for _ in range(5):
        page.keyboard.down("ArrowUp")  # after the first, repeats
    expect_step(page, 1)
    page.keyboard.up("ArrowUp")
    walk(page, ["ArrowUp"])
    assert page.inner_text("#step") == "2"


def test_what_the_assistant_sees_and_does_is_shown(cliff_server, opened):
    page = opened(cliff_server)
    page.select_option("#assistant", "maximal")
    page.check("#assisted")
    begin(page)
    sees = page.inner_text("#view").split()
    assert sees[sees.index("up") : sees.index("up") + 4] == ["up", "87", "87", "0"]
    assert sees[sees.index("right") : sees.index("right") + 4] == [
        "right",
        MINUS_13,
        MINUS_13,
        "100",
    ]
    assert "up" in page.inner_text("#view .best")
    walk(page, ["ArrowRight"])
    page.wait_for_selector("#override:visible")
    assert page.inner_text("#override") == "Assistant: up instead of your right"
    assert page.inner_text(".log") == "step 1: up instead of your right"
    assert "up instead of your right" in page.inner_text("#words")


def test_the_assistant_changes_between_episodes(cliff_server, records, opened):
    page = opened(cliff_server)
    begin(page)
    page.check("#assisted")
    page.fill("input[name=alpha]", "0.25")
    page.keyboard.press("ArrowUp")  # the form has the focus, not the game
    page.fill("input[name=alpha]", "0.25")
    page.click("#canvas")
    walk(page)
    page.wait_for_selector("#go:visible")
    begin(page)
    walk(page, ["ArrowUp"])
    first, second = played(records)
    assert (first.choice.assisted, second.choice.assisted) == (False, True)
    assert second.choice.options["alpha"] == 0.25


def test_a_wrong_option_is_explained_on_the_page(cliff_server, opened):
    page = opened(cliff_server)
    page.check("#assisted")
    page.click(".options summary")
    page.fill("input[name=v_min]", "500")
    page.click("#go")
    page.wait_for_selector("#notice:visible")
    assert "v_min = 500 must be below the value of the start state" in page.inner_text("#notice")
    page.fill("input[name=v_min]", "0")
    begin(page)
    assert page.is_hidden("#notice")


def test_the_lander_is_flown_in_real_time(lander_server, records, opened):
    page = opened(lander_server)
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")
    page.keyboard.down("ArrowUp")
    page.wait_for_function(SINCE, arg=31)
    page.keyboard.up("ArrowUp")
    page.click("#pause")
    page.wait_for_selector("#go:visible")
    stopped = page.inner_text("#step")
    time.sleep(0.4)
    assert page.inner_text("#step") == stopped
    assert page.inner_text("#pause") == "Go on"
    page.click("#half")
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")
    began, first = time.monotonic(), int(page.inner_text("#step"))
    page.wait_for_function(SINCE, arg=first + 20)
    assert time.monotonic() - began > 0.6  # at 25 Hz
    rows = rows_of(records)
    fired = [row for row in rows if row["proposed"] == 2]
    assert len(fired) > 10
    assert {row["device"] for row in fired} == {"keyboard"}
    assert len({row["pressed"] for row in fired}) == 1
    assert [row["number"] for row in rows] == list(range(len(rows)))


def test_keys_are_released_when_the_page_loses_the_focus(lander_server, opened):
    page = opened(lander_server)
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")
    page.keyboard.down("ArrowLeft")
    page.wait_for_selector("#pad .pressed")
    page.evaluate("window.dispatchEvent(new Event('blur'))")
    page.wait_for_selector("#pad .pressed", state="detached")
    page.wait_for_selector("#go:visible")
    assert "the page is not in front" in page.inner_text("#detail")


def test_fingers_play_on_a_phone(cliff_server, records, opened):
    page = opened(cliff_server, "phone")
    page.tap("#go")
    page.wait_for_selector("#overlay", state="hidden")
    for k, name in enumerate(["up", "right", "right"]):
        page.tap(f"#pad .{name}")
        expect_step(page, k + 1)
    assert {row["device"] for row in rows_of(records)} == {"touch"}
    for button in page.query_selector_all("button:visible"):
        box = present(button.bounding_box())
        assert min(box["width"], box["height"]) >= 44


GAMEPAD = """
window.pressed = [];
navigator.getGamepads = () => [{
  axes: [0, 0],
  buttons: Array.from({length: 17}, (_, number) => ({pressed: window.pressed.includes(number)})),
}];
"""


def test_a_gamepad_plays(cliff_server, records, opened):
    page = opened(cliff_server, before=GAMEPAD)
    begin(page)
    for step, button in [(1, 12), (2, 15)]:
        page.evaluate(f"window.pressed = [{button}]")
        expect_step(page, step)
        page.evaluate("window.pressed = []")
        page.wait_for_selector("#pad .pressed", state="detached")
    rows = rows_of(records)
    assert [(row["device"], row["proposed"]) for row in rows] == [("gamepad", 0), ("gamepad", 1)]


def test_a_gamepad_flies_the_lander(lander_server, records, opened):
    page = opened(lander_server, before=GAMEPAD)
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")
    page.evaluate("window.pressed = [12]")
    page.wait_for_function(SINCE, arg=20)
    page.evaluate("window.pressed = []")
    page.wait_for_selector("#pad .pressed", state="detached")
    page.click("#pause")
    page.wait_for_selector("#go:visible")
    rows = [row for row in rows_of(records) if row["device"] == "gamepad"]
    assert len(rows) > 5
    assert {row["proposed"] for row in rows} <= {0, 2}
    assert 2 in {row["proposed"] for row in rows}


def test_the_keys_are_said_before_the_first_episode(lander_server, opened):
    page = opened(lander_server)
    assert "Keys: ← left, ↑ main, → right, ↓ nothing." in page.inner_text("#detail")


def test_a_reload_goes_on_in_mid_episode(cliff_server, opened):
    page = opened(cliff_server)
    begin(page)
    walk(page, KEYS[:6])
    page.reload()
    expect_step(page, 6)
    page.wait_for_selector("#overlay", state="hidden")
    walk(page, KEYS[6:])
    page.wait_for_selector("#go:visible")
    assert page.inner_text("#return") == "87"


def test_the_page_survives_a_killed_server(tmp_path, opened):
    out = tmp_path / "records"
    arguments = ["cliff-walking", "--assistant", "maximal", "--out", str(out)]
    with process(*arguments) as server:
        page = opened(server.address)
        begin(page)
        walk(page, KEYS[:4])
        server.kill()
        page.wait_for_selector("#overlay:visible")
        assert page.inner_text("#headline") == "Connection lost"
        page.keyboard.press("ArrowUp")  # not lost in the dark: nothing is played meanwhile
        server.start()
        page.wait_for_selector("#overlay", state="hidden", timeout=20_000)
        expect_step(page, 4)
        walk(page, KEYS[4:])
        page.wait_for_selector("#go:visible")
    assert [len(episode.steps) for episode in played(out / "play.sqlite")] == [13]


def test_a_second_tab_takes_over_and_the_first_says_so(cliff_server, opened, open_in):
    first = opened(cliff_server)
    begin(first)
    walk(first, KEYS[:3])
    second = open_in(first.context, cliff_server)
    expect_step(second, 3)
    first.wait_for_selector("#go:visible")
    assert first.inner_text("#headline") == "Played elsewhere"
    walk(second, KEYS[3:4])
    first.bring_to_front()
    first.click("#go")
    expect_step(first, 4)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", WIDTHS)
def test_the_page_is_accessible_and_fits(cliff_server, opened, device, scheme):
    if not AXE.is_file():
        pytest.skip("axe-core is not installed: .ci/install_browser")
    page = opened(cliff_server, device, scheme, reduced_motion="reduce")
    assert violations(page) == []
    page.select_option("#assistant", "maximal")
    page.check("#assisted")
    begin(page)
    walk(page, ["ArrowRight"])
    assert violations(page) == []
    walk(page, KEYS[1:])
    page.wait_for_selector("#go:visible")
    page.click("#episodes summary")
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.get_attribute("#words", "aria-live") == "polite"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", WIDTHS)
def test_pictures_of_the_page_have_the_colours_of_its_scheme(
    lander_server, opened, tmp_path, device, scheme
):
    from PIL import Image

    page = opened(lander_server, device, scheme)
    page.click("#go")
    page.wait_for_selector("#overlay", state="hidden")
    page.click("#pause")
    page.wait_for_selector("#go:visible")
    page.screenshot(path=tmp_path / "page.png")
    with Image.open(tmp_path / "page.png") as picture:
        assert picture.width == WIDTHS[device]
        corner = picture.convert("L").getpixel((2, picture.height - 2))
    assert isinstance(corner, int)
    assert (corner > 200) == (scheme == "light")
