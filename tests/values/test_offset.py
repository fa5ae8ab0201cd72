"""Values by numbers that count from 0."""

import numpy as np

from qbumpers.values.offset import OffsetValues


def test_zero_is_the_first_number():
    class Squares:
        others = {"cubes": lambda state: np.array([state**3])}  # noqa: RUF012

        def __call__(self, state):
            return np.array([state**2])

    found = OffsetValues(Squares(), 5)
    assert [found(0)[0], found(2)[0]] == [25, 49]
    assert found.others["cubes"](1)[0] == 216
    assert OffsetValues(lambda state: state, 1).others == {}
