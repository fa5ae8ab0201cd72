"""What tasks say about themselves."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from qbumpers import RequestError
from qbumpers.learners import learners
from qbumpers.tasks import CliffWalking, VectorTask, cliff_walking, make_task
from tests.narrowing import of_kind
from tests.tasks.examples import random_task

LAKE = {"name": "FrozenLake-v1", "discount": 0.99, "is_slippery": True}
NEARER = np.array([[0, 1, 2], [1, 0, 1], [2, 1, 0]])


@pytest.fixture(scope="module")
def cart():
    return make_task("CartPole-v1", discount=0.9)


@pytest.mark.parametrize(
    ("arguments", "digest"),
    [
        (
            {"name": "cliff-walking"},
            "e1beac0882789aca7d5ff9becbc97810315a00214a9fb8efb86fbab11dfd2841",
        ),
        (
            {"name": "lunar-lander"},
            "04a043d2ffed55a6bc617db700ef4593c47ce18e844a53cbd66812224401804a",
        ),
        (
            {"name": "lunar-lander", "seed": 0},
            "53e871b56bcb5dff75e6ac09b651fc7780d5802b2325a7fabbdaba76deb526b9",
        ),
        (LAKE, "20b51aa878a0127328af8bc1ed6f8444ca4f6a2d7e762abf3f49931a3ba5862e"),
    ],
    ids=lambda given: given if isinstance(given, str) else "-".join(map(str, given.values())),
)
def test_digests_stay_for_they_seed_published_numbers(arguments, digest):
    assert make_task(**arguments).digest() == digest


def test_a_table_says_what_it_is():
    task = random_task(0, 5, 3)
    assert (task.states, task.observation_size, task.actions) == (5, 0, 3)
    assert task.observation_space == spaces.Discrete(5)
    assert (task.no_op, task.has_distance, task.seen) == (-1, False, None)
    assert task.display.actions == ("action 0", "action 1", "action 2")
    assert task.distance.tolist() == [[0, 1, 1], [1, 0, 1], [1, 1, 0]]
    assert task.releases_gil
    assert task.undoable


def test_a_vector_task_says_what_it_is(cart):
    assert (cart.states, cart.observation_size, cart.actions) == (0, 4, 2)
    assert cart.observation_space == spaces.Box(-np.inf, np.inf, (4,), np.float32)
    assert (cart.no_op, cart.has_distance, cart.seen) == (-1, False, None)
    assert cart.display.actions == ("left", "right")
    assert cart.distance.tolist() == [[0, 1], [1, 0]]
    assert cart.start.shape == (0,)
    assert not cart.releases_gil
    with pytest.raises(RequestError, match="CartPole-v1 has no table of transitions"):
        cart.dynamics()


def test_the_learners_of_a_task_are_those_that_observe_what_it_shows(cart):
    for task, observed in ((random_task(0, 5, 3), "states"), (cart, "vectors")):
        suiting = {n for n, k in learners().items() if k.built_in and k.observes == observed}
        assert set(task.learners) == suiting


def test_events_are_those_that_are_announced(cart):
    task = cliff_walking()
    assert task.events == {"success", "crash"}
    assert dataclasses.replace(task, crash=None).events == {"success"}
    assert dataclasses.replace(task, success=None, crash=None).events == set()
    assert cart.events == set()
    assert dataclasses.replace(cart, has_crash=True).events == {"crash"}


def test_the_lander_has_an_idle_action_and_engines_that_differ():
    task = make_task("lunar-lander")
    engines = [set(), {"left"}, {"main"}, {"right"}]
    differ = [[len(one ^ other) for other in engines] for one in engines]
    assert task.distance.tolist() == differ
    assert (task.no_op, task.has_distance) == (0, True)


def test_a_display_is_made_when_it_is_asked_for(cart):
    made = []

    def make_display(task):
        made.append(task)
        return "a display"

    for task in (random_task(0, 3, 2), cart):
        shown = dataclasses.replace(task, make_display=make_display)
        assert not made
        assert shown.display == "a display"
        assert made.pop() is shown
        assert shown.digest() == task.digest()


def test_what_is_stated_of_a_table_is_in_its_digest():
    task = random_task(0, 4, 3)
    stated = [
        {"no_op": 0},
        {"no_op": 1},
        {"action_distance": NEARER},
        {"action_distance": 1 - np.eye(3)},
        {"seen": np.arange(4)},
        {"seen": np.zeros(4, int)},
        {"no_op": 1, "action_distance": NEARER, "seen": np.arange(4)},
    ]
    digests = {dataclasses.replace(task, **each).digest() for each in stated}
    assert len(digests | {task.digest()}) == len(stated) + 1
    whole = dataclasses.replace(task, action_distance=NEARER.astype(float))
    assert whole.digest() == dataclasses.replace(task, action_distance=NEARER).digest()


def test_what_is_stated_of_a_vector_task_is_in_its_digest(cart):
    apart = 1 - np.eye(2)
    stated = [
        {"no_op": 0},
        {"no_op": 1},
        {"action_distance": apart},
        {"action_distance": 2 * apart},
        {"no_op": 1, "action_distance": 2 * apart},
    ]
    digests = {dataclasses.replace(cart, **each).digest() for each in stated}
    assert len(digests | {cart.digest()}) == len(stated) + 1
    listed = dataclasses.replace(cart, action_distance=[[0, 2], [2, 0]])
    assert listed.digest() in digests


def test_what_follows_from_a_tasks_name_is_in_its_digest_only_if_it_is_changed():
    lander = of_kind(VectorTask, make_task("lunar-lander"))
    changes = [
        {"no_op": -1},
        {"action_distance": None},
        {"action_distance": 2 * lander.distance},
    ]
    digests = {dataclasses.replace(lander, **each).digest() for each in changes}
    assert len(digests | {lander.digest()}) == len(changes) + 1
    assert dataclasses.replace(lander, action_distance=lander.distance).digest() == lander.digest()


@pytest.mark.parametrize("vectors", [False, True])
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"no_op": 2}, r"no_op = 2; it must lie in \[0, 2\), or be -1 if there is none"),
        ({"no_op": -2}, "no_op = -2;"),
        ({"no_op": 0.5}, r"no_op = 0\.5;"),
        ({"action_distance": np.eye(3)}, r"distance has shape \(3, 3\); \(2, 2\) is needed"),
        ({"action_distance": np.ones((2, 2))}, "distance holds a number that is no distance"),
        ({"action_distance": [[0, -1], [1, 0]]}, "distance holds a number that is no distance"),
        ({"action_distance": [[0, np.inf], [1, 0]]}, "distance holds a number that is no"),
        ({"make_display": "picture"}, "make_display = 'picture'; a function of the task is"),
    ],
)
def test_wrong_statements_are_refused_by_name(cart, vectors, changes, message):
    task = cart if vectors else random_task(0, 3, 2)
    with pytest.raises(RequestError, match=f"task {task.name}: {message}"):
        dataclasses.replace(task, **changes)


@pytest.mark.parametrize(
    ("seen", "message"),
    [
        (np.zeros(2, int), r"seen has shape \(2,\); \(3,\) is needed"),
        (np.zeros((3, 1), int), r"seen has shape \(3, 1\); \(3,\) is needed"),
        (np.array([0, -1, 1]), "seen must hold whole numbers of 0 or more"),
        (np.array([0.0, 1.0, 1.0]), "seen must hold whole numbers of 0 or more"),
    ],
)
def test_what_is_seen_is_a_number_per_state(seen, message):
    with pytest.raises(RequestError, match=message):
        dataclasses.replace(random_task(0, 3, 2), seen=seen)


def test_a_table_makes_an_environment_that_ends_at_its_limit():
    environment = cliff_walking().make_environment()
    same = gymnasium.make("qbumpers/CliffWalking-v0")
    assert environment.reset(seed=0) == same.reset(seed=0)
    left = [(environment.step(3), same.step(3)) for _ in range(100)]
    assert all(mine == theirs for mine, theirs in left)
    assert [mine[2:4] for mine, _ in left] == [(False, False)] * 99 + [(False, True)]


def test_a_picture_that_a_table_does_not_have_is_refused():
    with pytest.raises(RequestError, match="render_mode = 'human'; known: rgb_array"):
        make_task(**LAKE).make_environment(render_mode="human")
    with pytest.raises(RequestError, match="render_mode = 'human'; known: ansi, rgb_array"):
        CliffWalking(render_mode="human")
