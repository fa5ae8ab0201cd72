"""Requests that shared control refuses, each with the field and the value in its message."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.wrappers import TransformReward

from qbumpers import RequestError, SharedControl, TabularValues, make_assistant
from qbumpers.assistants import register_assistant
from qbumpers.decisions import Decision
from tests.assistants.own_rules import NoOptions
from tests.shared_control_examples import CLIFF, LEFT, UP, Dial, bumpers, walking


def test_an_action_space_without_numbered_actions_is_refused():
    pendulum = gymnasium.make("Pendulum-v1")
    with pytest.raises(RequestError, match=r"action space Box\(-2\.0, 2\.0, .*Discrete"):
        SharedControl(pendulum, "none", CLIFF)


@pytest.mark.parametrize("values", [np.zeros((48, 4)).tolist(), {36: [0.0] * 4}, None, 3])
def test_values_that_cannot_be_called_are_refused(values):
    with pytest.raises(RequestError, match=r"values = .*; a table \[48, 4\] is needed for env"):
        SharedControl(gymnasium.make("qbumpers/CliffWalking-v0"), "none", values, discount=0.9)


@pytest.mark.parametrize("environment", ["Taxi-v4", "CartPole-v1"])
def test_a_table_of_another_environment_is_named(environment):
    with pytest.raises(RequestError, match=r"a table \[48, 4\]; environment .* needs"):
        SharedControl(gymnasium.make(environment), "none", CLIFF)


def test_a_discount_that_is_no_number_is_refused():
    with pytest.raises(RequestError, match=r"discount = 'high'; a number in \(0, 1\] is needed"):
        walking("none", values=lambda state: [0.0] * 4, discount="high")


def test_an_unknown_assistant_names_the_nearest():
    with pytest.raises(RequestError, match=r"assistant 'maximum'.*did you mean 'maximal'"):
        walking("maximum")


def test_an_unknown_option_names_the_nearest():
    with pytest.raises(RequestError, match=r"'alhpa'.*did you mean 'alpha'"):
        walking("stochastic-q-bumpers", alhpa=0.7)


@pytest.mark.parametrize("option", ["gamma", "discuont"])
def test_another_word_for_an_argument_of_the_wrapper_is_named(option):
    with pytest.raises(RequestError, match=rf"'{option}' \(did you mean 'discount'\?\)"):
        walking("stochastic-q-bumpers", **{option: 0.9})


def test_a_missing_option_is_named():
    with pytest.raises(RequestError, match=r"stochastic-q-bumpers: alpha: .*required"):
        walking("stochastic-q-bumpers")


def test_an_option_out_of_range_is_named():
    with pytest.raises(RequestError, match=r"alpha = 1\.5: .*less than or equal to 1"):
        walking(**bumpers(alpha=1.5))


def test_options_do_not_go_with_an_assistant_that_has_its_own():
    assistant = make_assistant("stochastic-q-bumpers", alpha=0.7)
    with pytest.raises(RequestError, match=r"options \['alpha'\] go with an assistant's name"):
        walking(assistant, alpha=0.7)


def test_an_unknown_perception_names_the_nearest():
    with pytest.raises(RequestError, match=r"perception 'observent'.*did you mean 'observant'"):
        walking("none", perception="observent")


def test_a_missing_discount_is_asked_for():
    with pytest.raises(RequestError, match="discount is missing"):
        SharedControl(Dial(), "none", lambda _: [1, 2, 3])


def test_a_discount_that_contradicts_the_values_is_refused():
    with pytest.raises(RequestError, match=r"discount = 0\.9, but the values were made with 1\.0"):
        walking("none", discount=0.9)
    assert walking("none", discount=1.0).discount == 1.0


@pytest.mark.parametrize("discount", [0, -0.5, 1.01, float("nan")])
def test_a_discount_out_of_range_is_refused(discount):
    with pytest.raises(RequestError, match=f"discount = {discount}; it must lie in"):
        SharedControl(Dial(), "none", lambda _: [1, 2, 3], discount=discount)


def test_a_discount_out_of_range_in_the_values_is_refused():
    with pytest.raises(RequestError, match=r"discount = 3\.0; it must lie in"):
        TabularValues(np.zeros((48, 4)), discount=3.0, task="", method="")
    stated: Any = lambda _: [0.0] * 4  # noqa: E731
    stated.discount = 3.0
    with pytest.raises(RequestError, match=r"discount = 3\.0; it must lie in"):
        walking("none", stated)


def test_a_values_file_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(RequestError, match=r"nowhere\.npz: there is none"):
        walking("none", str(tmp_path / "nowhere.npz"))
    with pytest.raises(RequestError, match=r"nowhere\.npz: there is none"):
        walking("none", tmp_path / "nowhere.npz")


@pytest.mark.parametrize("row", [[1.0, 2.0, 3.0], [0.0] * 5, 1.0, [[0.0] * 4]])
def test_values_of_another_width_are_refused_at_reset(row):
    environment = walking("none", lambda _: row, discount=1.0)
    with pytest.raises(RequestError, match=r"Q values at reset have shape .*\(4,\), is needed"):
        environment.reset()


def test_values_that_are_not_finite_are_refused_at_reset():
    environment = walking("none", lambda _: [1.0, np.nan, 0.0, 0.0], discount=1.0)
    with pytest.raises(RequestError, match=r"Q values at reset are .*nan.*must be finite"):
        environment.reset()


def test_values_that_turn_bad_later_are_refused_at_their_step():
    rows = iter([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 2.0, np.inf]])
    environment = SharedControl(Dial(), "none", lambda _: next(rows), discount=1.0)
    environment.reset()
    environment.step(5)
    with pytest.raises(RequestError, match=r"Q values after step 2 are .*inf"):
        environment.step(5)


def test_the_state_after_an_episodes_end_needs_no_values():
    # The values of terminal states need not exist.
    environment = SharedControl(
        Dial(), "none", lambda observation: [1, 2, 3] if observation.any() else [3, 2, 1],
        discount=1.0,
    )  # fmt: skip
    environment.reset()
    for _ in range(3):
        environment.step(5)
    environment.values = lambda _: [np.nan] * 3
    assert environment.step(5)[2]


@pytest.mark.parametrize("v_min", [87.0, 90.0])
def test_a_floor_that_is_not_below_the_start_value_is_refused_at_reset(v_min):
    environment = walking(**bumpers(v_min=v_min))
    with pytest.raises(
        RequestError,
        match=rf"stochastic-q-bumpers: v_min = {v_min:g} must be below .*V\*\(s_0\) = 87",
    ):
        environment.reset()


@pytest.mark.parametrize("action", [-1, 4, 100])
def test_an_action_out_of_range_is_refused(action):
    environment = walking("none")
    environment.reset(seed=0)
    with pytest.raises(RequestError, match=rf"action = {action}; it must lie in \[0, 4\)"):
        environment.step(action)


@pytest.mark.parametrize("action", [4, 8, 0])
def test_an_action_out_of_a_range_that_starts_later_is_refused(action):
    environment = SharedControl(Dial(), "none", lambda _: [1, 2, 3], discount=1.0)
    environment.reset()
    with pytest.raises(RequestError, match=rf"action = {action}; it must lie in \[5, 8\)"):
        environment.step(action)


@pytest.mark.parametrize("action", [1.9, 1.0, np.float32(1), "1", None, [1], np.array([1])])
def test_an_action_that_is_not_a_whole_number_is_refused(action):
    environment = walking("none")
    environment.reset(seed=0)
    with pytest.raises(RequestError, match=r"action = .*; a whole number in \[0, 4\) is needed"):
        environment.step(action)


@pytest.mark.parametrize("action", [1, np.int64(1), np.uint8(1), np.array(1), True])
def test_whole_numbers_of_any_kind_are_actions(action):
    environment = walking("none")
    environment.reset(seed=0)
    assert environment.step(action)[4]["assistance"]["executed"] == 1


@pytest.mark.parametrize("reward", [np.nan, np.inf, -np.inf])
def test_a_reward_that_is_not_finite_is_refused_and_the_episode_is_over(reward):
    environment = walking(**bumpers())
    environment.reset(seed=0)
    environment.step(UP)
    inner = environment.env
    environment.env = TransformReward(inner, lambda _: reward)
    with pytest.raises(RequestError, match=rf"reward = {reward} of step 2; it must be finite"):
        environment.step(UP)
    environment.env = inner
    with pytest.raises(ResetNeeded):
        environment.step(UP)
    environment.reset()
    environment.step(UP)


@pytest.mark.parametrize(
    ("decision", "what"),
    [
        (Decision(1.5, 0.0), r"Decision\(action=1\.5.*whole number"),  # type: ignore[arg-type]
        (Decision(4, 0.0), r"Decision\(action=4.*whole number"),
        (Decision(1, 2.0), r".*probability=2\.0.*probability of an override"),
        (Decision(1, np.nan), r".*probability=nan.*probability of an override"),
    ],
)
def test_a_decision_that_cannot_be_executed_names_the_rule(decision, what):
    register_assistant("odd", NoOptions)(lambda situation, noise, options: decision)
    environment = walking("odd")
    environment.reset(seed=0)
    with pytest.raises(RequestError, match=f"assistant odd: {what}"):
        environment.step(UP)


def test_a_refused_action_is_no_step():
    environment = walking("none")
    environment.reset(seed=0)
    with pytest.raises(RequestError, match="action = 7"):
        environment.step(7)
    for _ in range(99):
        *_, truncated, info = environment.step(LEFT)
        assert not truncated
    *_, truncated, info = environment.step(LEFT)
    assert truncated
    assert info["assisted_episode"]["length"] == 100


def test_a_step_before_reset_is_refused():
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        walking("none").step(0)


def test_a_step_after_the_end_is_refused_until_reset():
    environment = SharedControl(Dial(), "none", lambda _: [1, 2, 3], discount=1.0)
    environment.reset()
    for _ in range(4):
        environment.step(5)
    with pytest.raises(ResetNeeded, match="after an episode's end"):
        environment.step(5)
    environment.reset()
    assert environment.step(5)[1] == 1.0


def test_a_reset_that_failed_starts_no_episode():
    rows = iter([[1.0, 2.0, 3.0], [np.nan] * 3])
    environment = SharedControl(Dial(), "none", lambda _: next(rows), discount=1.0)
    environment.reset()
    with pytest.raises(RequestError, match="Q values at reset"):
        environment.reset()
    with pytest.raises(ResetNeeded):
        environment.step(5)


@pytest.mark.parametrize(
    "noise", [[0.5, 0.5], [(0.5,)], [(0.5, 0.5, 0.5)], [(1.0, 0.5)], [(0.5, -0.1)], [(np.nan, 0.5)]]
)
def test_noise_that_is_no_pairs_of_chances_is_refused(noise):
    environment = walking("none")
    with pytest.raises(RequestError, match=r"noise .*\[N, 2\].*\[0, 1\)"):
        environment.reset(options={"noise": noise})


def test_recorded_noise_that_runs_out_is_an_error_and_no_step():
    environment = walking("none")
    environment.reset(options={"noise": [(0.5, 0.5), (0.25, 0.75)]})
    environment.step(LEFT)
    record = environment.step(LEFT)[-1]["assistance"]
    assert (record["coin"], record["tie"]) == (0.25, 0.75)
    with pytest.raises(RequestError, match=r"noise: .*run out before the episode ended"):
        environment.step(LEFT)
    environment.reset()  # fresh noise again
    assert environment.step(LEFT)[-1]["assistance"]["reward"] == -1.0


def test_no_recorded_noise_at_all_runs_out_at_once():
    environment = walking("none")
    environment.reset(options={"noise": []})
    with pytest.raises(RequestError, match="run out"):
        environment.step(LEFT)
