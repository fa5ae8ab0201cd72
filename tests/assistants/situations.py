"""Random situations whose arithmetic is exact, so that any correct reading of a rule agrees."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from qbumpers.decisions import Noise, Situation

PROBABILITY_TOLERANCE = 1e-12
"""Two ways to write the logistic differ by a few units in the last place."""


def fractions(low, high, denominator):
    """Multiples of 1 / denominator, a power of two: sums and products are not rounded."""
    return st.integers(low * denominator, high * denominator).map(lambda n: n / denominator)


noises = st.builds(
    Noise, coin=st.floats(0, 1, exclude_max=True), tie=st.floats(0, 1, exclude_max=True)
)


@st.composite
def situations(draw):
    # Few distinct values in some examples, so that ties are common.
    widest = draw(st.sampled_from([1, 100]))
    values = draw(st.lists(fractions(-widest, widest, 4), min_size=1, max_size=5))
    return Situation(
        np.array(values),
        proposed=draw(st.integers(0, len(values) - 1)),
        earned=draw(fractions(-100, 100, 4)),
        discount=draw(st.sampled_from([1.0, 0.5, 0.125])),
        start_value=draw(fractions(1, 100, 4)),
    )


def assert_decides(rule, situation, noise, options, expected):
    """The rule, compiled and as source, makes the expected (action, probability) decision."""
    action, probability = expected
    assume(abs(noise.coin - probability) > 1e-9 or probability in (0, 1))
    for function in (rule, rule.py_func):
        decision = function(situation, noise, options)
        assert decision.action == action
        assert abs(decision.probability - probability) <= PROBABILITY_TOLERANCE


def assert_overrides_only_by_better(rule, situation, noise, options):
    """Whatever is executed in place of the proposal is strictly better than it."""
    action = rule(situation, noise, options).action
    values = situation.values
    assert action == situation.proposed or values[action] > values[situation.proposed]
