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
