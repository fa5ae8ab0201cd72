"""Digests of what simulations give, to hold later versions to the same numbers.

`python -m tests.kept.measuring` prints them as JSON; only a change that is meant to change numbers
may write `numbers.json` anew.
"""

import hashlib
import json
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from qbumpers.experiments.design import Experiment
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from qbumpers.reproduction.experiments import reproduction
from qbumpers.simulation import record
from qbumpers.tuning import tune

HERE = Path(__file__).parent
NUMBERS = HERE / "numbers.json"

_COLUMNS = (
    "assisted_return", "unassisted_return", "assisted_length", "unassisted_length", "overrides",
    "assisted_success", "assisted_crash", "unassisted_success", "unassisted_crash",
)  # fmt: skip
_RECORDED = (
    "episode", "state", "next_state", "proposed", "executed", "credited", "overridden",
    "probability", "coin", "tie", "values", "projected_return", "reward",
)  # fmt: skip


def experiments() -> dict[str, Experiment]:
    """Every experiment that is kept, by name."""
    written = tomllib.loads((HERE / "experiments.toml").read_text(encoding="utf-8"))
    own = {name: make_experiment({"name": name, **each}) for name, each in written.items()}
    paper = {
        f"cliff-walking-{profile}": reproduction("cliff-walking", profile)
        for profile in ("figures", "text")
    }
    return {**paper, **own}


def run_numbers(experiment: Experiment) -> dict[str, Any]:
    """A digest and two means of each condition."""
    with tempfile.TemporaryDirectory() as folder:
        run_experiment(make_plan(experiment), Path(folder) / "out", executor=ThisMachine(2))
        episodes = load(Path(folder) / "out").episodes
    return {
        condition: {
            "digest": _digest(rows.get_column(column) for column in _COLUMNS),
            "assisted": float(_mean(rows, "assisted_return")),
            "unassisted": float(_mean(rows, "unassisted_return")),
        }
        for (condition,), rows in episodes.sort("trial", "episode").group_by(
            ["condition"], maintain_order=True
        )
    }


def recorded_numbers(experiment: Experiment) -> dict[str, Any]:
    """A digest of the recorded steps of each condition's last trial."""
    plan = make_plan(experiment)
    found = {}
    for named, content in plan.named:
        steps = record(plan.conditions[content], trial=experiment.trials - 1, seed=experiment.seed)
        columns = (np.asarray(getattr(steps, field)) for field in _RECORDED)
        found[named.condition] = _digest(columns)
    return found


def tuned_numbers() -> dict[str, Any]:
    """What `tune` chooses at Cliff Walking, and what it cost."""
    with tempfile.TemporaryDirectory() as folder:
        chosen = tune(make_plan(reproduction("cliff-walking")), Path(folder) / "out", floor=50.0)
    choice = chosen.choice.condition if chosen.choice else None
    return {"choice": choice, "trials": chosen.trials}


def _mean(rows: pl.DataFrame, column: str) -> Any:
    return rows.get_column(column).mean()


def _digest(columns: Iterator[Any]) -> str:
    digest = hashlib.sha256()
    for column in columns:
        array = column.cast(pl.Float64).to_numpy() if isinstance(column, pl.Series) else column
        digest.update(np.ascontiguousarray(array, np.float64).tobytes())
    return digest.hexdigest()[:24]


def main() -> None:
    """Print every kept number as JSON."""
    found: dict[str, Any] = {}
    for name, experiment in experiments().items():
        found[name] = {"episodes": run_numbers(experiment)}
        if not name.startswith("cliff-walking"):
            found[name]["steps"] = recorded_numbers(experiment)
        print(name, file=sys.stderr)
    found["tune"] = tuned_numbers()
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
