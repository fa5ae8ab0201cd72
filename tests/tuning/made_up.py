"""Made-up learners, whose means are known and who take no time."""

import numpy as np
import polars as pl

from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.tables import EPISODES, STATES, encoded
from qbumpers.experiments.work import Finished
from qbumpers.tuning import tune
from tests.experiments.examples import settings

ALPHAS = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]


class MadeUp:
    """Does no work: a condition's trials are normal with known means and standard deviation 1.

    `means` are assisted and unassisted [C, 2]; those of the trials from `change` on may differ.
    """

    cores = 1

    def __init__(self, means, seed=0, change=None, later=None, stop_after=None):
        self.means, self.seed, self.stop_after = np.asarray(means, float), seed, stop_after
        self.change = np.inf if change is None else change
        self.later = self.means if later is None else np.asarray(later, float)
        self.cells = []

    def __call__(self, plan, seconds):
        order = [content for _, content in plan.named]
        for cell in seconds:
            if len(self.cells) == self.stop_after:
                raise KeyboardInterrupt
            self.cells.append(cell)
            place = order.index(cell.content)
            trials = range(cell.first, cell.end)
            table = self.table(place, trials)
            nothing = pl.DataFrame({"state": [0]})
            yield Finished(cell, {STATES: encoded(nothing), EPISODES: encoded(table)}, 1)

    def returns(self, place, trials):
        drawn = [np.random.default_rng([self.seed, place, t]).normal(size=2) for t in trials]
        late = np.array(trials)[:, None] >= self.change
        return np.where(late, self.later[place], self.means[place]) + drawn

    def table(self, place, trials):
        assisted, unassisted = self.returns(place, trials).T
        return pl.DataFrame(
            {
                "trial": np.array(trials, np.int32),
                "episode": np.zeros(len(trials), np.int32),
                "retention": np.zeros(len(trials), bool),
                "assisted_return": assisted,
                "unassisted_return": unassisted,
            }
        )


def planned(conditions, trials=20, **changes):
    bumpers = {"name": "stochastic-q-bumpers", "alpha": ALPHAS[:conditions]}
    whole = {"trials": trials, "episodes": 1, "assistants": [bumpers], **changes}
    return make_plan(make_experiment(settings(**whole)))


def tuned(folder, means, floor=0.0, trials=20, confidence=0.95, **made):
    backend = MadeUp(means, **made)
    found = tune(planned(len(means), trials), folder, floor, confidence=confidence, backend=backend)
    return found, backend


def verdicts(found):
    return [each.verdict for each in found.contenders]
