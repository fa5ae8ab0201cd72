"""What tests of playing share; without the extra `study` there are none."""

import importlib.util

import pytest

from tests.play.browsing import WIDTHS

LIBRARIES = ("starlette", "uvicorn", "websockets", "msgspec", "sqlalchemy", "itsdangerous")
MISSING = [name for name in LIBRARIES if importlib.util.find_spec(name) is None]

if MISSING:
    collect_ignore_glob = ["test_*.py"]


def pytest_report_header():
    if MISSING:
        return f"tests/play is left out: pip install 'qbumpers[study]' for {', '.join(MISSING)}"
    return None


@pytest.fixture(scope="session")
def cliff():
    from qbumpers.play.setup import Setup

    return Setup("cliff-walking")


@pytest.fixture(scope="session")
def lander():
    from qbumpers.play.setup import Setup

    return Setup("lunar-lander")


LOST = ("ERR_CONNECTION", "ERR_SOCKET_NOT_CONNECTED")


@pytest.fixture
def opened(pages):
    """Opens a page in a browser of its own."""
    return pages[0]


@pytest.fixture
def open_in(pages):
    """Opens one more page in the browser of another."""
    return pages[1]


@pytest.fixture
def pages(browser):
    """Opens pages; whatever goes wrong in one is an error of the test."""
    wrong, contexts = [], []

    def open_page(address, device="desktop", scheme="light", before="", **options):
        height = 860 if device == "desktop" else 844
        context = browser.new_context(
            viewport={"width": WIDTHS[device], "height": height}, color_scheme=scheme,
            has_touch=device == "phone", **options,
        )  # fmt: skip
        contexts.append(context)
        if before:
            context.add_init_script(before)
        return open_in(context, address)

    def open_in(context, address):
        page = context.new_page()
        page.set_default_timeout(15_000)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: said.type == "error" and wrong.append(said.text))
        page.goto(f"http://{address}/")
        page.wait_for_selector("#task:not(:empty)")
        return page

    yield open_page, open_in
    for context in contexts:
        context.close()
    # A server that is gone is what some tests are about.
    assert [text for text in wrong if not any(lost in text for lost in LOST)] == []


@pytest.fixture(scope="session")
def postgresql():
    """A PostgreSQL server that no test stops."""
    from tests.play.postgresql import database

    with database() as running:
        yield running


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.study)])
def store(request, tmp_path):
    """Where records may be, empty: a file, or a database of its own."""
    if request.param == "sqlite":
        return str(tmp_path / "folder" / "play.sqlite")
    return request.getfixturevalue("postgresql").new()
