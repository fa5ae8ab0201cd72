"""Rules and learners whose choices make no sense, or who change what they are given to read."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest
from pydantic import Field

from qbumpers.assistants import register_assistant
from qbumpers.decisions import Decision
from qbumpers.errors import RequestError
from qbumpers.learners import register_learner
from qbumpers.simulation import run, simulate
from qbumpers.tasks import cliff_walking
from tests.learners.own_learners import (
    Averaging,
    always_best,
    average,
    first_values,
    prefer_best,
)
from tests.simulation.conditions import on_the_cliff
from tests.simulation.corridors import in_the_corridor

Number = Annotated[float, Field()]


class Wish(NamedTuple):
    action: Number = 0.0
    probability: Number = 0.0


class NoOptions(NamedTuple):
    pass


def decide_as_wished(situation, noise, options):
    return Decision(options.action, options.probability)


def decide_as_wished_in_python(situation, noise, options):
    assert isinstance(situation.values.tolist(), list)  # which Numba cannot compile
    return Decision(options.action, options.probability)


UNSOUND = [
    ({"action": 1.5}, "whole number"),
    ({"action": -1.0}, "whole number"),
    ({"action": 4.0}, "whole number"),
    ({"action": np.nan}, "whole number"),
    ({"probability": 2.0}, "probability"),
    ({"probability": -0.5}, "probability"),
    ({"probability": np.nan}, "probability"),
]


@pytest.mark.parametrize("compiles", [True, False])
def test_a_decision_that_cannot_be_executed_stops_the_simulation(compiles):
    if compiles:
        register_assistant("wish", Wish)(decide_as_wished)
    else:
        with pytest.warns(UserWarning, match="cannot be compiled"):
            register_assistant("wish", Wish)(decide_as_wished_in_python)
    for wish, what in UNSOUND:
        with pytest.raises(RequestError, match=what):
            run(on_the_cliff(("wish", wish), episodes=1), trials=1)
    run(on_the_cliff(("wish", {"action": 3.0, "probability": 1.0}), episodes=1), trials=1)


def test_it_stops_the_simulation_of_vectors_too():
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("wish", Wish)(decide_as_wished_in_python)
    for wish, what in UNSOUND:
        with pytest.raises(RequestError, match=what):
            run(in_the_corridor("wish", wish), trials=1)


@pytest.mark.slow
def test_it_stops_the_compiled_simulation_of_vectors_too():
    register_assistant("wish", Wish)(decide_as_wished)
    for wish, what in UNSOUND:
        with pytest.raises(RequestError, match=what):
            run(in_the_corridor("wish", wish), trials=1)


def spoil_values(situation, noise, options):
    situation.values[situation.proposed] = 1000.0
    return Decision(situation.proposed, 0.0)


def spoil_the_state(situation, noise, options):
    situation.state[0] += 1
    return Decision(situation.proposed, 0.0)


@pytest.mark.parametrize(
    ("rule", "make"),
    [
        (spoil_values, lambda: on_the_cliff(("spoil", {}))),
        (spoil_values, lambda: in_the_corridor("spoil")),
        (spoil_the_state, lambda: in_the_corridor("spoil")),
    ],
)
def test_a_rule_cannot_change_what_it_reads(rule, make):
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("spoil", NoOptions)(rule)
    with pytest.raises(ValueError, match="read-only"):
        run(make(), trials=1)


def assert_stopped(choose, prefer):
    settings = register_learner(
        "far-away", Averaging, start=first_values, choose=choose, prefer=prefer,
        policy=always_best, learn=average,
    )  # fmt: skip
    with pytest.raises(RequestError, match="the learner's action is not a whole number"):
        simulate(cliff_walking(), "none", learner=settings(), episodes=1, trials=1)


def test_a_learner_that_chooses_no_action_stops_the_simulation():
    def choose_far_away(settings, memory, state, rates, stream):
        return 4 if state == 36 else 0

    assert_stopped(choose=choose_far_away, prefer=prefer_best)


def test_a_learner_that_prefers_no_action_stops_the_simulation():
    def prefer_far_away(settings, memory, state, tie):
        return -1

    def choose_up(settings, memory, state, rates, stream):
        return 0

    assert_stopped(choose=choose_up, prefer=prefer_far_away)
