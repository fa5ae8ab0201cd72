"""Random situations whose arithmetic is exact, so that any correct reading of a rule agrees."""

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from qbumpers.decisions import Model, Noise, Situation, Step

PROBABILITY_TOLERANCE = 1e-12
"""Two ways to write the logistic differ by a few units in the last place."""


def fractions(low, high, denominator):
    """Multiples of 1 / denominator, a power of two: sums and products are not rounded."""
    return st.integers(low * denominator, high * denominator).map(lambda n: n / denominator)


def situation_of(values, proposed, earned=0.0, discount=1.0, start_value=3.0):
    """A situation in state 0 at the first step, of a rule without further values."""
    values = np.array(values, float)
    return Situation(
        state=0, values=values, others=np.zeros((0, len(values))), proposed=proposed,
        earned=earned, discount=discount, start_value=start_value, episode=0, step=0,
    )  # fmt: skip


def step_of(situation, executed, *, undone=False, **changes):
    """The record of a step of that situation, which paid -1 and led to state 1."""
    step = Step(
        episode=situation.episode, state=situation.state, proposed=situation.proposed,
        executed=executed, undone=undone, credited=situation.proposed,
        overridden=executed != situation.proposed or undone, probability=1.0, coin=0.5, tie=0.5,
        values=situation.values, projected_return=1.0, reward=-1.0, next_state=1, events=0,
    )  # fmt: skip
    return step._replace(**changes)


def model_of(actions=3, states=5):
    """What a rule with memory may know of some task."""
    return Model(states, 0, actions, -1, 0.9, None, 1 - np.eye(actions))


noises = st.builds(
    Noise, coin=st.floats(0, 1, exclude_max=True), tie=st.floats(0, 1, exclude_max=True)
)


@st.composite
def situations(draw):
    # Few distinct values in some examples, so that ties are common.
    widest = draw(st.sampled_from([1, 100]))
    values = draw(st.lists(fractions(-widest, widest, 4), min_size=1, max_size=5))
    return situation_of(
        values,
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
