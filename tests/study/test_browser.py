"""The example study in a real browser, from consent to completion, at both sizes; and its data."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import qbumpers
from tests.browsing import WIDTHS
from tests.study.browsing import DONE, Server, check_page, go, heading, play
from tests.study.outcomes.psych_ds_rules import violations

pytestmark = pytest.mark.study

EXAMPLE = Path(__file__).parents[2] / "examples" / "study.toml"


@pytest.fixture
def example(tmp_path):
    """The example study, shortened, with a link to go back to."""
    text = EXAMPLE.read_text(encoding="utf-8")
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


def go_through(server, page, device, strategy):
    """The example from consent to the way back; the server is killed in its middle."""
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
    page.get_by_label("How did you find your way?").fill(strategy)
    page.get_by_label("sometimes").check()
    go(page)
    heading(page, "Thank you")
    go(page)
    heading(page, "The study is complete")
    assert page.inner_text(".code") == "Your code: C1"
    page.click("a.button")
    page.wait_for_url(f"{DONE}?cc=C1")


STRATEGIES = {"desktop": "along the upper edge", "phone": "by counting moves"}
"""What each participant says, to be looked for in the data."""


def test_the_example_from_consent_to_the_way_back_and_its_data(
    server, open_page, example, tmp_path, call
):
    for device, scheme in [("desktop", "light"), ("phone", "dark")]:
        go_through(server, open_page(device, scheme), device, STRATEGIES[device])
    server.kill()
    records, exported = tmp_path / "records", tmp_path / "exported"
    to = ["--mode", "pilot", "--folder", records, "--out", exported]
    status, said, error = call("study", "export", example, *to)
    assert (status, "2 complete ones for: qbumpers report" in said) == (0, True), said + error
    check_data(exported, people=2)
    assert call("report", exported)[0] == 0
    forgotten = participant_who_said(exported, STRATEGIES["desktop"])
    traces = [forgotten.encode(), STRATEGIES["desktop"].encode()]
    assert all(trace in bytes_under(records) for trace in traces)
    status, said, _ = call(
        "study", "forget", example, forgotten, "--mode", "pilot", "--out", records
    )
    assert (status, f"written anew without them: {exported}" in said) == (0, True)
    for folder in (records, exported):
        assert [trace for trace in traces if trace in bytes_under(folder)] == []
    assert not (exported / "report.html").exists()
    check_data(exported, people=1)
    assert STRATEGIES["phone"].encode() in bytes_under(exported)
    assert call("report", exported)[0] == 0
    assert (exported / "report.html").is_file()


def check_data(exported, people):
    """The data set follows its specification; each participant has 2 pairs and 3 tests."""
    assert violations(exported / "dataset") == []
    results = qbumpers.load(exported)
    assert results.experiment.of_participants
    assert len(results.conditions) == people
    assert results.episodes.height == people * (2 + 3)


def participant_who_said(exported, text):
    [table] = (exported / "dataset" / "data").glob("*questionnaires_data.csv")
    [line] = [row for row in table.read_text(encoding="utf-8").splitlines() if text in row]
    return line.partition(",")[0]


def bytes_under(folder):
    return b"".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())


def test_withdrawing_is_asked_twice_and_deletes(server, open_page):
    page = open_page()
    page.goto(f"http://{server.address}/")
    go(page)
    heading(page, "Instructions")
    page.click("#withdraw")
    check_page(page, "withdraw?")
    page.click("#stay")
    page.click("#withdraw")
    page.click("#leave")
    heading(page, "The study has ended")
    assert "Your data were deleted" in page.inner_text("#text")
    page.reload()
    heading(page, "Consent")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("device", WIDTHS)
def test_the_researcher_sees_who_is_where(server, open_page, device, scheme):
    participant, page = open_page(), open_page(device, scheme)
    participant.goto(f"http://{server.address}/")
    go(participant)
    heading(participant, "Instructions")
    page.goto(f"http://{server.address}/researcher")
    check_page(page, "token")
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
    check_page(page, "overview")
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
