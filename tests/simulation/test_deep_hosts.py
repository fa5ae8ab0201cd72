"""A session at Lunar Lander decides alike in the simulator and in the Gymnasium wrapper."""

import gymnasium
import numpy as np
import pytest

from qbumpers import SharedControl, make_task, shipped_expert
from qbumpers.assistants import make_assistant
from qbumpers.learners import DoubleDQN, Schedule
from qbumpers.networks import Network
from qbumpers.simulation import make_condition, record, run
from qbumpers.values import NetworkValues

COLUMNS = (
    "proposed",
    "executed",
    "credited",
    "probability",
    "values",
    "projected_return",
    "reward",
)


@pytest.mark.parametrize(
    ("name", "options"),
    [("stochastic-q-bumpers", {"alpha": 0.8}), ("local-q-thresholding", {"alpha": 0.9})],
)
def test_the_wrapper_repeats_a_simulated_session(name, options):
    expert = shipped_expert("lunar-lander")
    condition = make_condition(
        make_task("lunar-lander"), make_assistant(name, **options), values=expert, episodes=2
    )
    steps = record(condition)
    assert 0 < steps.overridden.sum() < len(steps.overridden)
    environment = gymnasium.make("qbumpers/LunarLander-v0")
    with SharedControl(environment, name, expert, **options) as shared:
        for episode in range(2):
            here = steps.episode == episode
            noise = list(zip(steps.coin[here], steps.tie[here], strict=True))
            observation, _ = shared.reset(options={"noise": noise})
            np.testing.assert_array_equal(observation, steps.state[here][0])
            rows, ended = [], False
            for proposed in steps.proposed[here]:
                observation, _, ended, _, info = shared.step(int(proposed))
                rows.append(info["assistance"])
            assert ended
            np.testing.assert_array_equal(observation, steps.next_state[here][-1])
            for column in COLUMNS:
                found = np.array([row[column] for row in rows])
                np.testing.assert_array_equal(found, getattr(steps, column)[here], err_msg=column)


@pytest.mark.slow
def test_learners_balance_a_pole():
    """Random play and untrained learners keep it up for 9 to 22 steps."""
    network = Network((4,))
    unused = np.zeros(network.layout(4, 2).parameters())
    learner = DoubleDQN(
        network=Network((64, 64), "tanh"),
        batch_size=64,
        replay_size=100_000,
        target_every=250,
        epsilon=Schedule(1.0, 0.02, 0.3),
    )
    condition = make_condition(
        make_task("CartPole-v1", discount=0.99),
        "none",
        values=NetworkValues(network, 4, 2, unused, 0.99, "CartPole-v1", "zeros"),
        learner=learner,
        episodes=250,
    )
    found = run(condition, trials=4).outcomes.unassisted_return
    assert found[:, :5].mean() < 60
    assert found[:, -50:].mean() > 100
    assert found.max() == 500
