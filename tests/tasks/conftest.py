"""What tests of tasks share."""

import pytest

from qbumpers.tasks import registry


@pytest.fixture
def own_tasks(monkeypatch):
    """Tasks registered by a test are forgotten when it ends."""
    monkeypatch.setattr(registry, "_tasks", dict(registry._tasks))
