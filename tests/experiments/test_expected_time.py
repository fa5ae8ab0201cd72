"""How long a run will take, said before it begins."""

from time import perf_counter

import pytest

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import estimated_seconds, make_plan
from qbumpers.experiments.sources import make_experiment
from tests.experiments.examples import run_into, settings


def test_the_time_a_run_will_take_is_told_before_it_begins(tmp_path):
    """Within a factor of 5: retried, as others may use the machine."""
    ratios = []
    for attempt in range(4):
        moments = []
        run_into(
            tmp_path / str(attempt),
            report=lambda progress, moments=moments: moments.append((perf_counter(), progress)),
            episodes=100,
            trials=1500,
        )
        taken = moments[-1][0] - moments[0][0]
        assert len({progress.expected for _, progress in moments}) == 1
        ratios.append(moments[0][1].expected / taken)
        if 1 / 5 < ratios[-1] < 5:
            return
    pytest.fail(f"expected time over time taken: {ratios}")


def test_the_time_of_a_cell_is_that_of_its_trials_and_long_cells_come_first():
    experiment = make_experiment(settings(episodes=100))
    plan = make_plan(experiment)
    [content, *_] = plan.conditions
    work = [Cell(content, 0, 100), Cell(content, 100, 300)]
    seconds = estimated_seconds(plan, work)
    assert list(seconds) == work[::-1]  # the longest first
    assert seconds[work[1]] == pytest.approx(3 * seconds[work[0]])
    assert 0 < seconds[work[0]] < 60
    assert estimated_seconds(plan, []) == {}
