"""Three minutes of `make soak`."""

import pytest

from tests.study.soak import STORES, soak


@pytest.mark.slow
@pytest.mark.parametrize("kind", STORES)
def test_nothing_is_lost_or_doubled_whatever_fails(kind):
    line, found = soak(kind, 1.5)
    assert found == [], line
