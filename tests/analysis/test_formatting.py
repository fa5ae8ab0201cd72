"""Numbers as readers see them."""

import numpy as np
import pytest

from qbumpers.analysis.formatting import decimals_for
from qbumpers.analysis.statistics import mean_interval


@pytest.mark.parametrize(
    ("low", "high", "digits"),
    [(0.71, 0.73, 3), (-4.0, 9.0, 1), (5.0, 5.0, 1), (None, None, 1), (0.9, 1.2, 1)],
)
def test_narrow_intervals_have_more_decimals(low, high, digits):
    assert decimals_for(low, high) == digits


@pytest.mark.parametrize("trials", [6, 8, 10])
def test_equal_returns_have_no_more_decimals_however_their_mean_is_rounded(trials):
    found = mean_interval(np.full(trials, 235.4773847239))
    assert decimals_for(found.low, found.high) == 1
