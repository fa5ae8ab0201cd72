"""A learner that knows nothing of assistants trains inside shared control unchanged."""

import gymnasium
import numpy as np
import pytest

from tests.narrowing import of_kind
from tests.shared_control_examples import RIGHT, UP, bumpers, walking

START = 36


def train(environment: gymnasium.Env, episodes: int, seed: int) -> np.ndarray:
    """Undiscounted tabular Q-learning, epsilon and learning rate falling together; Q [S, A]."""
    generator = np.random.default_rng(seed)
    sizes = (environment.observation_space, environment.action_space)
    table = np.zeros([of_kind(gymnasium.spaces.Discrete, space).n for space in sizes])
    environment.reset(seed=seed)
    for episode in range(episodes):
        rate = max(0.02, 1 - episode / (0.9 * episodes))
        state, ended = environment.reset()[0], False
        while not ended:
            best = np.flatnonzero(table[state] == table[state].max())
            explores = generator.random() < rate
            action = int(generator.choice(len(table[state]) if explores else best))
            following, reward, terminated, truncated, _ = environment.step(action)
            target = float(reward) + (0 if terminated else table[following].max())
            table[state, action] += rate * (target - table[state, action])
            state, ended = following, terminated or truncated
    return table


def greedy_returns(table: np.ndarray, seed: int) -> list[float]:
    """Undiscounted returns of 20 greedy unassisted episodes, ties broken at random."""
    environment = gymnasium.wrappers.RecordEpisodeStatistics(
        gymnasium.make("qbumpers/CliffWalking-v0")
    )
    generator, returns = np.random.default_rng(seed), []
    for _ in range(20):
        (state, info), ended = environment.reset(), False
        while not ended:
            best = np.flatnonzero(table[state] == table[state].max())
            state, _, terminated, truncated, info = environment.step(int(generator.choice(best)))
            ended = terminated or truncated
        returns.append(float(info["episode"]["r"]))
    return returns


@pytest.mark.parametrize("seed", range(2))
def test_a_learner_under_wide_bumpers_learns_the_task(seed):
    # Down to a return of -200 a learner may fall off twice. With each of six seeds every greedy
    # episode afterwards was optimal; two of them are kept.
    environment = gymnasium.wrappers.RecordEpisodeStatistics(
        walking(**bumpers(alpha=1.0, v_min=-200.0)), buffer_length=400
    )
    table = train(environment, 400, seed)
    assert min(environment.return_queue) >= -200  # assisted: unassisted, below -1,000
    assert greedy_returns(table, seed) == [87.0] * 20


@pytest.mark.parametrize("seed", range(2))
def test_a_learner_under_maximal_assistance_learns_what_is_false(seed):
    # Whatever it chooses at the start goes well, so it believes that walking off the cliff does.
    table = train(walking("maximal"), 400, seed)
    assert table[START, UP] == pytest.approx(87, abs=1)
    assert table[START, RIGHT] == pytest.approx(87, abs=1)  # in truth -13
    assert np.mean(greedy_returns(table, seed)) < -100
