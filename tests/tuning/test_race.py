"""When the conditions of a race are compared."""

import pytest

from qbumpers.tuning.race import looks


@pytest.mark.parametrize(
    ("trials", "expected"),
    [
        (1000, [50, 100, 200, 400, 800, 1000]),
        (160, [8, 16, 32, 64, 128, 160]),
        (16, [8, 16]),
        (8, [8]),
        (2, [2]),
    ],
)
def test_looks_double_from_a_twentieth_to_all_trials(trials, expected):
    assert looks(trials) == expected
