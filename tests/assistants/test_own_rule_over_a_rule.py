"""A user's own rule over a rule, over one without a memory and over one with a memory."""

from typing import NamedTuple

import numpy as np
import pytest

from qbumpers.assistants import Options, dispatch, make_assistant, register_assistant
from qbumpers.assistants.registry import assistants
from qbumpers.simulation import simulate
from qbumpers.tasks import cliff_walking


class OverOptions(NamedTuple):
    of: Options


def start_other(options, model):
    return dispatch.start(options.of, model)


def observe_other(memory, step, options):
    return dispatch.observe(memory, step, options.of)


def as_the_other(situation, noise, options, memory):
    """What the other rule does."""
    return dispatch.decide(situation, noise, options.of, memory)


@pytest.fixture(scope="module", autouse=True)
def over(own_registry_of_module):
    name = "over-another"
    register = register_assistant(name, OverOptions, start=start_other, observe=observe_other)
    register(as_the_other)
    return name


def test_it_compiles_although_the_memory_of_most_rules_is_a_constant(over):
    assert assistants()[over].compiled


@pytest.mark.parametrize(
    "other", ["maximal", {"name": "budget", "per_episode": 2, "of": "maximal"}]
)
def test_it_overrides_as_the_other_one_does(over, other):
    task = cliff_walking()
    found = simulate(task, make_assistant(over, of=other), trials=2, episodes=5).outcomes
    if other == "maximal":
        np.testing.assert_array_equal(found.assisted_return, 87)
    else:
        assert found.overrides.max() == 2
