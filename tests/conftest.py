"""What every test shares."""

import pytest
from hypothesis import settings

from qbumpers.assistants import registry

# Compiled code is slow once, when it compiles; examples are the same in every run.
settings.register_profile("qbumpers", deadline=None, derandomize=True)
settings.load_profile("qbumpers")


@pytest.fixture
def own_registry(monkeypatch):
    """Rules registered by a test are forgotten when it ends."""
    monkeypatch.setattr(registry, "_rules", dict(registry._rules))
    monkeypatch.setattr(registry, "_rules_by_options", dict(registry._rules_by_options))
