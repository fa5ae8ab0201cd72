"""Learners that Numba cannot compile learn the same; what is no learner is refused."""

import functools
from typing import NamedTuple

import numpy as np
import pytest

from qbumpers import RequestError, simulate
from qbumpers.learners import learner_for_settings, register_learner
from qbumpers.tasks import cliff_walking
from tests.learners.own_learners import (
    Averaging,
    always_best,
    average,
    best,
    first_values,
    prefer_best,
)

pytestmark = pytest.mark.usefixtures("own_registry")

FUNCTIONS = {
    "start": first_values,
    "choose": best,
    "prefer": prefer_best,
    "policy": always_best,
    "learn": average,
}


def returns_of(settings_type, **settings):
    learner = settings_type(**settings)
    found = simulate(cliff_walking(), "none", learner=learner, trials=1, episodes=3)
    return found.outcomes.assisted_return.tolist()


class Listed(NamedTuple):
    discount: float = 1.0
    step_size: float = 0.5
    hopes: float = 0.0
    notes: list[str] = ["as users write it"]  # noqa: RUF012


def test_a_learner_that_cannot_be_compiled_learns_the_same():
    expected = returns_of(register_learner("compiled", Averaging, **FUNCTIONS), hopes=2.0)
    with pytest.warns(UserWarning, match=r"'listed' cannot .* of the type list\[str\]") as said:
        listed = register_learner("listed", Listed, **FUNCTIONS)
    assert len(said) == 1
    with pytest.warns(UserWarning, match="'partial' cannot be compiled"):
        partial = register_learner(
            "partial", Averaging, **{**FUNCTIONS, "choose": functools.partial(best)}
        )
    for kind in (listed, partial):
        assert not learner_for_settings(kind).compiled
        assert returns_of(kind, hopes=2.0) == expected


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"choose": lambda settings, memory: 0}, r"'own': choose takes \(settings, memory\)"),
        ({"learn": lambda: None}, r"called with \(settings, memory, transition, rates, stream\)"),
        ({"begin": lambda settings: 0}, r"begin takes \(settings\)"),
        ({"prefer": None}, "prefer is None; a function of"),
        ({"observes": "pictures"}, "'pictures'.*Known: states, vectors"),
    ],
)
def test_functions_of_other_arguments_are_refused_when_they_are_registered(changes, message):
    with pytest.raises(RequestError, match=message):
        register_learner("own", Averaging, **{**FUNCTIONS, **changes})


@pytest.mark.parametrize("which", ["choose", "prefer"])
@pytest.mark.parametrize("found", [None, "up", np.zeros(2)])
def test_a_learner_that_gives_no_action_is_named(which, found):
    with pytest.warns(UserWarning, match="cannot be compiled"):
        kind = register_learner("own", Averaging, **{**FUNCTIONS, which: lambda *_: found})
    with pytest.raises(RequestError, match=f"learner own: {which} returns .*, not an action"):
        returns_of(kind)
