"""The compiled trial against the plain one, step by step."""

import numpy as np
import pytest

from qbumpers.assistants import registry
from qbumpers.decisions import Step
from qbumpers.learners import (
    PERCEPTIONS,
    ActorCritic,
    ExpectedSarsa,
    Imitator,
    ModelBased,
    Motor,
    Perception,
    PowerLaw,
    Sarsa,
    Schedule,
    SoftmaxQLearner,
    TwoRate,
)
from qbumpers.simulation import Script, record, run
from qbumpers.tasks import cliff_walking
from tests.narrowing import present
from tests.reference_rules import plain_rule
from tests.reference_simulation import ReferenceTrial
from tests.simulation.conditions import (
    BUMPERS,
    THRESHOLDS,
    half_seen,
    in_a_random_world,
    on_slippery_ice,
    on_the_cliff,
    taken_back,
)

CLUMSY = Motor(slip=0.15, lag=0.25)
SOMETIMES = Perception(0.3, "executed", 2.0)
BUDGET = ("budget", {"of": {"name": BUMPERS[0], **BUMPERS[1]}, "per_episode": 3})
WANDERING = Schedule(0.6, 0.2, 0.5)
LIVELY = SoftmaxQLearner(0.8, 0.7, 0.5, 0.2)

CONDITIONS = {
    "cliff, none": lambda: on_the_cliff(("none", {})),
    "cliff, maximal": lambda: on_the_cliff(("maximal", {})),
    "cliff, thresholds": lambda: on_the_cliff(THRESHOLDS),
    **{
        f"cliff, bumpers, {name}": lambda name=name: on_the_cliff(
            BUMPERS, perception=name, penalty=7.5
        )
        for name in PERCEPTIONS
    },
    "slippery ice": on_slippery_ice,
    "random world": in_a_random_world,
    "cliff, unassisted afterwards": lambda: on_the_cliff(BUMPERS, retention=7),
    "slippery ice, unassisted afterwards, common": lambda: on_slippery_ice(
        retention=9, common_random_numbers=True
    ),
    "random world, unassisted afterwards": lambda: in_a_random_world(retention=11),
    "random world, common": lambda: in_a_random_world(common_random_numbers=True),
    "cliff, common, a single episode": lambda: on_the_cliff(
        BUMPERS, episodes=1, common_random_numbers=True
    ),
    "cliff, sometimes noticed": lambda: on_the_cliff(BUMPERS, perception=SOMETIMES),
    "random world, sometimes noticed": lambda: in_a_random_world(
        perception=Perception(0.7, "nothing")
    ),
    "cliff, sarsa": lambda: on_the_cliff(BUMPERS, learner=Sarsa(epsilon=WANDERING)),
    "cliff, sarsa, interrupted": lambda: on_the_cliff(
        BUMPERS, learner=Sarsa(epsilon=WANDERING), perception="interruption", retention=3
    ),
    "random world, sarsa, common": lambda: in_a_random_world(
        learner=Sarsa(0.8, WANDERING, initial_value=1.5), common_random_numbers=True
    ),
    "cliff, expected sarsa": lambda: on_the_cliff(BUMPERS, learner=ExpectedSarsa()),
    "random world, expected sarsa": lambda: in_a_random_world(learner=ExpectedSarsa(0.8)),
    "cliff, slip and lag": lambda: on_the_cliff(BUMPERS, motor=CLUMSY),
    "random world, slip": lambda: in_a_random_world(motor=Motor(slip=0.2)),
    "cliff, lag, sometimes noticed": lambda: on_the_cliff(
        BUMPERS, motor=Motor(lag=0.2), perception=SOMETIMES, retention=3
    ),
    "cliff, sarsa, slip and lag, forgetting": lambda: on_the_cliff(
        BUMPERS, learner=Sarsa(epsilon=WANDERING), motor=CLUMSY, forgetting=0.1
    ),
    "random world, forgetting": lambda: in_a_random_world(forgetting=0.3, retention=5),
    "random world, by a power law": lambda: in_a_random_world(forgetting=PowerLaw(), retention=5),
    "cliff, softmax": lambda: on_the_cliff(BUMPERS, learner=LIVELY),
    "random world, softmax, by a power law": lambda: in_a_random_world(
        learner=LIVELY._replace(initial_value=1.5), forgetting=PowerLaw(0.3)
    ),
    "cliff, actor-critic": lambda: on_the_cliff(BUMPERS, learner=ActorCritic(initial_value=3.0)),
    "random world, actor-critic, by a power law": lambda: in_a_random_world(
        learner=ActorCritic(0.8, Schedule(0.5, 0.1, 0.5)), forgetting=PowerLaw()
    ),
    "cliff, model": lambda: on_the_cliff(
        BUMPERS, learner=ModelBased(epsilon=WANDERING), perception="observant"
    ),
    "random world, model, by a power law": lambda: in_a_random_world(
        learner=ModelBased(0.8, WANDERING, 3, initial_value=1.5), forgetting=PowerLaw()
    ),
    "cliff, imitator": lambda: on_the_cliff(BUMPERS, learner=Imitator(WANDERING)),
    "random world, imitator, forgetting": lambda: in_a_random_world(
        learner=Imitator(WANDERING), perception="disruption", forgetting=0.3
    ),
    "cliff, two rates": lambda: on_the_cliff(BUMPERS, learner=TwoRate(epsilon=WANDERING)),
    "random world, two rates, forgetting": lambda: in_a_random_world(
        learner=TwoRate(0.8, WANDERING), forgetting=0.3
    ),
    "random world, half seen": half_seen,
    "cliff, budget": lambda: on_the_cliff(BUDGET),
    **{
        f"cliff, taken back, {name}": lambda name=name: taken_back(perception=name, penalty=2.5)
        for name in PERCEPTIONS
    },
    "cliff, taken back, sarsa, observant": lambda: taken_back(
        learner=Sarsa(epsilon=WANDERING), perception="observant"
    ),
    "cliff, taken back, sarsa, sometimes": lambda: taken_back(
        learner=Sarsa(epsilon=WANDERING), perception=SOMETIMES
    ),
}
SEED, TRIALS = 11, range(2, 5)
# What a perception does is one table; two of them stand for all where a step is taken back. Of
# forgetting it is tables of other widths that matter, those of the model.
LONGER = {
    *(f"cliff, taken back, {name}" for name in [*PERCEPTIONS][1:-1]),
    "random world, softmax, by a power law",
    "random world, imitator, forgetting",
    "random world, two rates, forgetting",
    "random world, actor-critic, by a power law",
    "random world, sarsa, common",
    "random world, expected sarsa",
    "random world, model, by a power law",
    "random world, slip",
    "cliff, sarsa, slip and lag, forgetting",
    "cliff, taken back, sarsa, sometimes",
}


def plain_trial(condition, trial, seed=SEED):
    assistant = condition.assistant
    rule = plain_rule(assistant.name, **assistant.described())
    return ReferenceTrial(
        condition, rule.decide, seed=seed, trial=trial, observe=rule.observe
    ).run()


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=[pytest.mark.slow] if name in LONGER else [])
        for name in CONDITIONS
    ],
)
def condition(request):
    with pytest.MonkeyPatch.context() as patch:  # own rules are forgotten afterwards
        for name in ("_rules", "_rules_by_options"):
            patch.setattr(registry, name, dict(getattr(registry, name)))
        yield CONDITIONS[request.param]()


@pytest.fixture(scope="module")
def plain_trials(condition):
    return [plain_trial(condition, trial) for trial in TRIALS]


def test_every_assisted_step_is_the_plain_simulations(condition, plain_trials):
    for trial, plain in zip(TRIALS, plain_trials, strict=True):
        found = record(condition, trial=trial, seed=SEED)
        for field in Step._fields:
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
    counts = present(run(condition, trials=TRIALS, seed=SEED).counts)
    for field, found in counts._asdict().items():
        expected = np.sum([plain.counts[field] for plain in plain_trials], axis=0)
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
        unassisted = [step for step in steps if step.episode >= condition.episodes]
        assert {step.probability for step in unassisted} == {0.0}
        assert len({step.credited for step in unassisted}) > 1
    if condition.assistant.name == "budget":
        overrides = [episode["assisted_overrides"] for episode in episodes]
        assert max(overrides) == condition.assistant.options.per_episode > min(overrides)
    if condition.assistant.name == "take-back":
        assert 0 < sum(step.undone for step in steps) == overridden
    if condition.assistant.name != "none" and condition.perceived().notices == 0.3:
        credited = [step.credited == step.executed for step in steps if step.overridden]
        undone = any(step.undone for step in steps)
        assert undone or 0.1 < sum(credited) / len(credited) < 0.5
    lengths = {episode["assisted_length"] for episode in episodes}
    assert min(lengths) < condition.task.episode_limit or condition.episodes == 1


def test_a_script_of_a_deterministic_task_repeats_its_trial():
    condition = on_the_cliff(BUMPERS)
    first = record(condition, trial=3, seed=SEED)
    again = record(condition, script=Script(first.proposed, first.coin, first.tie))
    for field in Step._fields:
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
    terminated, success, crash, limit = ((found.events & bit) > 0 for bit in (1, 2, 4, 16))
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
    assert np.array_equal(limit, last & ~terminated)
    assert limit.any()
