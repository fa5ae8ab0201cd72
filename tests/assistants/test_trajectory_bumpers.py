"""Bumpers around a path, on Cliff Walking and in a corridor where distances can be counted."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers import RequestError, make_assistant, simulate
from qbumpers.assistants.trajectory_bumpers import farthest, steps_to, trajectory_bumpers
from qbumpers.decisions import Decision, Model, Noise
from qbumpers.simulation import make_condition
from qbumpers.simulation.trials import engine_of
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.cliff_walking import ROWS, state_of
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import situation_of
from tests.reference_rules import PlainTrajectoryBumpers
from tests.tasks.examples import random_tasks

UP, RIGHT, DOWN, LEFT = range(4)
NOISE = Noise(0.5, 0.5)
TOP_ROW = tuple(range(12))
CLIFF = cliff_walking()


def model_of(task):
    return Model(task.states, 0, task.actions, -1, 1.0, task.dynamics(), task.distance)


def options_of(path, reach) -> Any:
    return make_assistant("trajectory-bumpers", path=path, reach=reach).numbers


def decide(state, values, proposed, reach, noise=NOISE):
    situation = situation_of(values, proposed, start_value=87.0)._replace(state=state)
    options = options_of(TOP_ROW, reach)
    found = trajectory_bumpers(situation, noise, options, farthest(options, model_of(CLIFF)))
    return found, bumpers(situation, noise)


def test_the_distance_from_the_top_row_is_the_number_of_steps_up():
    for function in (steps_to, steps_to.py_func):  # type: ignore[attr-defined]
        found = function(TOP_ROW, model_of(CLIFF))
        assert found.reshape(ROWS, 12)[:3].tolist() == [[row] * 12 for row in range(3)]
        assert found[state_of(3, 0)] == 3


def test_a_state_from_which_the_path_cannot_be_reached_is_infinitely_far():
    # In this chain every step leads on to the next state, and the last one stays.
    transition = np.eye(4)[[1, 2, 3, 3]][:, None]
    task: Any = CLIFF.from_arrays(
        transition, np.zeros((4, 1)), np.zeros(4, bool), 0, discount=0.9, episode_limit=9
    )
    assert steps_to((1,), model_of(task)).tolist() == [1.0, 0.0, np.inf, np.inf]
    options = options_of((1,), 0)
    assert farthest(options, model_of(task)).tolist() == [[0.0], [np.inf], [np.inf], [np.inf]]


@settings(max_examples=30)
@given(random_tasks, st.data())
def test_agrees_with_a_region_grown_step_by_step(task, data):
    path = tuple(data.draw(st.sets(st.integers(0, task.states - 1), min_size=1, max_size=2)))
    reach = data.draw(st.integers(0, 3))
    options, plain = options_of(path, reach), PlainTrajectoryBumpers(path, reach, task)
    memory = farthest(options, model_of(task))
    values = np.array(
        data.draw(st.lists(st.integers(0, 3), min_size=task.actions, max_size=task.actions)), float
    )
    for state in range(task.states):
        for proposed in range(task.actions):
            situation = situation_of(values, proposed)._replace(state=state)
            expected = Decision(*plain.decide(situation, NOISE))
            assert trajectory_bumpers(situation, NOISE, options, memory) == expected


def test_the_best_way_is_barred_if_it_leads_too_far_from_the_path_and_not_by_bumpers():
    # Down from (1, 6) to (2, 6) is as good as right, but two steps away from the top row.
    values = [91.0, 93.0, 93.0, 91.0]
    assert decide(state_of(1, 6), values, DOWN, 1) == (Decision(RIGHT, 1.0), Decision(DOWN, 0.0))
    assert decide(state_of(1, 6), values, DOWN, 2)[0] == Decision(DOWN, 0.0)
    # At (0, 6) only going down leads off the top row itself, and only that is best.
    values = [90.0, 91.0, 92.0, 90.0]
    assert decide(state_of(0, 6), values, DOWN, 0) == (Decision(RIGHT, 1.0), Decision(DOWN, 0.0))
    assert decide(state_of(0, 6), values, LEFT, 0)[0] == Decision(LEFT, 0.0)


def test_if_every_action_leads_too_far_the_best_of_all_is_executed():
    values = [86.0, 86.0, 85.0, 87.0]
    assert decide(state_of(3, 0), values, UP, 1)[0] == Decision(LEFT, 1.0)
    assert decide(state_of(3, 0), values, LEFT, 1)[0] == Decision(LEFT, 0.0)


def test_an_assisted_walker_stays_in_the_region():
    path = [state_of(3, 0), *(state_of(2, column) for column in range(12)), state_of(3, 11)]
    assistant = make_assistant("trajectory-bumpers", path=path, reach=0)
    condition = make_condition(CLIFF, assistant, episodes=8)
    steps = engine_of(CLIFF).record(condition, range(1), 3, None)
    assert set(steps.next_state.tolist()) <= set(path)
    assert steps.overridden.any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"path": (), "reach": 1}, r"path = \(\): .*at least 1"),
        ({"path": (3, -1), "reach": 1}, r"path\.1 = -1: .*greater than or equal to 0"),
        ({"path": (3,), "reach": -1}, "reach = -1: .*greater than or equal to 0"),
    ],
)
def test_options_have_bounds(options, message):
    with pytest.raises(RequestError, match=f"assistant trajectory-bumpers: {message}"):
        make_assistant("trajectory-bumpers", **options)


def test_a_path_through_states_that_are_none_is_refused():
    assistant = make_assistant("trajectory-bumpers", path=(0, 48), reach=1)
    message = r"trajectory-bumpers: path has the state 48; the task's states lie in \[0, 48\)"
    with pytest.raises(RequestError, match=message):
        simulate(CLIFF, assistant, trials=1)
    with pytest.raises(RequestError, match=message):
        assistant.start(model_of(CLIFF))
