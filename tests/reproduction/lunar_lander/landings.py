"""Made-up results of Lunar Lander: folders as runs leave them, with numbers drawn at random."""

import itertools
from pathlib import Path

import numpy as np
import polars as pl
import tomli_w

from qbumpers.reproduction.experiments import reproduction
from tests.values.networks import network_of

# Mean returns with and without the assistant, once learned.
NONE, MAXIMAL, DESTROYED = (157.0, 140.0), (240.0, -180.0), (165.0, -161.0)
BUMPERS = {0.0: (215.0, -120.0), 1.0: (191.0, 163.0)}


def level_of(assistant, alpha):
    """What learners come to, of each assistant."""
    if assistant == "none" or (assistant == "local-q-thresholding" and alpha == 1):
        return np.array(NONE)
    if assistant == "maximal":
        return np.array(MAXIMAL)
    if assistant == "local-q-thresholding":
        return np.array([230 - 70 * alpha, DESTROYED[1] - 20 * (1 - alpha)])
    return (1 - alpha) * np.array(BUMPERS[0.0]) + alpha * np.array(BUMPERS[1.0])


def override_rate_of(assistant, alpha):
    if assistant == "maximal":
        return 0.7
    if assistant == "none" or (assistant == "local-q-thresholding" and alpha == 1):
        return 0.0
    strong = assistant == "local-q-thresholding"
    return (0.6 if strong else 0.3) - (0.3 if strong else 0.25) * alpha


def episodes_of(named, trial, length, generator):
    """Episodes of one trial: returns rise from -200, and success follows them."""
    name, alpha = named.assistant.name, getattr(named.assistant.options, "alpha", None)
    level = level_of(name, alpha) + generator.normal(0, 25, 2)
    grown = 1 - np.exp(-np.arange(length) / (0.08 * length))
    steps = generator.integers(100, 500, (2, length))
    # Assisted learners return much from the beginning on.
    start = np.array([level[0] - 40 if override_rate_of(name, alpha) else -200.0, -200.0])
    returns = start[:, None] + grown * (level - start)[:, None]
    returns += generator.normal(0, 70, (2, length))
    success = returns + generator.normal(0, 30, (2, length)) > 100
    crash = ~success & (generator.random((2, length)) < 0.7)
    rate = override_rate_of(name, alpha) * (1.5 - grown)
    return pl.DataFrame(
        {
            "trial": np.full(length, trial, np.int32),
            "episode": np.arange(length, dtype=np.int32),
            "retention": np.zeros(length, bool),
            "assisted_return": returns[0],
            "unassisted_return": returns[1],
            "assisted_length": steps[0].astype(np.int32),
            "unassisted_length": steps[1].astype(np.int32),
            "overrides": generator.binomial(steps[0], np.minimum(rate, 1)).astype(np.int32),
            "assisted_success": success[0],
            "unassisted_success": success[1],
            "assisted_crash": crash[0],
            "unassisted_crash": crash[1],
        }
    ).select(
        pl.lit(named.condition).alias("condition"),
        pl.lit(name).alias("assistant"),
        pl.lit(alpha, pl.Float64).alias("alpha"),
        pl.lit(named.learner_id).alias("learner"),
        pl.all(),
    )


def made_up(folder, seed=0, **changes):
    """Write a folder as if a reproduction of Lunar Lander had run; its path."""
    experiment = reproduction("lunar-lander", **changes)
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    run = {"format": 2, "version": "0", "python": "3"}
    settings = {**experiment.model_dump(exclude_none=True), "run": run}
    (place / "experiment.toml").write_text(tomli_w.dumps(settings), encoding="utf-8")
    generator = np.random.default_rng(seed)
    everything = itertools.product(experiment.conditions(), range(experiment.trials))
    table = pl.concat(
        episodes_of(named, trial, experiment.episodes, generator) for named, trial in everything
    )
    table.write_parquet(place / "episodes.parquet")
    values = network_of(inputs=8, actions=4, discount=0.99, task="lunar-lander")
    (place / "values.npz").write_bytes(values.encoded())
    return place
