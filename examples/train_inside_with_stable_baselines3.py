"""Train somebody else's learner inside shared control, unchanged: Stable-Baselines3's DQN.

The learner walks along the cliff; the assistant lets it err as long as the episode can still
return more than the lower value. Needs `pip install "qbumpers[sb3]"`.
"""

import gymnasium
import numpy as np
from gymnasium.wrappers import FlattenObservation
from stable_baselines3 import DQN

import qbumpers

STEPS = 10_000
EPISODES = 20


def shared_cliff() -> gymnasium.Env:
    """Cliff Walking under Stochastic Q Bumpers; the learner sees the state as 48 zeros and ones."""
    values = qbumpers.solve(qbumpers.make_task("cliff-walking"))
    cliff = gymnasium.make("qbumpers/CliffWalking-v0")
    shared = qbumpers.SharedControl(
        cliff, "stochastic-q-bumpers", values, alpha=1.0, v_min=-200.0
    )
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
    print(f"{moment}: mean return {mean_return:.1f}, {overrides:.1f} overrides an episode")


def main() -> None:
    environment = shared_cliff()
    environment.reset(seed=0)
    learner = DQN(
        "MlpPolicy", environment, learning_starts=500, exploration_fraction=0.5, seed=0,
        policy_kwargs={"net_arch": [64]}, device="cpu",
    )  # fmt: skip
    report("before training", learner, environment)
    learner.learn(STEPS)
    report("after training", learner, environment)


if __name__ == "__main__":
    main()
