"""In which fields learner-aware bumpers are compared, and how; part of `run_learner_aware.py`."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from qbumpers import make_assistant, make_task, simulate, solve
from qbumpers.analysis.hypervolume import hypervolume
from qbumpers.learners import QLearner
from qbumpers.learners.schedules import Schedule
from qbumpers.tasks import TabularTask, Task
from qbumpers.tasks.random_mdp import random_mdp

SEED, REFERENCE_TRIALS, RESAMPLES = 43, 1_000, 4_000
ALPHAS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0)
"""Of bumpers, whose alpha ends at 1, those above are had with a lower `v_min`."""

PROFILES = {"figures": 0.9, "text": 0.1}
"""Share of the episodes over which exploration and learning rate of a profile fall."""

AWARE, MODEL_FREE = "learner-aware-bumpers", "model-free-learner-aware-bumpers"


class Measured(NamedTuple):
    """A task with the worst return that bumpers know of, and how many trials are affordable."""

    make: Callable[[], Any]
    v_min: float
    trials: int


TASKS = {
    "cliff-walking": Measured(lambda: make_task("cliff-walking"), 0.0, 150),
    "larger-cliff": Measured(lambda: make_task("larger-cliff"), 0.0, 40),
    "frozen-lake": Measured(lambda: make_task("frozen-lake"), 0.0, 150),
    "frozen-lake-8x8": Measured(lambda: make_task("frozen-lake-8x8"), 0.0, 60),
    "taxi": Measured(lambda: make_task("taxi"), -20.0, 30),
    "windy-gridworld": Measured(lambda: make_task("windy-gridworld"), -100.0, 100),
    "inventory": Measured(lambda: make_task("inventory"), 0.0, 60),
    "random-mdp": Measured(lambda: random_mdp(10), 0.0, 150),
}
STOCHASTIC = ("frozen-lake", "inventory", "random-mdp")


def q_learner(task: Task, profile: str) -> QLearner:
    """The learner of a profile."""
    schedule = Schedule(1.0, 0.02, PROFILES[profile])
    return QLearner(task.discount, schedule, schedule)


def bumpers(alpha: float, v_min: float, start_value: float, **options: Any) -> Any:
    """Bumpers whose alpha may exceed 1: then `v_min` lies that much lower."""
    lower = start_value - max(alpha, 1.0) * (start_value - v_min)
    return make_assistant("stochastic-q-bumpers", alpha=min(alpha, 1.0), v_min=lower, **options)


def samples(task: Task, assistant: Any, trials: int, **setup: Any) -> np.ndarray:
    """Assisted and unassisted returns by trial, float64 [T, 2]."""
    found = simulate(task, assistant, trials=trials, seed=SEED, **setup).outcomes
    return np.stack([found.assisted_return, found.unassisted_return]).mean(axis=2).T


class Field(NamedTuple):
    """The field in which methods are compared: a learner at a task.

    Attributes:
        task: what is learned.
        measured: how it is measured.
        setup: learner, perception and so on.
        reference: float64 [2], assisted return of `none`, unassisted of `maximal`.
        best: return of `maximal`, assisted.
        start_value: the lowest V*(s_0).
    """

    task: TabularTask
    measured: Measured
    setup: dict[str, Any]
    reference: np.ndarray
    best: float
    start_value: float


def field_of(measured: Measured, trials: int, **setup: Any) -> Field:
    """Fix the reference point before anything is compared."""
    task = measured.make()
    many = min(REFERENCE_TRIALS, 5 * trials)
    without = samples(task, "none", many, **setup).mean(axis=0)
    maximal = samples(task, "maximal", many, **setup).mean(axis=0)
    values = np.asarray(solve(task).table)
    start_value = float(values[task.start > 0].max(axis=1).min())
    reference = np.array([without[0], maximal[1]])
    return Field(task, measured, setup, reference, float(maximal[0]), start_value)


def methods(field: Field, profile: str, name: str = AWARE) -> dict[str, list[Any]]:
    """The rule, and two kinds of bumpers, with equally many settings."""
    v_min, start = field.measured.v_min, field.start_value
    literal = {"escalate": profile == "figures", "clip": profile == "figures"}
    return {
        "aware": [make_assistant(name, alpha=alpha, v_min=v_min) for alpha in ALPHAS],
        "second": [bumpers(a, v_min, start, second=True, **literal) for a in ALPHAS],
        "best": [bumpers(a, v_min, start) for a in ALPHAS],
    }


class Comparison(NamedTuple):
    """Normalised hypervolumes of the rule and of its rival, with their difference."""

    aware: float
    rival: float
    low: float
    high: float
    points: dict[str, list[list[float]]]


def compared(field: Field, rules: dict[str, list[Any]], trials: int, intervals: int) -> Comparison:
    """Compare the rule with its rivals; the interval holds at once with others (Bonferroni)."""
    found = {
        method: [samples(field.task, each, trials, **field.setup) for each in settings]
        for method, settings in rules.items()
    }
    box = float(np.prod(np.maximum(field.best - field.reference, 1e-9)))

    def covered(many: list[np.ndarray]) -> np.ndarray:
        return hypervolume(np.stack(many, axis=-2), field.reference) / box

    means = {method: [s.mean(axis=0) for s in each] for method, each in found.items()}
    covers = {method: float(covered(each)) for method, each in means.items()}
    rival = max((method for method in rules if method != "aware"), key=lambda each: covers[each])
    generator = np.random.default_rng(SEED)
    resampled = {
        method: covered([resample(s, generator) for s in found[method]])
        for method in ("aware", rival)
    }
    tail = 100 * 0.05 / intervals / 2
    low, high = np.percentile(resampled["aware"] - resampled[rival], [tail, 100 - tail])
    points = {
        method: [[*map(float, mean), *map(float, s.std(axis=0) / np.sqrt(len(s)))]
                 for mean, s in zip(means[method], found[method], strict=True)]
        for method in ("aware", rival)
    }  # fmt: skip
    return Comparison(covers["aware"], covers[rival], float(low), float(high), points)


def resample(rows: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """Means of resampled trials, float64 [RESAMPLES, 2]."""
    weights = generator.multinomial(len(rows), np.full(len(rows), 1 / len(rows)), RESAMPLES)
    return weights @ rows / len(rows)


def verdict(found: Comparison) -> str:
    """What the interval says."""
    if found.low > 0:
        return "ahead"
    return "not behind" if found.low > -0.02 else "behind" if found.high < 0 else "open"


def show(
    title: str, rows: Iterable[tuple[str, Comparison]], rival: str = "bumpers"
) -> dict[str, Any]:
    """Print comparisons as they are made; returns them for the page."""
    print(f"\n{title}\n{'':34}   aware {rival:>7}  difference", flush=True)
    kept = {}
    for name, found in rows:
        interval = f"{found.low:+.3f} .. {found.high:+.3f}"
        numbers = f"{found.aware:8.3f}{found.rival:8.3f}  {interval}"
        print(f"{name:34}{numbers}  {verdict(found)}", flush=True)
        kept[name] = {**found._asdict(), "verdict": verdict(found)}
    ahead = sum(each["verdict"] == "ahead" for each in kept.values())
    lowest = min(each["low"] for each in kept.values())
    print(f"ahead in {ahead} of {len(kept)}; the lowest end of an interval is {lowest:+.3f}")
    return kept
