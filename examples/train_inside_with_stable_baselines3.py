"""Train a learner that knows nothing of assistants inside shared control: Stable-Baselines3's DQN.

Needs the extra `sb3` (in a checkout, `pip install -e ".[sb3]"`). Takes about twenty seconds.
"""

import gymnasium
import numpy as np
import torch
from gymnasium.wrappers import FlattenObservation
from stable_baselines3 import DQN

import qbumpers

STEPS = 6_000
EPISODES = 20


def shared_cliff() -> gymnasium.Env:
    """Cliff Walking under Stochastic Q Bumpers; the learner sees its state as 48 zeros and ones."""
    values = qbumpers.solve(qbumpers.make_task("cliff-walking"))
    cliff = gymnasium.make("qbumpers/CliffWalking-v0")
    shared = qbumpers.SharedControl(cliff, "stochastic-q-bumpers", values, alpha=0.7)
    return FlattenObservation(shared)


def report(moment: str, learner: DQN, environment: gymnasium.Env) -> None:
    """Play greedily with the assistant and print what came of it."""
    summaries = []
    for _ in range(EPISODES):
        observation, info = environment.reset()
        while "assisted_episode" not in info:
            action, _ = learner.predict(observation, deterministic=True)
            observation, _, _, _, info = environment.step(action)
        summaries.append(info["assisted_episode"])
    mean_return = np.mean([summary["return"] for summary in summaries])
    overrides = np.mean([summary["overrides"] for summary in summaries])
    print(f"{moment}: mean return {mean_return:.1f}, {overrides:.1f} overrides per episode")


def main() -> None:
    torch.set_num_threads(1)  # more would only get in each other's way on so small a network
    environment = shared_cliff()
    environment.reset(seed=0)
    learner = DQN(
        "MlpPolicy", environment, learning_rate=1e-3, learning_starts=500, batch_size=64,
        train_freq=2, target_update_interval=250, exploration_fraction=0.7,
        policy_kwargs={"net_arch": [64]}, device="cpu", seed=0,
    )  # fmt: skip
    report("before training", learner, environment)
    learner.learn(STEPS)
    report("after training", learner, environment)


if __name__ == "__main__":
    main()
