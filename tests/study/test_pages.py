"""Every page that a participant or the researcher can see, looked at by axe."""

import contextlib

import pytest

from tests.browsing import AXE
from tests.play.serving import RIGHT
from tests.study.browsing import check_page, go, heading
from tests.study.flow.studies import CHECK, Participant, block, served_study, study_of

pytestmark = pytest.mark.study

if not AXE.is_file():
    pytest.skip("axe-core is not installed: .ci/install_browser", allow_module_level=True)

LISTED = {
    "by": "class",
    "class_list": ["ab12", "cd34"],
    "codes": {"complete": "C-1", "screened_out": "S-1", "failed": "F-1", "no_consent": "N-1"},
}
HELPED = [{"name": "helped", "assistant": "maximal", "overrides": "explained", "cap": 1}]


@pytest.fixture(params=[("desktop", "light"), ("phone", "dark")], ids=["desktop", "phone"])
def page(request, open_page):
    return open_page(*request.param)


@pytest.fixture
def served(tmp_path):
    """Serves a study whose participants come with a code."""
    with contextlib.ExitStack() as serving:

        def served(*parts, **more):
            study = study_of(*parts, recruitment=LISTED, conditions=HELPED, **more)
            return serving.enter_context(served_study(study, tmp_path / "pilot.sqlite"))

        yield served


def come(page, address, code="ab12"):
    page.goto(f"http://{address}/?code={code}")


def begin_training(page, address):
    """Come, agree, and begin to play in the block called Training."""
    come(page, address)
    go(page)
    heading(page, "Training")
    page.click("#choices button.primary")
    page.wait_for_selector("#overlay", state="hidden")


def end(page, text, code=""):
    """The last page, which says why, with its code or none."""
    heading(page, "The study has ended")
    assert text in page.inner_text("#text")
    assert page.locator(".code").all_inner_texts() == ([f"Your code: {code}"] if code else [])


def test_a_code_is_asked_for_and_a_wrong_one_is_said_to_be(page, served):
    address, _ = served(block("training"))
    page.goto(f"http://{address}/")
    heading(page, "Enter your code")
    page.fill("#own-code", "zz99")
    go(page)
    page.wait_for_selector("#text p:not(:empty)")
    heading(page, "Enter your code")
    assert "This link is not one of the study" in page.inner_text("#text")
    page.fill("#own-code", "ab12")
    page.press("#own-code", "Enter")
    heading(page, "Consent")


@pytest.mark.parametrize("within_days", [1.0, 1e-9])
def test_a_later_sitting_too_early_and_too_late(page, served, within_days):
    after_days = 0.0 if within_days < 1 else 1.0
    sitting = {"kind": "sitting", "after_days": after_days, "within_days": within_days}
    address, _ = served(block("training"), sitting, block("retention"))
    with Participant(address, arrival={"code": "ab12"}) as before:
        before.enter()
        before.go(agree=True)
        before.rest()
    come(page, address)
    if within_days < 1:
        end(page, "The time for this part of the study has passed")
    else:
        heading(page, "Until next time")
        assert "Come back between" in page.inner_text("#text")
        assert page.inner_text(".code") == "Your code: C-1"


def test_was_that_you_is_asked_over_the_game(page, served, monkeypatch):
    monkeypatch.setattr("qbumpers.study.flow.blocks._ASKED_IF_OVERRIDDEN", 1.0)
    address, host = served(block("training", attribution=1))
    begin_training(page, address)
    check_page(page, "playing")
    page.keyboard.press("ArrowRight")
    page.wait_for_function(
        "() => document.getElementById('headline').textContent.endsWith('Was that you?')"
    )
    assert page.locator("#choices button").all_inner_texts() == [
        "That was me", "That was the assistant", "I cannot tell",
    ]  # fmt: skip
    assert page.is_hidden("#override")  # it would lie over the question
    board, sheet = (page.locator(part).bounding_box() for part in ("#board", ".sheet"))
    assert board["y"] <= sheet["y"]
    assert sheet["y"] + sheet["height"] <= board["y"] + board["height"]
    check_page(page, "was that you?")
    page.click("#choices button:nth-child(2)")
    page.wait_for_selector("#overlay", state="hidden")
    [visit] = host.visits.values()
    assert visit.now.condition == "helped"


def test_a_task_in_real_time_is_paused(page, served):
    address, _ = served(block("training"), task="lunar-lander", step_limit=1000)
    begin_training(page, address)
    check_page(page, "in real time")
    page.click("#pause")
    page.wait_for_selector("#overlay:visible")
    assert page.inner_text("#headline") == "Paused"
    check_page(page, "paused")


def test_scales_numbers_and_the_keyboard_that_is_needed(page, served):
    address, _ = served(
        {"kind": "device-check", "keyboard": True},
        {"kind": "questionnaire", "instrument": "trust"},
        {"kind": "questionnaire", "instrument": "background"},
        block("training"),
    )
    come(page, address)
    go(page)
    heading(page, "Checking your device")
    page.wait_for_function(
        "() => document.getElementById('text').textContent.includes('Press any key')"
    )
    check_page(page, "press any key")
    page.keyboard.press("a")
    go(page)
    heading(page, "Some questions")
    go(page)
    assert page.locator(".wrong:visible").count() == 4
    check_page(page, "unanswered")
    for group in page.get_by_role("group").all():
        group.get_by_label("4", exact=True).check()
    go(page)
    page.wait_for_selector("input[type=number]")
    heading(page, "Some questions")


def test_who_does_not_agree(page, served):
    come(page, served(block("training"))[0])
    heading(page, "Consent")
    page.click("#form button:not(.primary)")
    end(page, "nothing was kept of you", "N-1")


def test_who_is_screened_out(page, served):
    come(page, served({"kind": "device-check", "least_width": 9000}, block("training"))[0])
    go(page)
    heading(page, "Checking your device")
    go(page)
    end(page, "This device or connection does not suit the study", "S-1")


def test_who_fails_the_questions(page, served):
    come(page, served({**CHECK, "attempts": 1}, block("training"))[0])
    go(page)
    heading(page, "Before you begin")
    page.get_by_label("3").check()
    go(page)
    end(page, "The questions were not answered rightly", "F-1")


def test_who_comes_when_the_study_is_full(page, served):
    address, _ = served(block("training"))
    with Participant(address, arrival={"code": "cd34"}) as first:
        first.enter()
        first.go(agree=True)
        come(page, address)
        go(page)
        end(page, "The study has all participants that it needs", "S-1")


def test_who_comes_back_although_they_may_not(page, served):
    address, _ = served({"kind": "instructions", "text": "Read."}, block("training"),
                        returning={"policy": "block"})  # fmt: skip
    come(page, address)
    go(page)
    heading(page, "Instructions")
    go(page)
    heading(page, "Training")
    page.reload()
    end(page, "The study was left, and cannot be gone on with")


def test_a_page_whose_place_was_taken(page, served):
    address, _ = served(block("training"))
    come(page, address)
    heading(page, "Consent")
    with Participant(address, arrival={"code": "ab12"}) as other:
        other.enter()
        heading(page, "The study has stopped.")
    go(page)
    heading(page, "Consent")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", ["desktop", "phone"])
def test_the_researcher_sees_learning_curves(open_page, tmp_path, device, scheme):
    study = study_of(block("training", 3, probe_every=1))
    with served_study(study, tmp_path / "pilot.sqlite") as (address, host):
        for number in range(4):
            with Participant(address) as one:
                one.enter()
                one.go(agree=True)
                for episode in range(6):
                    one.episode(episode, RIGHT if number < 2 else 0)
                one.go(untrusted=0, blurs=0)
                one.go()
        page = open_page(device, scheme)
        page.goto(f"http://{address}/researcher")
        page.fill("#token", host.token)
        page.click("#form button")
        page.wait_for_selector("#curves canvas")
        assert "drop-out 0 %" in page.inner_text("#summary")
        page.click("summary")
        rows = page.locator("#numbers tbody tr")
        assert rows.count() == 2 * 6
        names = set(page.locator("#curves .u-legend .u-label").all_inner_texts())
        for condition in ("alone", "helped"):
            assert {f"{condition}, assisted", f"{condition}, probe"} <= names
        check_page(page, "learning curves")
