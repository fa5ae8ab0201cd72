"""The Gymnasium wrapper: which action is executed, and what is recorded about it."""

import dataclasses
import math

import numpy as np
import pytest

from qbumpers import RequestError, SharedControl, make_task, register_assistant, solve
from qbumpers.tasks import TabularEnvironment
from tests.assistants.own_rules import BudgetOptions, full_budget, guide_within_budget, spend
from tests.narrowing import of_kind
from tests.shared_control_examples import (
    DOWN,
    LADDER,
    LEFT,
    RIGHT,
    UP,
    Dial,
    bumpers,
    ladder,
    play,
    skating,
    walking,
)
from tests.tasks.examples import random_task

KEYS = {
    "episode", "state", "proposed", "executed", "undone", "credited", "overridden", "probability",
    "coin", "tie", "values", "projected_return", "reward", "next_state", "events",
}  # fmt: skip


def records(returned: list[tuple]) -> list[dict]:
    """The records of the steps, without that of `reset`."""
    return [step[-1]["assistance"] for step in returned[1:]]


def test_every_action_becomes_a_best_one_under_maximal_assistance():
    environment = walking("maximal")
    steps = play(environment, [RIGHT] * 20, seed=0)[1:]
    executed = [step[-1]["assistance"]["executed"] for step in steps]
    assert executed == [UP, *[RIGHT] * 11, DOWN]
    assert [step[-1]["assistance"]["overridden"] for step in steps] == [True, *[False] * 11, True]
    assert sum(step[1] for step in steps) == 87
    assert steps[-1][2]


def test_without_assistance_every_action_is_executed():
    actions = [UP, RIGHT, DOWN, LEFT, UP, UP, DOWN]
    steps = play(walking("none"), actions, seed=0)[1:]
    assert [step[-1]["assistance"]["executed"] for step in steps] == actions
    assert [step[0] for step in steps] == [24, 25, 36, 36, 24, 12, 24]
    assert [step[1] for step in steps] == [-1, -1, -100, -1, -1, -1, -1]


@pytest.mark.parametrize("assistant", ["none", "maximal"])
def test_the_record_always_has_the_same_keys(assistant):
    returned = play(walking(assistant), [RIGHT] * 100, seed=0)
    assert {frozenset(step[-1]["assistance"]) for step in returned} == {frozenset(KEYS)}


def test_at_reset_the_record_shows_the_first_state_and_no_action():
    _, info = walking("maximal").reset(seed=0)
    assert info["success"] is False  # the environment's own information stays
    record = info["assistance"]
    assert record["values"].tolist() == [87, -13, 86, 86]
    assert record["projected_return"] == 87
    assert [record[key] for key in ("proposed", "executed", "credited")] == [-1, -1, -1]
    assert [record[key] for key in ("overridden", "probability", "reward")] == [False, 0.0, 0.0]


def test_the_projected_return_is_the_discounted_past_and_the_promise():
    environment = SharedControl(ladder(), "none", LADDER)
    environment.reset()
    wait, climb = 0, 1
    record = environment.step(wait)[-1]["assistance"]
    assert record["values"].tolist() == [0.42, 3.8]
    assert record["projected_return"] == pytest.approx(0.42)
    assert record["reward"] == -3.0
    record = environment.step(climb)[-1]["assistance"]
    assert record["projected_return"] == pytest.approx(-3.0 + 0.9 * 3.8)
    record = environment.step(wait)[-1]["assistance"]
    assert record["projected_return"] == pytest.approx(-3.0 + 0.9 * 2.0 + 0.81 * -1.2)
    *_, info = environment.step(climb)
    last = -3.0 + 0.9 * 2.0 + 0.81 * -3.0 + 0.729 * 2.0
    assert info["assistance"]["projected_return"] == pytest.approx(last)
    assert info["assisted_episode"] == {
        "return": -2.0,
        "length": 4,
        "overrides": 0,
        "start_value": 3.8,
        "projected_return": pytest.approx(last),
    }


def test_the_ladders_values_are_its_optimal_ones():
    np.testing.assert_allclose(solve(ladder().task).table[:2], LADDER.table[:2], atol=1e-9)


def test_the_summary_comes_with_the_last_step_and_no_other():
    returned = play(walking("maximal"), [RIGHT] * 20, seed=0)
    assert ["assisted_episode" in step[-1] for step in returned] == [False] * 13 + [True]
    summary = returned[-1][-1]["assisted_episode"]
    assert (summary["return"], summary["length"], summary["overrides"]) == (87.0, 13, 2)


def test_a_truncated_episode_has_a_summary_too():
    returned = play(walking("none"), [LEFT] * 200, seed=0)
    assert len(returned) == 101
    summary = returned[-1][-1]["assisted_episode"]
    assert (summary["return"], summary["length"]) == (-100.0, 100)
    assert summary["projected_return"] == -99 + 86


def test_counts_start_again_with_each_episode():
    environment = walking("maximal")
    first = play(environment, [RIGHT] * 20, seed=0)[-1][-1]["assisted_episode"]
    assert play(environment, [RIGHT] * 20)[-1][-1]["assisted_episode"] == first


def test_the_start_value_belongs_to_the_episode():
    task = random_task(3, 6, 3)
    values = solve(task)
    environment = SharedControl(TabularEnvironment(task), "none", values)
    environment.reset(seed=0)
    seen = set()
    for _ in range(30):
        state, info = environment.reset()
        assert info["assistance"]["projected_return"] == values(state).max()
        seen.add(state)
    assert len(seen) == (task.start > 0).sum() > 1


def expected_probability(record, earned, discount, start_value, *, alpha, v_min, p_max=0.999):
    """Algorithm 1 from the record alone, with f(x) = 1 / (1 + ((1 - p) / p)**(2 x - 1))."""
    values, own = record["values"], record["values"][record["proposed"]]
    room = alpha * (start_value - v_min)
    if own == max(values):
        return 0.0
    if start_value - (earned + discount * max(values)) >= room:
        return 1.0
    ratio = (start_value - (earned + discount * own)) / room
    if not 0 < ratio < 1:
        return float(ratio >= 1)
    return 1 / (1 + ((1 - p_max) / p_max) ** (2 * ratio - 1))


@pytest.mark.parametrize(
    ("make", "discount", "alpha", "v_min"), [(walking, 1.0, 0.7, 0.0), (skating, 0.95, 0.9, 0.0)]
)
def test_bumpers_override_as_their_algorithm_says_with_what_the_episode_earned(
    make, discount, alpha, v_min
):
    environment = make(**bumpers(alpha=alpha, v_min=v_min))
    generator = np.random.default_rng(0)
    environment.reset(seed=0)
    kinds = set()
    for _ in range(60):
        start_value = environment.reset()[1]["assistance"]["projected_return"]
        earned, factor, ended = 0.0, 1.0, False
        while not ended:
            _, reward, terminated, truncated, info = environment.step(generator.integers(4))
            record = info["assistance"]
            expected = expected_probability(
                record, earned, factor, start_value, alpha=alpha, v_min=v_min
            )
            assert math.isclose(record["probability"], expected, abs_tol=1e-12)
            assert record["overridden"] == (record["coin"] < record["probability"])
            values = record["values"]
            chosen = max(values) if record["overridden"] else values[record["proposed"]]
            assert values[record["executed"]] == chosen
            kinds.add(0 if expected == 0 else 1 if expected == 1 else "between")
            earned, factor = earned + factor * reward, factor * discount
            ended = terminated or truncated
    assert kinds == {0, 1, "between"}


@pytest.mark.parametrize(
    ("perception", "credited"),
    [
        ("transition", RIGHT),
        ("observant", UP),
        ("interruption", -1),
        ("disruption", UP),
        ("transition-disruption", RIGHT),
    ],
)
def test_an_overridden_step_is_credited_as_the_learner_perceives_it(perception, credited):
    environment = walking("maximal", perception=perception)
    environment.reset(seed=0)
    record = environment.step(RIGHT)[-1]["assistance"]
    assert (record["proposed"], record["executed"]) == (RIGHT, UP)
    assert record["credited"] == credited
    record = environment.step(RIGHT)[-1]["assistance"]
    assert not record["overridden"]
    assert record["credited"] == RIGHT


def test_actions_need_not_start_at_0_nor_observations_be_numbers():
    seen = []

    def values(observation):
        seen.append(observation.tolist())
        return [1, 2, 3]

    environment = SharedControl(Dial(), "maximal", values, discount=1.0)
    _, info = environment.reset()
    assert info["temperature"] == 20
    assert info["assistance"]["proposed"] == -1
    *_, info = environment.step(5)
    assert info["temperature"] == 21
    record = info["assistance"]
    assert [record[key] for key in ("proposed", "executed", "credited")] == [5, 7, 5]
    assert record["projected_return"] == 1.0
    environment.step(7)
    assert of_kind(Dial, environment.unwrapped).asked == [7, 7]
    assert seen == [[0.0, 0.0], [0.5, 0.5], [0.5, 0.5]]


def test_an_interrupted_learner_credits_nothing_wherever_actions_start():
    environment = SharedControl(
        Dial(), "maximal", lambda _: [1, 2, 3], discount=1.0, perception="interruption"
    )
    environment.reset()
    assert environment.step(5)[-1]["assistance"]["credited"] == -1
    assert environment.step(7)[-1]["assistance"]["credited"] == 7


def test_a_kept_record_does_not_change_and_changes_nothing():
    environment = walking("maximal")
    _, info = environment.reset(seed=0)
    info["assistance"]["values"][:] = 0.0
    record = environment.step(RIGHT)[-1]["assistance"]
    assert record["values"].tolist() == [87, -13, 86, 86]
    environment.step(RIGHT)
    assert record["values"].tolist() == [87, -13, 86, 86]


def test_coins_and_ties_are_uniform_and_independent():
    environment = SharedControl(Dial(), "none", lambda _: [1, 2, 3], discount=1.0)
    environment.reset(seed=0)
    drawn = []
    for _ in range(1000):
        returned = play(environment, [5] * 4)
        drawn += [(record["coin"], record["tie"]) for record in records(returned)]
    coins, ties = np.array(drawn).T
    assert len(coins) == 4000
    for numbers in (coins, ties):
        assert ((numbers >= 0) & (numbers < 1)).all()
        # Means of 4,000 uniform numbers have a standard error of 0.00456; z = 4.
        assert abs(numbers.mean() - 0.5) < 0.0183
        assert abs((numbers < 0.1).mean() - 0.1) < 0.019
    # Correlations of 4,000 independent pairs have a standard error of 0.0158; z = 4.
    assert abs(np.corrcoef(coins, ties)[0, 1]) < 0.0633
    assert abs(np.corrcoef(coins[1:], coins[:-1])[0, 1]) < 0.0633


def test_a_rule_remembers_from_one_episode_to_the_next(own_registry):
    register_assistant("budget", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    environment = walking("budget", budget=3)
    first = play(environment, [RIGHT] * 20, seed=0)
    assert first[-1][-1]["assisted_episode"]["overrides"] == 2
    second = play(environment, [RIGHT] * 20)
    assert [record["overridden"] for record in records(second)] == [True] + [False] * 19
    third = play(environment, [RIGHT] * 20)
    assert [step[1] for step in third[1:]] == [-100.0] * 20  # nothing is left of it


def test_values_may_be_those_of_another_task_of_the_same_shape_if_that_is_said():
    other = solve(make_task("FrozenLake-v1", discount=0.95, is_slippery=False))
    with pytest.raises(RequestError, match="made for a task that differs from environment Frozen"):
        skating("maximal", other)
    other = dataclasses.replace(other, made_for="")
    returned = play(skating("maximal", other), [LEFT] * 100, seed=0)
    for record in records(returned):
        assert record["values"][record["executed"]] == record["values"].max()
