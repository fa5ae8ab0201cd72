"""How far the settings of one method lie above and to the right of another's."""

import numpy as np
import pytest

from qbumpers.analysis.frontier import beaten_share, lead


def test_shares_beaten_are_those_of_counting():
    generator = np.random.default_rng(5)
    ours, theirs = generator.integers(0, 4, (2, 7, 6, 2)).astype(float)
    found = beaten_share(ours, theirs)
    for world in range(7):
        beaten = [
            any((own >= other).all() and (own > other).any() for own in ours[world])
            for other in theirs[world]
        ]
        assert found[world] == np.mean(beaten)


def test_a_lead_is_read_off_between_neighbouring_settings():
    ours = np.array([[100.0, 50.0], [200.0, 0.0]])
    theirs = np.array([[150.0, 0.0], [120.0, 20.0], [250.0, -10.0]])
    # At 150 ours have 25, at 120 they have 40; 250 is out of reach.
    assert lead(ours, theirs, 0) == pytest.approx((25 + 20) / 2)
    # At an unassisted 0 ours have 200, at 20 they have 160, at -10 at least 200.
    assert lead(ours, theirs, 1) == pytest.approx((50 + 40 - 50) / 3)
    assert np.isnan(lead(ours, np.array([[300.0, 0.0]]), 0))
