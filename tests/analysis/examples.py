"""Tables as an analysis finds them, made up so that every number in them is known."""

import numpy as np
import polars as pl

NAMES = {"none": None, "maximal": None}
THRESHOLDS = {f"local-q-thresholding/alpha=0.01{digit}": 0.01 + digit / 1000 for digit in range(5)}
BUMPERS = {f"stochastic-q-bumpers/alpha=0.{digit}": digit / 10 for digit in (2, 5, 7)}
ALPHAS = {**NAMES, **THRESHOLDS, **BUMPERS}


def summary_row(condition, alpha, place):
    """A row of `summary.csv`; Local Q-Thresholding's conditions lie close together."""
    name = condition.partition("/")[0]
    assisted = {"none": -300.0, "maximal": 87.0, "local-q-thresholding": 50 + 0.1 * place}
    mean = assisted.get(name, 80 - 40.0 * (alpha or 0))
    unassisted = -100.0 - 10 * place
    return {
        "condition": condition,
        "assistant": name,
        "alpha": alpha,
        "assisted_mean": mean,
        "assisted_low": mean - 1,
        "assisted_high": mean + 2,
        "unassisted_mean": unassisted,
        "unassisted_low": unassisted - 30,
        "unassisted_high": unassisted + 40,
        "overrides_mean": 0.0 if name == "none" else 3.0,
    }


def summary_table(conditions=ALPHAS):
    rows = [
        summary_row(name, alpha, place) for place, (name, alpha) in enumerate(conditions.items())
    ]
    return pl.DataFrame(rows, schema_overrides={"alpha": pl.Float64}, infer_schema_length=None)


def episode_table(conditions, trials=4, episodes=6, deepest=-100.0):
    """Returns by condition, trial and episode, between `deepest` and 100."""
    generator = np.random.default_rng(17)
    keys = [(c, t, e) for c in conditions for t in range(trials) for e in range(episodes)]
    table = pl.DataFrame(keys, schema=["condition", "trial", "episode"], orient="row")
    return table.with_columns(
        assisted_return=generator.uniform(deepest, 100, len(keys)),
        unassisted_return=generator.uniform(deepest, 100, len(keys)),
    )


def points_of(axes):
    """Points drawn with error bars, by their label in the legend."""
    return {
        container.get_label(): np.column_stack(container[0].get_data())
        for container in axes.containers
    }
