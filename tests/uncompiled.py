"""Small simulations of every kind, and their numbers: `python -m tests.uncompiled` prints them."""

import hashlib
import json
import warnings

import gymnasium
import numpy as np

import qbumpers
from qbumpers.assistants import register_assistant
from qbumpers.learners import ModelBased, PowerLaw, SoftmaxQLearner
from qbumpers.networks import Network
from qbumpers.simulation import run
from tests.assistants.own_rules import BudgetOptions, full_budget, guide_within_budget, spend
from tests.learners.own_learners import register_averaging
from tests.simulation.conditions import BUMPERS, in_a_random_world, on_the_cliff
from tests.simulation.corridors import LEARNER, in_the_corridor


def readme():
    """What the README's ten lines print, and every record on the way."""
    values = qbumpers.solve(qbumpers.make_task("cliff-walking"))
    cliff = gymnasium.make("qbumpers/CliffWalking-v0")
    env = qbumpers.SharedControl(cliff, "stochastic-q-bumpers", values, alpha=0.7)
    _, info = env.reset(seed=0)
    env.action_space.seed(0)
    records = [repr(info)]
    while "assisted_episode" not in info:
        *_, info = env.step(env.action_space.sample())
        records.append(repr(info))
    return records


def conditions():
    """Conditions that need every part of the simulators."""
    register_assistant("pocket money", BudgetOptions, start=full_budget, observe=spend)(
        guide_within_budget
    )
    averaging = register_averaging()(hopes=1.0)
    dueling = LEARNER._replace(network=Network((8,), "tanh", 3), clip="variable")
    bumpers = ("stochastic-q-bumpers", {"alpha": 0.8, "v_min": -2.0})
    return {
        "table": on_the_cliff(BUMPERS, episodes=4),
        "chance": in_a_random_world(),
        "own": on_the_cliff(("pocket money", {"budget": 20}), episodes=4, learner=averaging),
        "power law": on_the_cliff(
            BUMPERS, episodes=4, learner=SoftmaxQLearner(), forgetting=PowerLaw()
        ),
        "model": on_the_cliff(BUMPERS, episodes=2, learner=ModelBased()),
        "network": in_the_corridor(*bumpers, episodes=3),
        "dueling network": in_the_corridor(*bumpers, learner=dueling, episodes=3),
    }


def numbers():
    """Of everything: records, and digests of outcomes."""
    found = {name: digest(run(each, trials=2).outcomes) for name, each in conditions().items()}
    return {"readme": readme(), **found}


def digest(outcomes):
    parts = [(str(array.dtype), array.tobytes().hex()) for array in outcomes]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


if __name__ == "__main__":
    warnings.simplefilter("error")
    assert np.geterr()["over"] == "warn"
    print(json.dumps(numbers()))
