"""Returns at a share of overridden steps, against mixtures of people."""

import numpy as np
import pytest

from qbumpers.comparison.matched import at_share

POINTS = np.array([[0.5, 80.0, -100.0], [0.1, 20.0, -20.0], [0.3, 60.0, -40.0]])


@pytest.mark.parametrize("weight", [0.0, 0.25, 0.8, 1.0])
def test_it_is_what_a_mixture_of_two_neighbouring_settings_gets(weight):
    share, *returns = weight * POINTS[1] + (1 - weight) * POINTS[2]
    assert at_share(POINTS, share) == pytest.approx(returns)


@pytest.mark.parametrize("share", [0.05, 0.51])
def test_nothing_is_assumed_beyond_the_settings(share):
    assert np.isnan(at_share(POINTS, share)).all()


@pytest.mark.parametrize("row", range(3))
def test_a_setting_itself_is_met_exactly(row):
    assert at_share(POINTS, POINTS[row, 0]).tolist() == POINTS[row, 1:].tolist()


def test_it_is_numpys_interpolation_for_any_number_of_resamples():
    generator = np.random.default_rng(1)
    points = generator.random((50, 6, 3))
    found = at_share(points, 0.4)
    for one, expected in zip(points, found, strict=True):
        order = one[one[:, 0].argsort()]
        columns = [
            np.interp(0.4, order[:, 0], order[:, column], left=np.nan, right=np.nan)
            for column in (1, 2)
        ]
        assert expected == pytest.approx(np.array(columns), nan_ok=True)
    assert np.isnan(found).any(axis=1).sum() < 50


def test_settings_of_one_share_are_no_division_by_zero():
    equal = np.array([[0.2, 1.0, 2.0], [0.2, 3.0, 4.0]])
    assert at_share(equal, 0.2).tolist() == [1, 2]
