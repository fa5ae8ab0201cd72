"""How numbers look on the command line."""

import pytest

from qbumpers.cli.console import interval


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        ((51.25, 50.0, 52.5), "51.2 ± 1.2"),
        ((51.25, None, None), "51.2"),
        ((51.25, float("nan"), float("nan")), "51.2"),
        ((None, None, None), "-"),
    ],
)
def test_a_mean_is_shown_with_what_is_known_of_it(numbers, shown):
    assert interval(*numbers) == shown
