"""What every test shares."""

import sys

import pytest
from hypothesis import settings

from qbumpers import cli
from qbumpers.assistants import registry
from qbumpers.learners import registry as learners
from tests.texts import plain

# Compiled code is slow once, when it compiles; examples are the same in every run.
settings.register_profile("qbumpers", deadline=None, derandomize=True)
settings.load_profile("qbumpers")


@pytest.fixture
def own_registry(monkeypatch):
    """Rules and learners registered by a test are forgotten when it ends."""
    monkeypatch.setattr(registry, "_rules", dict(registry._rules))
    monkeypatch.setattr(registry, "_rules_by_options", dict(registry._rules_by_options))
    for name in ("_learners", "_learners_by_settings"):
        monkeypatch.setattr(learners, name, dict(getattr(learners, name)))


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
