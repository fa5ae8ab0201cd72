"""What rules see, the same in every host, and what they ask of a task."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

from qbumpers import RequestError, SharedControl, register_assistant
from qbumpers.assistants import make_assistant
from qbumpers.decisions import Decision, Step
from qbumpers.session import Session
from qbumpers.simulation import make_condition, record, simulate
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.dynamics import LIMIT, SUCCESS, TERMINATED
from tests.assistants.own_rules import ABOVE_THE_GOAL, DOWN, NoOptions, never_arrive, watch
from tests.shared_control_examples import CLIFF, Dial, play, walking
from tests.simulation.conditions import on_the_cliff
from tests.simulation.corridors import in_the_corridor

pytestmark = pytest.mark.usefixtures("own_registry")

GOAL = 47
SCALE = 2.0**-30
"""Makes a probability of what is told, to the bit."""
STEERED = np.random.default_rng(1).integers(0, 4, (48, 4)).astype(float)
COMFORT = np.random.default_rng(2).integers(0, 8, (48, 4)) / 8


class Further:
    """Q* of the cliff, with further values in another order than rules ask for them."""

    def __init__(self):
        self.discount = 1.0
        self.others = {"comfort": COMFORT.__getitem__, "steadiness": STEERED.__getitem__}

    def __call__(self, state):
        return CLIFF(state)


def tell(situation, noise, options):
    """Executes what the first further row says; its probability tells all the rest."""
    seen = 1e6 * situation.state + 1e4 * situation.episode + 10 * situation.step
    seen += situation.others[1, situation.proposed]
    return Decision(int(situation.others[0, situation.proposed]), seen * SCALE)


def simulated():
    register_assistant("tell", NoOptions, values=("steadiness", "comfort"))(tell)
    return on_the_cliff(("tell", {}), values=Further(), episodes=5)


def assert_all_seen(steps):
    """Recounted from the table of steps alone."""
    number = np.arange(len(steps.episode)) - np.searchsorted(steps.episode, steps.episode)
    at = (steps.state, steps.proposed)
    expected = 1e6 * steps.state + 1e4 * steps.episode + 10 * number + COMFORT[at]
    assert np.array_equal(steps.probability, expected * SCALE)
    assert np.array_equal(steps.executed, STEERED[at])
    assert number.max() > 20


def test_a_simulated_rule_knows_where_it_is_and_reads_its_rows_in_its_order():
    condition = simulated()
    assert condition.assistant.compiled
    assert_all_seen(record(condition, seed=2))


def test_the_wrapper_tells_the_same():
    simulated()
    environment, rows = walking("tell", Further()), []
    actions = np.random.default_rng(3).integers(4, size=120)
    for _ in range(3):
        rows += [Step(**step[-1]["assistance"]) for step in play(environment, actions)[1:]]
    assert_all_seen(Step(*(np.array(column) for column in zip(*rows, strict=True))))


def test_a_rule_whose_rows_are_missing_is_refused_everywhere():
    assistant = simulated().assistant
    message = "assistant tell: it needs further values 'steadiness'; known: none"
    with pytest.raises(RequestError, match=message):
        make_condition(cliff_walking(), assistant)
    with pytest.raises(RequestError, match=message):
        walking(assistant)
    model = simulated().model()
    with pytest.raises(RequestError, match=message):
        Session(assistant, CLIFF, model)


def test_values_and_further_rows_are_those_of_what_is_seen():
    register_assistant("tell", NoOptions, values=("steadiness", "comfort"))(tell)
    seen = np.random.default_rng(4).integers(0, 48, 48)
    task = dataclasses.replace(cliff_walking(), seen=seen)
    condition = make_condition(task, make_assistant("tell"), values=Further())
    assert np.array_equal(condition.values, CLIFF.table[seen])
    assert np.array_equal(condition.others, np.stack([STEERED, COMFORT], axis=1)[seen])
    steps = record(condition, seed=2)
    states = task.next_state[steps.state, steps.executed, 0]
    assert np.array_equal(steps.next_state, states)  # the record tells what the learner sees
    told = (steps.probability / SCALE // 1e6).astype(int)
    assert np.array_equal(told, seen[steps.state])


class Told(NamedTuple):
    number: float


def take_note(options, model):
    """All of the model in one number."""
    sizes = 1e6 * model.states + 1e5 * model.observation_size + 1e3 * model.actions + model.no_op
    fall = (ABOVE_THE_GOAL - 1) * 4 + DOWN
    table = model.dynamics.next_state[fall] / 64 + model.dynamics.reward[fall] * 10
    return Told(sizes + table + model.distance[0, 1] / 1024 + model.distance[2, 2] + model.discount)


def keep_note(memory, step, options):
    return memory


def read_note(situation, noise, options, memory):
    return Decision(situation.proposed, memory.number * SCALE)


def test_start_gets_the_task():
    # 48 states, 4 actions, no action that does nothing, discount 1; down from above the cliff leads
    # to the start, 36, for -100; every two actions are equally far apart.
    expected = 48e6 + 4e3 - 1 + 36 / 64 - 1000 + 1 / 1024 + 1.0
    register_assistant("note", NoOptions, start=take_note, observe=keep_note, needs=("dynamics",))(
        read_note
    )
    steps = record(on_the_cliff(("note", {}), episodes=1))
    assert set(steps.probability) == {expected * SCALE}
    environment = walking("note")
    environment.reset()
    assert environment.step(0)[-1]["assistance"]["probability"] == expected * SCALE


NEEDS = {
    "states": "numbered states",
    "dynamics": "table of transitions",
    "undo": "state that can be taken back",
    "distance": "distance between actions",
    "no_op": "action that does nothing",
}


def demanding(need):
    register_assistant("demanding", NoOptions, needs=(need,))(watch)
    return make_assistant("demanding")


@pytest.mark.parametrize("need", NEEDS)
def test_a_task_that_cannot_give_what_a_rule_needs_is_refused_in_one_line(need):
    demanding(need)
    with pytest.raises(RequestError, match=f"demanding.*corridor.*{NEEDS[need]}") as refused:
        in_the_corridor("demanding")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("need", NEEDS)
def test_an_environment_that_cannot_give_it_is_refused_in_one_line(need):
    assistant = demanding(need)
    words = "snapshot and restore" if need == "undo" else f"demanding.*{NEEDS[need]}"
    with pytest.raises(RequestError, match=words) as refused:
        SharedControl(Dial(), assistant, lambda _: [1, 2, 3], discount=1.0)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("need", ["distance", "no_op"])
def test_needs_are_checked_before_anything_is_simulated(need):
    with pytest.raises(RequestError, match=f"cliff-walking.*{NEEDS[need]}"):
        simulate(cliff_walking(), demanding(need))


def assert_never_arrived(steps):
    """The goal is reached by undone steps alone, and nothing ends there."""
    undone = steps.undone
    assert undone.any()
    assert np.array_equal(undone, (steps.state == ABOVE_THE_GOAL) & (steps.proposed == DOWN))
    assert (steps.next_state[undone] == GOAL).all()
    assert (steps.reward[undone] == 99).all()
    assert steps.overridden[undone].all()
    assert not (steps.events & TERMINATED).any()
    assert (steps.events[undone] & SUCCESS > 0).all()
    assert (np.bincount(steps.episode) == 100).all()
    assert np.array_equal(np.flatnonzero(steps.events & LIMIT), np.arange(99, len(undone), 100))
    goes_on = np.flatnonzero(undone & (steps.events & LIMIT == 0))
    assert (steps.state[goes_on + 1] == ABOVE_THE_GOAL).all()


def test_simulated_undone_steps_count_and_end_nothing():
    register_assistant("never-arrive", NoOptions, needs=("undo",))(never_arrive)
    condition = on_the_cliff(("never-arrive", {}), episodes=60)
    steps = record(condition, seed=1)
    assert_never_arrived(steps)
    outcomes = simulate(condition.task, condition.assistant, episodes=60, trials=1, seed=1).outcomes
    assert (outcomes.assisted_length == 100).all()
    totals = np.bincount(steps.episode, steps.reward)
    assert outcomes.assisted_return[0].tolist() == totals.tolist()
    assert outcomes.overrides[0].tolist() == np.bincount(steps.episode, steps.undone).tolist()


def test_undone_steps_of_the_wrapper_count_and_end_nothing():
    register_assistant("never-arrive", NoOptions, needs=("undo",))(never_arrive)
    environment = walking("never-arrive")
    returned = play(environment, [0, *[1] * 11, *[DOWN, 1] * 100], seed=0)
    assert len(returned) == 101
    rows = [Step(**step[-1]["assistance"]) for step in returned[1:]]
    assert_never_arrived(Step(*(np.array(column) for column in zip(*rows, strict=True))))
    reward, terminated, truncated = returned[13][1:4]
    assert (reward, terminated, truncated) == (99.0, False, False)
    summary = returned[-1][-1]["assisted_episode"]
    assert (summary["length"], summary["overrides"]) == (100, sum(s[1] == 99 for s in returned[1:]))
