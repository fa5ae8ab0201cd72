"""Values in the wrong place: refused in one line, in every host, before any step."""

import dataclasses
from typing import Any, cast

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers

from qbumpers import (
    RequestError,
    SharedControl,
    TabularTask,
    TabularValues,
    load_values,
    make_assistant,
    make_task,
    simulate,
    solve,
    train_expert,
)
from qbumpers.decisions import Model
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.experts import check_expert
from qbumpers.experts.correcting import correct_values
from qbumpers.experts.loading import load_table
from qbumpers.experts.quality import check_table
from qbumpers.experts.tables import check_exactness
from qbumpers.session import Session
from qbumpers.simulation import make_condition
from qbumpers.values import learn_values
from tests.tasks.examples import random_task
from tests.tasks.lakes import Tabled, frozen
from tests.values.networks import network_of

SMALL = make_task("FrozenLake-v1", discount=0.99, is_slippery=False)
LARGE = make_task("FrozenLake-v1", discount=0.99, is_slippery=False, map_name="8x8")
MIRRORED = make_task(
    "FrozenLake-v1", discount=0.99, is_slippery=False, desc=["SFFF", "FFFH", "FHFH", "HFFG"]
)
POLE = make_task("CartPole-v1", discount=0.99)
TABLE = solve(SMALL).table
NETWORK = network_of(inputs=4, actions=2, task="CartPole-v1")


def in_shared_control(task, values):
    arguments = {16: {}, 64: {"map_name": "8x8"}}
    environment = frozen(**arguments[task.states]) if task.states else gymnasium.make("CartPole-v1")
    return SharedControl(environment, "maximal", values)


def in_a_simulation(task, values):
    return simulate(task, "maximal", values=values, episodes=1, trials=1)


def in_a_session(task, values):
    dynamics = task.dynamics() if task.states else None
    model = Model(
        task.states, task.observation_size, task.actions, -1, values.discount, dynamics,
        task.distance,
    )  # fmt: skip
    return Session(make_assistant("maximal"), values, model)


def in_a_check(task, values):
    if task.states:
        return check_table(task, values, discount=values.discount)
    return check_expert(task, values, episodes=1)


HOSTS = (in_shared_control, in_a_simulation, in_a_session, in_a_check)
MISPLACED = {
    "too many states": (SMALL, solve(LARGE), r"a table \[64, 4\]; .* needs a table \[16, 4\]"),
    "too few states": (LARGE, solve(SMALL), r"a table \[16, 4\]; .* needs a table \[64, 4\]"),
    "another map": (SMALL, solve(MIRRORED), "made for a task that differs from"),
    "learned at another map": (SMALL, learn_values(MIRRORED, episodes=1), "made for a task that"),
    "a network": (SMALL, NETWORK, r"a network of 4 inputs .* needs a table \[16, 4\]"),
    "a table": (POLE, solve(SMALL), r"a table \[16, 4\]; .* needs a network of 4 inputs and 2"),
    "inputs": (POLE, network_of(inputs=3, actions=2), "a network of 3 inputs and 2 actions; .* 4"),
    "actions": (POLE, network_of(inputs=4, actions=3), "a network of 4 inputs and 3 actions; .* 4"),
}


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("name", MISPLACED)
def test_misplaced_values_are_refused(host, name):
    task, values, message = MISPLACED[name]
    with pytest.raises(RequestError, match=message) as caught:
        host(task, values)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning")
def test_values_in_their_place_are_taken(host):
    unmarked = dataclasses.replace(solve(MIRRORED), made_for="")
    marked = dataclasses.replace(NETWORK, made_for=POLE.identity())
    for task, values in [(SMALL, solve(SMALL)), (SMALL, unmarked), (POLE, NETWORK), (POLE, marked)]:
        assert host(task, values) is not None


@pytest.mark.parametrize("values", [solve(SMALL).table.tolist(), "values.npz", 7])
def test_what_is_no_function_is_refused(values):
    message = r"values = .* a table \[16, 4\] is needed for task .*: TabularValues makes it of an"
    with pytest.raises(RequestError, match=message) as caught:
        in_a_simulation(SMALL, values)
    assert "\n" not in str(caught.value)
    if not isinstance(values, str):  # the path of a file will do there
        with pytest.raises(RequestError, match="is needed for environment FrozenLake-v1"):
            SharedControl(frozen(), "maximal", values, discount=0.9)


def test_an_array_is_a_table_of_the_task():
    found = [in_a_simulation(SMALL, values).outcomes for values in (TABLE, solve(SMALL))]
    for array, table in zip(*found, strict=True):
        assert (array == table).all()
    assert make_condition(SMALL, "maximal", values=TABLE).content() == (
        make_condition(SMALL, "maximal", values=solve(SMALL)).content()
    )
    shared = SharedControl(frozen(), "maximal", TABLE, discount=0.99)
    _, info = shared.reset(seed=0)
    assert (info["assistance"]["values"] == TABLE[0]).all()
    model = Model(16, 0, 4, -1, 0.99, SMALL.dynamics(), SMALL.distance)
    session = Session(make_assistant("maximal"), TABLE, model)
    session.begin(3)
    assert (session.values_now == TABLE[3]).all()
    assert check_table(SMALL, TABLE, discount=0.99).equals(
        check_table(SMALL, solve(SMALL), discount=0.99)
    )


def test_an_array_of_another_size_is_refused():
    message = r"a table \[16, 3\]; .* needs a table \[16, 4\]"
    model = Model(16, 0, 4, -1, 0.99, SMALL.dynamics(), SMALL.distance)
    for ask in (
        lambda: in_a_simulation(SMALL, TABLE[:, :3]),
        lambda: SharedControl(frozen(), "maximal", TABLE[:, :3], discount=0.99),
        lambda: Session(make_assistant("maximal"), TABLE[:, :3], model),
        lambda: check_table(SMALL, TABLE[:, :3], discount=0.99),
    ):
        with pytest.raises(RequestError, match=message):
            ask()
    with pytest.raises(RequestError, match="needs a network of 4 inputs"):
        in_a_simulation(POLE, TABLE)
    with pytest.raises(RequestError, match="discount is missing: the values state none"):
        SharedControl(frozen(), "maximal", TABLE)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: train_expert(SMALL), "FrozenLake-v1 has numbered states and a table"),
        (lambda: check_expert(SMALL, solve(SMALL)), "FrozenLake-v1 has numbered states and a"),
        (
            lambda: correct_values(SMALL, cast(Any, solve(SMALL))),
            "only networks are corrected, not tables",
        ),
        (
            lambda: correct_values(POLE, cast(Any, solve(SMALL))),
            r"a table \[16, 4\]; task CartPole-v1 needs a",
        ),
        (
            lambda: check_exactness(POLE, cast(Any, NETWORK)),
            "task CartPole-v1 has no table of transitions",
        ),
    ],
)
def test_what_a_kind_of_task_cannot_do_is_said(ask, message):
    with pytest.raises(RequestError, match=message) as caught:
        ask()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["too many states", "too few states", "another map", "a network"])
def test_misplaced_files_are_refused(name, tmp_path):
    task, values, message = MISPLACED[name]
    dataclasses.replace(values, task="FrozenLake-v1").save(tmp_path / "values.npz")
    with pytest.raises(RequestError, match=rf"values file .*values\.npz: values of .*{message}"):
        load_table(task, tmp_path / "values.npz")
    arguments = {"is_slippery": False, **({"map_name": "8x8"} if task is LARGE else {})}
    experiment = {
        "name": "misplaced", "values": str(tmp_path / "values.npz"),
        "task": {"name": "FrozenLake-v1", "discount": 0.99, "arguments": arguments},
        "assistants": [{"name": "maximal"}],
    }  # fmt: skip
    with pytest.raises(RequestError, match=message):
        make_plan(make_experiment(experiment))


def test_what_they_were_made_for_is_kept_in_files_and_is_no_part_of_the_digest(tmp_path):
    for values in (solve(SMALL), dataclasses.replace(NETWORK, made_for="a digest")):
        values.save(tmp_path / "values.npz")
        again = load_values(tmp_path / "values.npz")
        assert again.made_for == values.made_for != ""
        assert again.digest() == dataclasses.replace(values, made_for="").digest()


def test_the_right_values_arrive_always():
    """As the wrong ones did not, which were taken without a word."""
    environment = in_shared_control(SMALL, solve(SMALL))
    environment.action_space.seed(0)
    for seed in range(20):
        environment.reset(seed=seed)
        over, reward = False, 0.0
        while not over:
            _, reward, terminated, truncated, _ = environment.step(
                environment.action_space.sample()
            )
            over = terminated or truncated
        assert reward == 1.0


def test_a_session_and_its_values_agree_on_the_discount():
    model = Model(16, 0, 4, -1, 0.9, None, 1 - np.eye(4))
    with pytest.raises(RequestError, match=r"discount = 0\.9 of the model, .* made with 0\.99"):
        Session(make_assistant("maximal"), solve(SMALL), model)


@pytest.mark.parametrize("observation", [-1, 16, 3.0, "3", None, np.eye(16)[3], np.eye(99), (0, 3)])
def test_what_is_no_number_of_a_state_is_refused_by_a_table(observation):
    with pytest.raises(
        RequestError, match=r"is not the number of a state; .* has 16 states"
    ) as caught:
        solve(SMALL)(observation)
    assert "\n" not in str(caught.value)
    assert np.array_equal(solve(SMALL)(np.int64(3)), solve(SMALL).table[3])


class Placed(gymnasium.Env):
    """Shows a row and a column in place of a number."""

    action_space = spaces.Discrete(4)

    def __init__(self, space):
        self.observation_space = space


@pytest.mark.parametrize(
    ("space", "needs"),
    [
        (spaces.MultiDiscrete([4, 4]), "a network of 2 inputs and 4 actions"),
        (spaces.Tuple([spaces.Discrete(4)] * 2), "a function of observations that are neither"),
        (spaces.Box(0, 1, (16,), np.float32), "a network of 16 inputs and 4 actions"),
        (spaces.Box(0, 1, (4, 4), np.float32), "a function of observations that are neither"),
    ],
)
def test_a_table_needs_numbers_of_states(space, needs):
    with pytest.raises(RequestError, match=rf"a table \[16, 4\]; environment .* needs {needs}"):
        SharedControl(Placed(space), "maximal", solve(SMALL))


def test_values_made_without_a_wrapper_are_refused_with_it():
    pole = gymnasium.make("CartPole-v1")
    made = dataclasses.replace(NETWORK, made_for=POLE.identity())
    with pytest.raises(RequestError, match="the values were made without wrapper NormalizeObserv"):
        SharedControl(wrappers.NormalizeObservation(pole), "maximal", made)
    SharedControl(wrappers.RecordEpisodeStatistics(pole), "maximal", made)
    # Of a function, or of values that state nothing, nothing can be known.
    SharedControl(wrappers.NormalizeObservation(pole), "maximal", NETWORK)
    SharedControl(
        wrappers.NormalizeObservation(pole), "maximal", lambda seen: [0.0, 1.0], discount=1.0
    )
    cliff = wrappers.TransformAction(
        gymnasium.make("qbumpers/CliffWalking-v0"), lambda a: 3 - cast(int, a), None
    )
    with pytest.raises(RequestError, match="the values were made without wrapper TransformAction"):
        SharedControl(cliff, "maximal", solve(make_task("cliff-walking")))


def test_values_of_an_environments_table_are_those_with_its_wrappers():
    costly = wrappers.TransformReward(frozen(), lambda reward: 100 * float(reward) - 1)
    task = TabularTask.from_gymnasium(costly, discount=0.99)
    SharedControl(costly, "maximal", solve(task))
    with pytest.raises(RequestError, match="made for a task that differs from environment Frozen"):
        SharedControl(costly, "maximal", solve(SMALL))
    with pytest.raises(RequestError, match="what wrapper StickyAction does"):
        SharedControl(wrappers.StickyAction(frozen(), 0.25), "maximal", solve(SMALL))


def test_arguments_of_an_environment_tell_values_apart():
    made = dataclasses.replace(NETWORK, made_for=POLE.identity())
    other = gymnasium.make("CartPole-v1", sutton_barto_reward=True)
    with pytest.raises(
        RequestError, match="made for a task that differs from environment CartPole"
    ):
        SharedControl(other, "maximal", made)


def test_a_task_of_which_less_is_seen_needs_values_of_what_is_seen():
    task = dataclasses.replace(random_task(1, 6, 2), seen=np.array([0, 0, 1, 1, 2, 2]))
    with pytest.raises(RequestError, match=r"a table \[6, 2\]; task task needs a table \[3, 2\]"):
        simulate(task, "none", values=np.ones((6, 2)), episodes=1, trials=1)
    simulate(task, "none", episodes=1, trials=1)
    seen = TabularValues(np.ones((3, 2)), 0.9, "task", "by hand")
    simulate(task, "none", values=seen, episodes=1, trials=1)
    alike = dataclasses.replace(task, seen=np.array([5, 4, 3, 2, 1, 0]))
    every_state = solve(dataclasses.replace(task, seen=None))
    with pytest.raises(RequestError, match="made for a task that differs from task task"):
        simulate(alike, "none", values=every_state, episodes=1, trials=1)


@pytest.mark.parametrize("as_function", [False, True])
def test_states_and_actions_that_start_elsewhere(as_function):
    plain, shifted = Tabled(3), Tabled(3, first_state=7, first_action=2)
    values = solve(TabularTask.from_gymnasium(plain, discount=0.9, episode_limit=9))
    given = (lambda state: values(state - 7)) if as_function else values
    found = SharedControl(shifted, "maximal", given, discount=0.9)
    expected = SharedControl(plain, "maximal", values)
    state, info = found.reset(seed=1)
    expected_state, expected_info = expected.reset(seed=1)
    assert state == expected_state + 7
    over = False
    for action in (0, 1, 2, 0, 1, 2):
        if over:
            break
        for name, first in {"state": 7, "next_state": 7}.items():
            assert info["assistance"][name] == expected_info["assistance"][name] + first
        state, *_, info = found.step(action + 2)
        expected_state, _, over, _, expected_info = expected.step(action)
        assert state == expected_state + 7
        for name in ("values", "projected_return", "overridden"):
            assert np.array_equal(info["assistance"][name], expected_info["assistance"][name])
        for name in ("proposed", "executed", "credited"):
            assert info["assistance"][name] == expected_info["assistance"][name] + 2
