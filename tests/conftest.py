"""What every test shares."""

import shutil
import signal
import sys

import pytest
from hypothesis import settings

from qbumpers import cli
from qbumpers.assistants import registry
from qbumpers.learners import registry as learners
from tests.browsing import FLAGS
from tests.texts import plain

# Compiled code is slow once, when it compiles; examples are the same in every run.
settings.register_profile("qbumpers", deadline=None, derandomize=True)
settings.load_profile("qbumpers")


def _registries_of_its_own(monkeypatch):
    for module, names in (
        (registry, ("_rules", "_rules_by_options")),
        (learners, ("_learners", "_learners_by_settings")),
    ):
        for name in names:
            monkeypatch.setattr(module, name, dict(getattr(module, name)))


@pytest.fixture(autouse=True)
def own_registry(monkeypatch):
    """Rules and learners registered by a test are forgotten when it ends."""
    _registries_of_its_own(monkeypatch)


@pytest.fixture(autouse=True)
def signals_stay():
    """A test leaves the interrupt as it found it: blocked, it would end nothing any more."""
    yield
    if hasattr(signal, "pthread_sigmask"):
        assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.fixture(scope="module")
def own_registry_of_module():
    """Rules and learners registered by a test module are forgotten when it ends."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        _registries_of_its_own(monkeypatch)
        yield


@pytest.fixture(scope="session")
def browser():
    """Chromium, one for all tests: a thread cannot drive two."""
    found = shutil.which("chromium")
    if found is None:
        pytest.skip("chromium is not installed: .ci/install_browser")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=found, headless=True, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture
def call(monkeypatch, capsys):
    """Run the command with arguments; its exit status, output and errors, spaces collapsed."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["qbumpers", *map(str, arguments)])
        with pytest.raises(SystemExit) as leaving:
            cli.main()
        output, errors = capsys.readouterr()
        assert "Traceback" not in output + errors
        return leaving.value.code or 0, plain(output), plain(errors)

    return run
