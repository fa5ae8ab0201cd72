"""What tests of studies share; without the extra `study` there are none."""

import pytest

from tests.browsing import WIDTHS
from tests.play.conftest import MISSING
from tests.study.browsing import DONE

if MISSING:
    collect_ignore_glob = ["test_*.py", "*/test_*.py"]

EXPECTED = ("ERR_CONNECTION", "403")
"""A server that is gone is what some tests are about; a wrong token is refused."""


@pytest.fixture
def open_page(browser):
    """Opens pages; whatever goes wrong in one is an error of the test."""
    wrong, contexts = [], []

    def open_page(device="desktop", scheme="light"):
        height = 860 if device == "desktop" else 844
        context = browser.new_context(
            viewport={"width": WIDTHS[device], "height": height}, color_scheme=scheme,
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
    assert [text for text in wrong if not any(each in text for each in EXPECTED)] == []
