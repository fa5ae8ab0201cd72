"""Simulations that are asked for wrongly: refused in one line that names what is wrong."""

from typing import Any

import numpy as np
import pytest

from qbumpers import RequestError, TabularValues, make_task, simulate, solve
from qbumpers.learners import perception
from qbumpers.learners.double_dqn import DoubleDQN
from tests.values.networks import network_of

CLIFF, POLE = make_task("cliff-walking"), make_task("CartPole-v1", discount=0.9)
TAXI = solve(make_task("Taxi-v4", discount=0.9))
NETWORK = network_of(inputs=4, actions=2, task="CartPole-v1")

WRONG: dict[str, tuple[Any, dict[str, Any], str]] = {
    "values of another task": (CLIFF, {"values": TAXI}, r"a table \[500, 6\]; task cliff-w"),
    "values of fewer states": (
        CLIFF,
        {"values": TabularValues(np.zeros((3, 4)), 1.0, "small", "zeros")},
        r"values of small: a table \[3, 4\]; task cliff-walking needs a table \[48, 4\]",
    ),
    "a network's values": (CLIFF, {"values": NETWORK}, "a network of 4 inputs and 2 act"),
    "a table's values": (POLE, {"values": TAXI}, r"a table \[500, 6\]; task CartPole"),
    "an array": (CLIFF, {"values": np.zeros((48, 3))}, r"a table \[48, 3\]; task cliff-walking"),
    "a path": (CLIFF, {"values": "values.npz"}, r"values = 'values\.npz'; a table"),
    "values of texts": (CLIFF, {"values": lambda state: "left"}, "= 'left'; an array of numbers"),
    "ragged values": (CLIFF, {"values": lambda state: [[1], [2, 3]]}, "an array of numbers is"),
    "a name of a task": ("cliff-wlaking", {}, r"did you mean 'cliff-walking'"),
    "no task": (None, {}, "task = None; a task is needed"),
    "half an episode": (CLIFF, {"episodes": 1.5}, r"episodes = 1\.5; a whole number from 1 up"),
    "episodes as text": (CLIFF, {"episodes": "3"}, "episodes = '3'; a whole number"),
    "retention": (CLIFF, {"retention": None}, "retention = None; a whole number from 0 up"),
    "forgetting": (CLIFF, {"forgetting": "all"}, r"forgetting = 'all'; a number in \[0, 1\]"),
    "penalty": (CLIFF, {"penalty": "high"}, "penalty = 'high'; a number"),
    "motor": (CLIFF, {"motor": {"slip": 0.1}}, r"motor = \{'slip': 0\.1\}; a Motor is needed"),
    "perception": (CLIFF, {"perception": ["observant"]}, r"unknown perception \['observant'\]"),
    "learner": (CLIFF, {"learner": "q-learning"}, "learner = str: no learner has such settings"),
    "learner of vectors": (CLIFF, {"learner": DoubleDQN()}, "it observes vectors, and task cliff"),
    "workers": (CLIFF, {"workers": "two"}, "workers = 'two'; a whole number from 1 up"),
}


@pytest.mark.parametrize(("task", "setup", "message"), WRONG.values(), ids=list(WRONG))
def test_a_wrong_request_is_refused_in_one_line(task, setup, message):
    asked: dict[str, Any] = {"trials": 2, "episodes": 1, **setup}
    with pytest.raises(RequestError, match=message) as refused:
        simulate(task, "maximal", **asked)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", [["observant"], {}, 3])
def test_a_name_that_is_none_is_unknown(name):
    for named in (perception, make_task):
        with pytest.raises(RequestError, match="unknown"):
            named(name)
