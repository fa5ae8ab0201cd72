"""Intervals of V* of estimated tables hold the true one as often as they say."""

import dataclasses

import numpy as np
import pytest
from gymnasium.wrappers import TimeLimit

from qbumpers import RequestError, TabularTask, make_task, solve
from qbumpers.tasks.estimation import EstimateWarning
from qbumpers.values import start_interval
from tests.narrowing import of_kind
from tests.tasks.worlds import Hidden

POND = ("SFF", "FHG")
TRUE = of_kind(TabularTask, make_task("FrozenLake-v1", discount=0.9, desc=POND))
TRIES = 40


def estimated(seed, steps):
    environment = TimeLimit(Hidden(desc=POND), 100)
    return TabularTask.estimated(environment, discount=0.9, steps=steps, seed=seed)


@pytest.mark.slow
def test_the_interval_holds_the_true_value_at_its_rate():
    truth = float(TRUE.start @ solve(TRUE).table.max(axis=1))
    found = [start_interval(estimated(seed, 1_500)) for seed in range(TRIES)]
    held = sum(each.low <= truth <= each.high for each in found)
    # Of 40 with 95% each, fewer than 34 come with a probability of 0.3%.
    assert held >= 34
    spread = np.std([each.value for each in found], ddof=1)
    stated = np.mean([each.error for each in found])
    assert 0.7 < stated / spread < 1.4  # so it is not the width that makes them hold it


def test_what_was_never_tried_might_be_worth_the_best():
    with pytest.warns(EstimateWarning):
        task = estimated(0, 12)
    assert task.estimate is not None
    assert task.estimate.untried
    paid = dataclasses.replace(task, estimate=task.estimate._replace(best=50.0))
    assert start_interval(paid).high > start_interval(task).high + 1
    assert start_interval(paid).low == start_interval(task).low


def test_a_known_table_has_no_such_uncertainty():
    with pytest.raises(RequestError, match="its table is known, it was not estimated"):
        start_interval(TRUE)
