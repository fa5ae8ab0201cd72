"""A card is held to the processor, step by step and at full size: `make test-gpu` runs these."""

import importlib.util
import os

import numpy as np
import pytest

from qbumpers import make_assistant, simulate
from qbumpers.errors import RequestError
from qbumpers.simulation import device_of, run
from tests.assistants.examples import EXAMPLES
from tests.simulation.cuda import cases
from tests.simulation.cuda.cases import OF_STATES, SEED

pytestmark = pytest.mark.gpu

MOST_PARTING = {"two-rate": 0.25}
"""Share of trials, 0.03 if nothing is said. Products that are fused with a sum round otherwise, and
once in some learners two values are equal on the processor and not on the card, or the other way
round; a value of `two-rate` is a sum of two, each of which is such a sum."""


@pytest.fixture(scope="module", autouse=True)
def card():
    if importlib.util.find_spec("numba_cuda") is None or os.environ.get("NUMBA_ENABLE_CUDASIM"):
        pytest.skip("there is no extra gpu here, or a simulated card")
    try:
        return device_of("gpu")
    except RequestError as error:
        pytest.skip(str(error))


def parting(condition, trials, card):
    """Share of trials in which a step is another one than on the processor, above what may be."""
    from qbumpers.simulation.cuda.agreement import agreement

    found = agreement(condition, trials, SEED, card)
    return found.parted / trials - MOST_PARTING.get(condition.learner_type.name, 0.03)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_rule_takes_the_same_steps(name, card):
    assert parting(cases.with_rule(name), 200, card) <= 0


@pytest.mark.parametrize("name", OF_STATES)
def test_a_learner_takes_the_same_steps(name, card):
    assert parting(cases.with_learner(name, episodes=20), 200, card) <= 0


def test_ten_thousand_learners_take_the_same_steps(card):
    assert parting(cases.with_learner("q-learning", episodes=20), 10_000, card) <= 0


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_means_agree_within_their_errors(precision, card):
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7)
    on_card = simulate(
        "cliff-walking", bumpers, trials=10_000, seed=SEED, device="gpu", precision=precision
    )
    here = simulate("cliff-walking", bumpers, trials=10_000, seed=SEED + 1)
    for name in ("assisted_return", "unassisted_return", "overrides"):
        one, other = (getattr(each.outcomes, name).mean(axis=1) for each in (on_card, here))
        error = np.sqrt((one.var() + other.var()) / len(one))
        assert abs(one.mean() - other.mean()) < 4 * error


@pytest.mark.parametrize(
    "register",
    [cases.register_wrong_action, cases.register_wrong_probability, cases.register_raising],
)
def test_what_is_raised_in_a_trial_is_raised_as_on_the_processor(register, card):
    condition = cases.with_learner("q-learning")._replace(assistant=register())
    with pytest.raises((RequestError, ValueError)) as expected:
        run(condition, trials=100, seed=SEED)
    with pytest.raises(expected.type) as found:
        run(condition, trials=100, seed=SEED, card=card)
    assert str(found.value) == str(expected.value)
