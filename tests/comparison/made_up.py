"""Made-up trials of a comparison."""

import numpy as np

from qbumpers.comparison.results import CaseResults
from qbumpers.experiments.sources import make_experiment

_TRIALS = 20


def _trials(point, generator, trials=_TRIALS):
    """Trials [T, 3] whose mean is the point exactly in the share, nearly in the returns."""
    share, assisted, unassisted = point
    noise = 0.05 * generator.standard_normal((trials, 2))
    returns = np.array([assisted, unassisted]) + noise - noise.mean(axis=0)
    return np.column_stack([np.full(trials, share), returns])


def case_results(task, methods, best=10.0, learner="q-learning"):
    """A case with the reference point (0, 0), and settings by method as (share, assisted,
    unassisted)."""
    generator = np.random.default_rng(0)
    experiment = make_experiment(
        {"name": task, "task": "cliff-walking", "assistants": [{"name": "none"}], "trials": _TRIALS}
    )
    return CaseResults(
        task=task,
        learner=learner,
        experiment=experiment,
        best=best,
        spread=10.0,
        left_out={"shield": "the task announces no crash"},
        anchors={
            "none": _trials((0.0, 0.0, 5.0), generator),
            "maximal": _trials((0.5, best, 0.0), generator),
        },
        methods={
            name: np.stack([_trials(point, generator) for point in points])
            for name, points in methods.items()
        },
        conditions={
            name: [f"{name}/{place}" for place in range(len(points))]
            for name, points in methods.items()
        },
    )
