"""Shared control among Gymnasium's own wrappers, and in vectors of environments."""

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers

from qbumpers import SharedControl
from tests.shared_control_examples import (
    CLIFF,
    LADDER,
    LAKE,
    LEFT,
    RIGHT,
    bumpers,
    ladder,
    plain,
    play,
    walking,
)


def climbing(inner: gymnasium.Env) -> SharedControl:
    return SharedControl(inner, "none", LADDER)


def test_gymnasiums_own_checks_pass_over_it():
    checked = wrappers.OrderEnforcing(wrappers.PassiveEnvChecker(walking(**bumpers())))
    returned = play(checked, [RIGHT] * 100, seed=0)
    assert returned[-1][2]


def test_a_time_limit_inside_ends_the_record():
    returned = play(climbing(wrappers.TimeLimit(ladder(), 3)), [0] * 9)
    assert [step[3] for step in returned[1:]] == [False, False, True]
    assert returned[-1][-1]["assisted_episode"]["length"] == 3


def test_a_time_limit_outside_cuts_the_episode_off():
    environment = wrappers.TimeLimit(climbing(ladder()), 3)
    returned = play(environment, [0] * 9)
    assert [step[3] for step in returned[1:]] == [False, False, True]
    assert "assisted_episode" not in returned[-1][-1]  # the assistant never saw an end
    again = play(environment, [0, 1, 1])
    assert again[-1][-1]["assisted_episode"]["return"] == 1.0
    assert again[-1][-1]["assisted_episode"]["length"] == 3


def test_a_changed_reward_inside_is_what_the_assistant_counts():
    inside = climbing(wrappers.TransformReward(ladder(), lambda reward: 10 * float(reward)))
    returned = play(inside, [0, 1, 1])
    assert [step[1] for step in returned[1:]] == [-30.0, 20.0, 20.0]
    second = returned[2][-1]["assistance"]
    assert second["reward"] == 20.0
    assert second["projected_return"] == pytest.approx(-30.0 + 0.9 * 3.8)
    assert returned[-1][-1]["assisted_episode"]["return"] == 10.0


def test_a_changed_reward_outside_is_none_of_the_assistants_business():
    outside = wrappers.TransformReward(climbing(ladder()), lambda reward: 10 * float(reward))
    returned = play(outside, [0, 1, 1])
    assert [step[1] for step in returned[1:]] == [-30.0, 20.0, 20.0]
    second = returned[2][-1]["assistance"]
    assert second["reward"] == 2.0
    assert second["projected_return"] == pytest.approx(-3.0 + 0.9 * 3.8)
    assert returned[-1][-1]["assisted_episode"]["return"] == 1.0


@pytest.mark.parametrize("inside", [True, False])
def test_recorded_statistics_are_those_of_the_summary(inside):
    if inside:
        cliff = gymnasium.make("qbumpers/CliffWalking-v0")
        environment = SharedControl(
            wrappers.RecordEpisodeStatistics(cliff), values=CLIFF, **bumpers()
        )
    else:
        environment = wrappers.RecordEpisodeStatistics(walking(**bumpers()))
    generator = np.random.default_rng(0)
    info = play(environment, generator.integers(4, size=200), seed=0)[-1][-1]
    assert info["episode"]["r"] == info["assisted_episode"]["return"]
    assert info["episode"]["l"] == info["assisted_episode"]["length"]
    assert info["assisted_episode"]["overrides"] > 0


def test_an_observation_changed_inside_is_what_the_values_see():
    flat = wrappers.FlattenObservation(gymnasium.make("qbumpers/CliffWalking-v0"))
    environment = SharedControl(flat, "maximal", lambda one: CLIFF(one.argmax()), discount=1.0)
    observation, _ = environment.reset(seed=0)
    assert observation.shape == (48,)
    assert play(environment, [RIGHT] * 20, seed=0)[-1][-1]["assisted_episode"]["return"] == 87


def test_an_observation_changed_outside_leaves_the_values_theirs():
    environment = wrappers.FlattenObservation(walking("maximal"))
    returned = play(environment, [RIGHT] * 20, seed=0)
    assert returned[0][0].shape == (48,)
    assert returned[-1][-1]["assisted_episode"]["return"] == 87


def vectors() -> list[gymnasium.vector.VectorEnv]:
    """Three lakes under bumpers, made in both ways that Gymnasium has."""

    def share(lake: gymnasium.Env) -> SharedControl:
        return SharedControl(lake, values=LAKE, **bumpers(alpha=0.9, v_min=-0.1))

    thunks = [lambda: share(gymnasium.make("FrozenLake-v1", is_slippery=True))] * 3
    return [
        gymnasium.vector.SyncVectorEnv(thunks),
        gymnasium.make_vec(
            "FrozenLake-v1",
            num_envs=3,
            vectorization_mode="sync",
            wrappers=[share],
            is_slippery=True,
        ),
    ]


@pytest.mark.parametrize("made", [0, 1], ids=["list", "make_vec"])
def test_each_environment_of_a_vector_is_as_it_is_alone(made):
    vector = vectors()[made]
    single = [
        SharedControl(
            gymnasium.make("FrozenLake-v1", is_slippery=True),
            values=LAKE,
            **bumpers(alpha=0.9, v_min=-0.1),
        )
        for _ in range(3)
    ]
    ended = [False] * 3
    _, infos = vector.reset(seed=[5, 6, 7])
    alone = [environment.reset(seed=5 + i)[1] for i, environment in enumerate(single)]
    generator = np.random.default_rng(0)
    endings = 0
    for _ in range(120):
        for key in ("values", "coin", "executed", "projected_return"):
            expected = [info["assistance"][key] for info in alone]
            assert plain(infos["assistance"][key]) == plain(expected)
        if any(ended):
            lengths = [info.get("assisted_episode", {}).get("length", 0) for info in alone]
            assert infos["assisted_episode"]["length"].tolist() == lengths
            endings += sum(ended)
        actions = generator.integers(4, size=3)
        _, _, terminations, truncations, infos = vector.step(actions)
        # Vectors reset an environment in the step after its end, whatever the action.
        alone = [
            environment.reset()[1] if over else environment.step(action)[-1]
            for environment, over, action in zip(single, ended, actions, strict=True)
        ]
        ended = (terminations | truncations).tolist()
    assert endings >= 3
    vector.close()


def test_statistics_of_a_vector_count_assisted_episodes():
    vector = gymnasium.make_vec(
        "qbumpers/CliffWalking-v0",
        num_envs=2,
        vectorization_mode="sync",
        wrappers=[lambda cliff: SharedControl(cliff, "maximal", CLIFF)],
    )
    vector = wrappers.vector.RecordEpisodeStatistics(vector)
    vector.reset(seed=0)
    *_, infos = [vector.step(np.array([LEFT, RIGHT])) for _ in range(13)][-1]
    assert infos["episode"]["r"].tolist() == [87.0, 87.0]
    assert infos["assisted_episode"]["overrides"].tolist() == [13, 2]
    vector.close()
