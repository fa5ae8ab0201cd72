"""No trial is run twice, whatever was there before."""

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.experiments.cells import Cell
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.tables import EPISODES
from qbumpers.tuning import tune
from qbumpers.tuning.trials import gaps, trial_returns
from tests.experiments.examples import cells_of, settings
from tests.tuning.made_up import MadeUp, planned, tuned


def test_the_trials_that_are_counted_are_those_that_were_run_each_once(tmp_path):
    seen = []
    made = MadeUp([(3, 1), (3, 5), (-3, 4), (3, 4.9)])
    found = tune(planned(4, 100), tmp_path, 0.0, backend=made, report=seen.append)
    run_trials = [(cell.content, t) for cell in made.cells for t in range(cell.first, cell.end)]
    assert len(run_trials) == len(set(run_trials)) == found.trials
    assert found.saved == pytest.approx(1 - found.trials / 400)
    assert seen[0].trials == 0
    assert [p.trials for p in seen] == sorted(p.trials for p in seen)
    assert (seen[-1].trials, seen[-1].of) == (found.trials, 400)
    assert seen[-1].steps == len(made.cells)


@pytest.mark.parametrize("stop_after", [0, 1, 3, 4, 7, 9])
def test_what_was_finished_before_an_interruption_is_not_run_again(tmp_path, stop_after):
    means = [(3, 1), (3, 5), (-3, 4), (3, 4.9)]
    whole, undisturbed = tuned(tmp_path / "whole", means, trials=100)
    stopped = MadeUp(means, stop_after=stop_after)
    with pytest.raises(KeyboardInterrupt):
        tune(planned(4, 100), tmp_path / "stopped", 0.0, backend=stopped)
    found, continued = tuned(tmp_path / "stopped", means, trials=100)
    assert found == whole
    assert stopped.cells + continued.cells == undisturbed.cells
    for name in ("tuning.csv", "tuning.toml"):
        assert (tmp_path / "whole" / name).read_bytes() == (
            tmp_path / "stopped" / name
        ).read_bytes()


def test_a_damaged_cell_is_reported_and_run_again(tmp_path):
    means = [(3, 1), (3, 5)]
    whole, _ = tuned(tmp_path, means)
    damaged = cells_of(tmp_path)[0]
    damaged.write_bytes(damaged.read_bytes()[:-1])
    seen, made = [], MadeUp(means)
    assert tune(planned(2), tmp_path, 0.0, backend=made, report=seen.append) == whole
    assert [str(tmp_path / name) for name in seen[0].damaged] == [str(damaged)]
    assert len(made.cells) == 1


class Counting(ThisMachine):
    """The cores of this machine, and which trials they ran."""

    def __init__(self, workers=1):
        super().__init__(workers)
        self.trials = []

    def __call__(self, plan, seconds):
        self.trials += [(cell.content, t) for cell in seconds for t in range(cell.first, cell.end)]
        return super().__call__(plan, seconds)


def real():
    return make_plan(make_experiment(settings(trials=24, episodes=20)))


def test_a_run_uses_the_trials_of_tuning_and_ends_as_without_it(tmp_path):
    first, rest, whole = Counting(), Counting(), Counting()
    found = tune(real(), tmp_path / "tuned", -1e4, backend=first)
    assert found.choice is not None
    run_experiment(real(), tmp_path / "tuned", backend=rest)
    run_experiment(real(), tmp_path / "plain", backend=whole)
    assert not set(first.trials) & set(rest.trials)
    assert set(rest.trials) < set(whole.trials) < set(first.trials) | set(rest.trials)
    tables = [pl.read_parquet(tmp_path / f / EPISODES, glob=False) for f in ("tuned", "plain")]
    assert tables[0].equals(tables[1])


def test_tuning_uses_the_trials_of_a_run_and_ends_as_without_it(tmp_path):
    run_experiment(real(), tmp_path / "run", backend=Counting())
    counting = Counting()
    found = tune(real(), tmp_path / "run", -1e4, backend=counting)
    assert [trial for _, trial in counting.trials] == list(range(24, 48))
    plain = tune(real(), tmp_path / "plain", -1e4, backend=Counting())
    assert found.contenders == plain.contenders


def test_the_number_of_workers_changes_nothing(tmp_path):
    for workers in (1, 3):
        tune(real(), tmp_path / str(workers), -1e4, backend=ThisMachine(workers))
    for name in ("tuning.csv", "tuning.toml"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "3" / name).read_bytes()


def test_returns_of_a_trial_are_means_over_its_training():
    episodes = pl.DataFrame(
        {
            "trial": [1, 1, 1, 0, 0, 0],
            "episode": [0, 1, 2, 0, 1, 2],
            "retention": [False, False, True] * 2,
            "assisted_return": [1.0, 2.0, 100.0, 5.0, 7.0, 100.0],
            "unassisted_return": [-1.0, 3.0, 100.0, 0.0, 1.0, 100.0],
        }
    )
    assert trial_returns(episodes).tolist() == [[6.0, 0.5], [1.5, 1.0]]


spans = st.tuples(st.integers(0, 40), st.integers(1, 20))


@given(spans, st.lists(spans, max_size=5), st.integers(1, 15))
def test_gaps_are_the_trials_that_no_cell_holds(span, finished, size):
    cells = [Cell("c", *each) for each in finished]
    wanted = Cell("c", *span)
    there = {t for cell in cells for t in range(cell.first, cell.end)}
    found = gaps(wanted, cells, size)
    listed = [t for cell in found for t in range(cell.first, cell.end)]
    assert listed == [t for t in range(wanted.first, wanted.end) if t not in there]
    assert all(cell.first // size == (cell.end - 1) // size for cell in found)
