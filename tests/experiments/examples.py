"""Small experiments that the tests of experiments, analysis and command line run."""

from pathlib import Path

import polars as pl
import tomli_w

from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from tests.values.networks import network_of

BUMPERS = {"name": "stochastic-q-bumpers", "alpha": [0.3, 0.7], "second": True}

LAKE = {
    "name": "lake",
    "task": {"name": "FrozenLake-v1", "discount": 0.9, "arguments": {"is_slippery": False}},
    "assistants": [{"name": "none"}, {**BUMPERS, "v_min": -1.0}],
}

# Without a grid, so that its report is made quickly.
PLAIN = {
    "name": "plain",
    "task": {"name": "CliffWalking-v1", "discount": 0.9, "episode_limit": 30},
    "assistants": [{"name": "none"}, {**BUMPERS, "v_min": -50.0}],
}

ASSISTANTS = [{"name": "none"}, {"name": "stochastic-q-bumpers", "alpha": 0.5, "v_min": -100.0}]


def cart(folder, **changes):
    """Settings of a tiny experiment with deep learners, and Q values of a file for it."""
    path = Path(folder) / "cart.npz"
    if not path.exists():
        network_of(inputs=4, actions=2, task="CartPole-v1", discount=0.99).save(path)
    return {
        "name": "cart",
        "task": {"name": "CartPole-v1", "discount": 0.99},
        "values": str(path),
        "assistants": ASSISTANTS,
        "trials": 2,
        "episodes": 5,
        "seed": 3,
        **changes,
    }


def settings(**changes):
    return {
        "name": "small",
        "task": "cliff-walking",
        "trials": 5,
        "episodes": 4,
        "seed": 3,
        "assistants": [{"name": "none"}, BUMPERS],
        **changes,
    }


def run_into(folder, *, workers=1, report=lambda progress: None, **changes):
    plan = make_plan(make_experiment(settings(**changes)))
    run_experiment(plan, folder, backend=ThisMachine(workers), report=report)
    return Path(folder)


def rows_of(folder):
    """Every row of an experiment by condition, trial and episode."""
    table = pl.read_parquet(Path(folder) / "episodes.parquet", glob=False)
    keys = ("condition", "trial", "episode")
    return {
        tuple(row[key] for key in keys): tuple(row.values()) for row in table.iter_rows(named=True)
    }


def ids_of(**changes):
    """Ids of the conditions of an experiment, in its order."""
    experiment = make_experiment(settings(**changes))
    return [named.condition for named in experiment.conditions()]


def cells_of(folder):
    return sorted((Path(folder) / "cells").rglob("*.parquet"))


def contents_of(folder, *patterns):
    """What files hold, by name, but for the lock."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for pattern in patterns
        for path in sorted(Path(folder).glob(pattern))
        if path.is_file() and path.name != ".lock"
    }


def write_toml(path, **changes):
    path.write_text(tomli_w.dumps(settings(**changes)), encoding="utf-8")
    return path
