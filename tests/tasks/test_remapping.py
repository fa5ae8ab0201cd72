"""Tasks with other keys, against the tasks that they were made of."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest

from qbumpers import RequestError, SharedControl, make_assistant, simulate
from qbumpers.tasks import make_task
from qbumpers.tasks.corridors import slippery_corridor, vector_corridor
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.remapping import remapped
from qbumpers.values import shipped_values, solve
from tests.tasks.examples import outcomes, random_task

UP, RIGHT, DOWN, LEFT = range(4)
TURNED = (1, 2, 3, 0)


def test_the_key_up_moves_right():
    task = make_task("remapped", of="cliff-walking", keys=TURNED)
    environment = task.make_environment()
    environment.reset(seed=0)
    display = task.display
    up = display.keys["ArrowUp"]
    assert display.actions[up] == "up"
    observation, reward, *_, info = environment.step(up)  # right, onto the cliff
    assert (observation, reward, info["crash"]) == (36, -100.0, True)
    assert environment.step(display.keys["ArrowLeft"])[0] == 24


def test_every_action_of_a_table_does_what_another_did():
    inner = random_task(2, 5, 3)
    task: Any = remapped(inner, (2, 0, 1))
    for state in range(5):
        for action, other in enumerate((2, 0, 1)):
            assert outcomes(task, state, action) == outcomes(inner, state, other)


def test_distances_events_and_what_does_nothing_follow_what_actions_do():
    inner, keys = slippery_corridor(), (3, 2, 1, 0)
    task: Any = remapped(inner, keys)
    assert task.no_op == 1  # staying was 2
    assert task.events == inner.events
    for one, other in np.ndindex(4, 4):
        assert task.distance[one, other] == inner.distance[keys[one], keys[other]]


def test_exact_values_are_the_same_in_another_order():
    inner = make_task("cliff-walking")
    task = remapped(inner, TURNED)
    assert np.array_equal(solve(task).table, solve(inner).table[:, TURNED])
    assert solve(task).made_for == task.identity() != inner.identity()


def simulated(task, **setup):
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.5)
    found = simulate(task, bumpers, trials=3, episodes=5, values=solve(task), **setup)
    return found.outcomes


def test_a_task_whose_keys_stay_gives_the_same_numbers():
    inner = make_task("cliff-walking")
    same = make_task("remapped", of="cliff-walking", keys=(0, 1, 2, 3))
    assert same.digest() == inner.digest()
    assert same.name == "cliff-walking"
    for one, other in zip(simulated(inner), simulated(same), strict=True):
        assert np.array_equal(one, other)


def test_remapping_twice_is_remapping_once():
    inner = make_task("cliff-walking")
    twice = remapped(remapped(inner, TURNED), TURNED)
    assert twice.digest() == remapped(inner, (2, 3, 0, 1)).digest()
    assert remapped(remapped(inner, TURNED), (3, 0, 1, 2)) is inner


def test_a_stepper_takes_the_other_action_and_can_undo():
    task = remapped(vector_corridor(), (1, 0))
    assert task.no_op == 1
    stepper: Any = task.make_stepper()
    first = stepper.reset(0.5)
    place = stepper.snapshot()
    assert stepper.step(0)[0][0] > first[0]
    stepper.restore(place)
    assert stepper.step(1)[0][0] < first[0]


def test_an_environment_of_vectors_takes_the_other_action():
    task = make_task("remapped", of={"name": "CartPole-v1", "discount": 0.9}, keys=[1, 0])
    environment, original = task.make_environment(), gymnasium.make("CartPole-v1")
    environment.reset(seed=4)
    original.reset(seed=4)
    for action in (0, 1, 1, 0, 1):
        mine, theirs = environment.step(action), original.step(1 - action)
        assert np.array_equal(mine[0], theirs[0])
    with pytest.raises(RequestError, match=r"action = 2; it must lie in \[0, 2\)"):
        environment.step(2)


def test_tasks_with_other_keys_are_other_tasks():
    inner = make_task("mountain-car")
    tasks = [inner, remapped(inner, (1, 0, 2)), remapped(inner, (2, 1, 0))]
    assert len({task.digest() for task in tasks}) == 3
    assert len({task.identity() for task in tasks}) == 3


def test_workers_can_have_it():
    for name, keys in (("cliff-walking", TURNED), ("mountain-car", (2, 1, 0))):
        task = make_task("remapped", of=name, keys=keys)
        again = pickle.loads(pickle.dumps(task))
        assert again.digest() == task.digest()
        assert again.display.actions == task.display.actions


def test_the_values_that_ship_serve_it():
    task = make_task("remapped", of="mountain-car", keys=(2, 1, 0))
    bumpers = make_assistant("maximal")
    environment = SharedControl(task.make_environment(), bumpers, shipped_values(task))
    environment.reset(seed=0)
    total, arrived = 0.0, False
    while not arrived and total > -125:
        _, reward, arrived, _, _ = environment.step(1)
        total += float(reward)
    assert arrived


def test_no_key_goes_on_doing_what_it_did_and_flames_are_those_that_burn():
    inner, keys = make_task("lunar-lander"), (1, 2, 3, 0)
    task = remapped(inner, keys)
    assert (inner.display.idle, task.display.idle) == (0, 3)
    assert task.display.actions == inner.display.actions
    state = np.array([0, 1, 0, 0, 0, 0, 0, 0], np.float32)
    for action, done in enumerate(keys):
        pressed = unassisted_step(state, action, 0.0, state)
        burned = unassisted_step(state, done, 0.0, state)
        assert task.display.scene(state, pressed) == inner.display.scene(state, burned)
    assert task.display.scene(state, None) == inner.display.scene(state, None)


@pytest.mark.parametrize("keys", [(0, 1, 2), (0, 0, 1, 2), (1, 2, 3, 4), (0, 1, 2, 3.5), 3, "0123"])
def test_what_is_no_permutation_is_refused_in_a_line(keys):
    message = r"task 'remapped': keys = .*; each of the actions 0 to 3 of task cliff-walking"
    with pytest.raises(RequestError, match=message) as caught:
        make_task("remapped", of="cliff-walking", keys=keys)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"of": "clif-walking", "keys": (0,)}, "did you mean 'cliff-walking'"),
        ({"of": {"rows": 3}, "keys": (0,)}, "of = {'rows': 3}; the name of a task is needed"),
        ({"of": "cliff-walking"}, "missing a required argument: 'keys'"),
        (
            {"of": {"name": "larger-cliff", "rows": 1}, "keys": (0,)},
            "task 'larger-cliff': rows = 1",
        ),
    ],
)
def test_what_it_is_made_of_is_checked(arguments, message):
    with pytest.raises(RequestError, match=message):
        make_task("remapped", **arguments)
