import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import RequestError, load, make_assistant, simulate, solve
from qbumpers.assistants.shield import ShieldOptions, shield
from qbumpers.decisions import Decision, Noise
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.tasks import TabularTask, cliff_walking
from tests import reference_rules as plain
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import assert_decides, fractions, noises, situation_of, situations

NOISE = Noise(0.5, 0.5)


def guarded(values, safety, proposed, **changes):
    situation = situation_of(values, proposed, **changes)
    return situation._replace(others=np.array([safety], float))


@st.composite
def guarded_situations(draw):
    situation = draw(situations())
    width = len(situation.values)
    safety = draw(st.lists(fractions(0, 1, 4), min_size=width, max_size=width))
    return situation._replace(others=np.array([safety]))


@given(guarded_situations(), noises, fractions(0, 1, 4))
def test_agrees_with_the_plain_rule(situation, noise, threshold):
    expected = plain.shield(situation, noise, threshold)
    assert_decides(shield, situation, noise, ShieldOptions(threshold), expected)


def test_the_best_of_the_actions_that_are_safe_enough_replaces_an_unsafe_one():
    situation = guarded([9.0, 5.0, 7.0, 8.0], [0.5, 1.0, 0.75, 0.25], 0)
    assert shield(situation, NOISE, ShieldOptions(0.5)) == Decision(0, 0.0)
    assert shield(situation, NOISE, ShieldOptions(0.75)) == Decision(2, 1.0)
    assert shield(situation, NOISE, ShieldOptions(0.8)) == Decision(1, 1.0)


def test_if_nothing_is_safe_enough_the_safest_action_is_executed():
    situation = guarded([9.0, 5.0, 7.0], [0.25, 0.5, 0.375], 0)
    assert shield(situation, NOISE, ShieldOptions(0.75)) == Decision(1, 1.0)
    kept = situation._replace(proposed=1)
    assert shield(kept, NOISE, ShieldOptions(0.75)) == Decision(1, 0.0)


def test_a_safe_waste_goes_on_which_bumpers_end():
    # 80 of 87 are wasted, and moving away from the cliff wastes more.
    situation = guarded([92.0, 94.0, 92.0], [1.0, 1.0, 1.0], 0, earned=-80.0, start_value=87.0)
    assert shield(situation, NOISE, ShieldOptions(1.0)) == Decision(0, 0.0)
    assert bumpers(situation, NOISE) == Decision(1, 1.0)


def test_on_cliff_walking_it_works_without_further_ado_and_nobody_falls():
    found = simulate(cliff_walking(), make_assistant("shield", threshold=1.0), trials=3).outcomes
    assert (found.assisted_return >= -100).all()  # no step costs more than 1
    assert (found.overrides > 0).any()


def test_an_experiment_can_name_it_without_further_ado(tmp_path):
    fields = {"name": "shields", "task": "cliff-walking", "trials": 1, "episodes": 3}
    made = make_experiment({**fields, "assistants": [{"name": "shield", "threshold": [0.5, 1.0]}]})
    run_experiment(make_plan(made), tmp_path / "shields")
    found = load(tmp_path / "shields").episodes
    assert found["condition"].unique().len() == 2
    assert (found["assisted_return"] >= -100).all()


def test_it_can_be_played_with_values_that_were_solved_for_it():
    values = solve(cliff_walking(), others=("safety",))
    found = simulate(
        cliff_walking(), make_assistant("shield", threshold=1.0), values=values, trials=1
    )
    again = simulate(cliff_walking(), make_assistant("shield", threshold=1.0), trials=1)
    assert np.array_equal(found.outcomes.assisted_return, again.outcomes.assisted_return)


def test_a_task_without_crashes_has_no_safety():
    still = np.ones((1, 2, 1))
    task = TabularTask.from_arrays(
        still, [[0.0, 1.0]], [False], 0, discount=0.5, episode_limit=3, name="still"
    )
    with pytest.raises(RequestError, match=r"still announces no crash, .*: give the task crash="):
        simulate(task, make_assistant("shield", threshold=1.0))


def test_the_threshold_is_a_probability():
    with pytest.raises(RequestError, match="shield: threshold = 2"):
        make_assistant("shield", threshold=2)
