"""Digests of what simulations give, to hold later versions to the same numbers.

`python -m tests.kept.measuring` writes `numbers.json` anew, if a change is meant to change numbers:
then the revision of the rule, learner, task or engine that it changes must be raised, or finished
trials of the old numbers would be used again beside new ones. It refuses otherwise.
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
from qbumpers.experiments.plan import Plan, make_plan
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
    """A digest and two means of each condition, and the revisions of what made them."""
    plan = make_plan(experiment)
    revisions = revisions_of(plan)
    with tempfile.TemporaryDirectory() as folder:
        run_experiment(plan, Path(folder) / "out", backend=ThisMachine(2))
        episodes = load(Path(folder) / "out").episodes
    return {
        condition: {
            "digest": _digest(rows.get_column(column) for column in _COLUMNS),
            "assisted": float(_mean(rows, "assisted_return")),
            "unassisted": float(_mean(rows, "unassisted_return")),
            "revisions": revisions[condition],
        }
        for (condition,), rows in episodes.sort("trial", "episode").group_by(
            ["condition"], maintain_order=True
        )
    }


def revisions_of(plan: Plan) -> dict[str, dict[str, int]]:
    """Revisions of what makes the numbers of each condition."""
    identities = plan.record.identities
    return {
        each.condition: dict(identities[each.identity]["revisions"])
        for each in plan.record.conditions
    }


def unmarked_changes(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """Conditions whose numbers changed although no revision of what makes them was raised."""
    found = []
    for name, parts in now.items():
        for condition, numbers in parts.get("episodes", {}).items():
            then = before.get(name, {}).get("episodes", {}).get(condition)
            if then is None or then["revisions"] != numbers["revisions"]:
                continue
            steps = [each[name].get("steps", {}).get(condition) for each in (before, now)]
            if then != numbers or steps[0] != steps[1]:
                found.append(f"{name}: {condition}")
    return found


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
    """Write every kept number as JSON, if revisions tell which have changed."""
    found: dict[str, Any] = {}
    for name, experiment in experiments().items():
        found[name] = {"episodes": run_numbers(experiment)}
        if not name.startswith("cliff-walking"):
            found[name]["steps"] = recorded_numbers(experiment)
        print(name, file=sys.stderr)
    found["tune"] = tuned_numbers()
    changed = unmarked_changes(json.loads(NUMBERS.read_text(encoding="utf-8")), found)
    if changed:
        sys.exit("numbers changed and no revision was raised:\n" + "\n".join(changed))
    NUMBERS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
