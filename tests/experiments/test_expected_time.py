"""How long a run will take, said before it begins."""

import types
from time import perf_counter

import pytest

from qbumpers.experiments import plan as plans
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import estimated_seconds, make_plan
from qbumpers.experiments.sources import make_experiment
from qbumpers.simulation import Card
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


@pytest.mark.parametrize(("at_once", "each"), [(0.03, 1e-5), (0.03, 1e-7), (1.5, 1e-5)])
def test_a_card_is_timed_with_so_many_trials_that_their_number_counts(monkeypatch, at_once, each):
    """A few trials take as long as one, now and then twice as long, which says nothing of many."""
    clock, hitches = [0.0], iter([1, 1, 3, 1, 2, 1, 1])

    def run(condition, trials, seed, card):
        clock[0] += next(hitches) * at_once + trials * each

    plan = make_plan(make_experiment(settings(episodes=100)))._replace(card=Card())
    monkeypatch.setattr(plans, "run_condition", run)
    monkeypatch.setattr(plans, "time", types.SimpleNamespace(perf_counter=lambda: clock[0]))
    [content, *_] = plan.conditions
    cell = Cell(content, 0, 1_000_000)
    most = 1 << 16
    expected = 1_000_000 * (at_once / most + each)
    assert estimated_seconds(plan, [cell])[cell] == pytest.approx(expected, rel=1)
