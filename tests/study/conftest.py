"""What tests of playing share; without the extra `study` there are none."""

import importlib.util

import pytest

LIBRARIES = ("starlette", "uvicorn", "websockets", "msgspec", "sqlalchemy", "itsdangerous")
MISSING = [name for name in LIBRARIES if importlib.util.find_spec(name) is None]

if MISSING:
    collect_ignore_glob = ["test_*.py"]


def pytest_report_header():
    if MISSING:
        return f"tests/study is left out: pip install 'qbumpers[study]' for {', '.join(MISSING)}"
    return None


@pytest.fixture(scope="session")
def cliff():
    from qbumpers.study.setup import Setup

    return Setup("cliff-walking")


@pytest.fixture(scope="session")
def lander():
    from qbumpers.study.setup import Setup

    return Setup("lunar-lander")


@pytest.fixture(scope="session")
def postgresql():
    """A PostgreSQL server that no test stops."""
    from tests.study.postgresql import database

    with database() as running:
        yield running


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.study)])
def store(request, tmp_path):
    """Where records may be, empty: a file, or a database of its own."""
    if request.param == "sqlite":
        return str(tmp_path / "folder" / "play.sqlite")
    return request.getfixturevalue("postgresql").new()
