"""The compiled trial against the plain one, step by step."""

from functools import partial

import numpy as np
import pytest

from qbumpers.learners import PERCEPTIONS, QLearner
from qbumpers.simulation import Script, Steps, record, run
from qbumpers.tasks import cliff_walking
from tests.reference_simulation import RULES, ReferenceTrial
from tests.simulation.conditions import (
    BUMPERS,
    THRESHOLDS,
    in_a_random_world,
    on_slippery_ice,
    on_the_cliff,
)

CONDITIONS = {
    "cliff, none": on_the_cliff(("none", {})),
    "cliff, maximal": on_the_cliff(("maximal", {})),
    "cliff, thresholds": on_the_cliff(THRESHOLDS),
    **{
        f"cliff, bumpers, {name}": on_the_cliff(
            BUMPERS, perception=name, learner=QLearner(penalty=7.5)
        )
        for name in PERCEPTIONS
    },
    "slippery ice": on_slippery_ice(),
    "random world": in_a_random_world(),
    "cliff, alone afterwards": on_the_cliff(BUMPERS, retention=7),
    "slippery ice, alone afterwards, common": on_slippery_ice(
        retention=9, common_random_numbers=True
    ),
    "random world, alone afterwards": in_a_random_world(retention=11),
    "random world, common": in_a_random_world(common_random_numbers=True),
    "cliff, common, a single episode": on_the_cliff(
        BUMPERS, episodes=1, common_random_numbers=True
    ),
}
SEED, TRIALS = 11, range(2, 5)


def plain_trial(condition, trial, seed=SEED):
    rule = partial(RULES[condition.assistant.name], **condition.assistant.options._asdict())
    return ReferenceTrial(condition, rule, seed=seed, trial=trial).run()


@pytest.fixture(scope="module", params=CONDITIONS)
def condition(request):
    return CONDITIONS[request.param]


@pytest.fixture(scope="module")
def plain_trials(condition):
    return [plain_trial(condition, trial) for trial in TRIALS]


def test_every_assisted_step_is_the_plain_simulations(condition, plain_trials):
    for trial, plain in zip(TRIALS, plain_trials, strict=True):
        found = record(condition, trial=trial, seed=SEED)
        for field in Steps._fields:
            expected = np.array([getattr(step, field) for step in plain.steps])
            # Two ways to write the logistic differ by a few units in the last place.
            tolerance = 1e-12 if field == "probability" else 0.0
            np.testing.assert_allclose(
                getattr(found, field), expected, rtol=0, atol=tolerance, err_msg=field
            )


def test_every_outcome_is_the_plain_simulations(condition, plain_trials):
    outcomes = run(condition, trials=TRIALS, seed=SEED).outcomes
    for field, found in outcomes._asdict().items():
        name = "assisted_overrides" if field == "overrides" else field
        expected = [[episode[name] for episode in plain.episodes] for plain in plain_trials]
        assert found.tolist() == expected, field


def test_every_count_is_the_plain_simulations(condition, plain_trials):
    counts = run(condition, trials=TRIALS, seed=SEED).counts
    for field, found in counts._asdict().items():
        expected = sum(plain.counts[field] for plain in plain_trials)
        assert found.tolist() == expected.tolist(), field


def test_the_conditions_compared_reach_every_kind_of_step(plain_trials, condition):
    """Agreement would mean little if nothing was ever overridden, kept, tied or ended."""
    steps = [step for plain in plain_trials for step in plain.steps]
    episodes = [episode for plain in plain_trials for episode in plain.episodes]
    overridden = sum(step.overridden for step in steps)
    if condition.assistant.name != "none":
        assert 0 < overridden < len(steps)
    if condition.assistant.name == "stochastic-q-bumpers":
        assert any(0 < step.probability < 1 for step in steps)
    if condition.retention:
        alone = [step for step in steps if step.episode >= condition.episodes]
        assert {step.probability for step in alone} == {0.0}
        assert len({step.credited for step in alone}) > 1
    lengths = {episode["assisted_length"] for episode in episodes}
    assert min(lengths) < condition.task.episode_limit or condition.episodes == 1


def test_a_script_of_a_deterministic_task_repeats_its_trial():
    condition = on_the_cliff(BUMPERS)
    first = record(condition, trial=3, seed=SEED)
    again = record(condition, script=Script(first.proposed, first.coin, first.tie))
    for field in Steps._fields:
        assert np.array_equal(getattr(again, field), getattr(first, field)), field


def test_a_trial_ends_with_its_script():
    condition = on_the_cliff(("none", {}))
    up = np.zeros(7, np.int64)
    found = record(condition, script=Script(up, np.zeros(7), np.zeros(7)))
    assert found.proposed.tolist() == [0] * 7
    assert found.state.tolist() == [36, 24, 12, 0, 0, 0, 0]
    assert found.next_state.tolist() == [24, 12, 0, 0, 0, 0, 0]


def test_a_step_leads_to_where_the_next_one_begins_and_tells_how_it_ended():
    """A closed form of Cliff Walking: the goal is cell (3, 11), the cliff (3, 1) to (3, 10)."""
    found = record(on_the_cliff(BUMPERS, episodes=30, retention=5), trial=1, seed=SEED)
    same = found.episode[1:] == found.episode[:-1]
    assert (found.next_state[:-1][same] == found.state[1:][same]).all()
    assert (found.state[1:][~same] == 36).all()
    terminated, success, crash = ((found.events & bit) > 0 for bit in (1, 2, 4))
    arrived = (found.executed == 2) & (found.state == 35)  # down, from above the goal
    assert np.array_equal(terminated, arrived)
    assert np.array_equal(success, arrived)
    assert np.array_equal(crash, found.reward == -100)
    assert (found.next_state[crash] == 36).all()
    assert arrived.any()
    assert crash.any()
    last = np.append(~same, True)
    lengths = np.bincount(found.episode)
    assert (terminated[last] | (lengths == cliff_walking().episode_limit)).all()
