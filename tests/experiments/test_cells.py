"""Cells that hold the trials of a condition: all of them, each once, finished ones first."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.experiments.cells import EPISODES_A_CELL, Cell, tiles, trials_a_cell

SIZES, TRIALS = st.integers(1, 40), st.integers(1, 200)


def cell(first, end):
    return Cell("content", first, end - first)


def trials_of(cells):
    return [trial for each in cells for trial in range(each.first, each.end)]


@st.composite
def any_cells(draw):
    """Cells wherever they may lie, overlapping or not."""
    places = draw(st.lists(st.tuples(st.integers(0, 220), st.integers(1, 80)), max_size=12))
    return [cell(first, first + trials) for first, trials in places]


@given(trials=TRIALS, size=SIZES, finished=any_cells())
def test_every_trial_is_in_one_cell(trials, size, finished):
    assert trials_of(tiles("content", trials, size, finished)) == list(range(trials))


@given(trials=TRIALS, size=SIZES, finished=any_cells())
def test_new_cells_end_at_multiples_or_where_a_finished_one_or_the_experiment_does(
    trials, size, finished
):
    for new in set(tiles("content", trials, size, finished)) - set(finished):
        assert new.trials <= size
        assert new.content == "content"
        allowed = {trials, *(other.first for other in finished if other.end <= trials)}
        assert new.end % size == 0 or new.end in allowed


@given(trials=TRIALS, size=SIZES, finished=any_cells())
def test_a_finished_cell_that_fits_is_used_where_one_begins(trials, size, finished):
    chosen = tiles("content", trials, size, finished)
    fitting = [each for each in finished if each.end <= trials]
    for new in set(chosen) - set(finished):
        # Nothing that is finished begins within, or at its first trial.
        assert not [each for each in fitting if new.first <= each.first < new.end]


@given(trials=TRIALS, size=SIZES)
def test_a_new_experiment_has_cells_of_one_size_but_for_the_last(trials, size):
    chosen = tiles("content", trials, size)
    assert [each.trials for each in chosen[:-1]] == [size] * (trials // size - (trials % size == 0))
    assert chosen[-1].trials == trials % size or chosen[-1].trials == size


@given(
    sizes=st.lists(SIZES, min_size=1, max_size=5),
    counts=st.lists(TRIALS, min_size=1, max_size=5).map(sorted),
    kept=st.randoms(use_true_random=False),
)
def test_runs_with_ever_more_trials_do_none_twice(sizes, counts, kept):
    """However many cells each finishes before it is killed, and whatever the size of cells."""
    finished = []
    for number, trials in enumerate(counts):
        chosen = tiles("content", trials, sizes[number % len(sizes)], finished)
        new = [each for each in chosen if each not in finished]
        assert set(finished) <= set(chosen)
        assert not set(trials_of(new)) & set(trials_of(finished))
        finished += [each for each in new if kept.random() < 0.7]


def test_fewer_trials_than_were_run_and_more_again():
    finished = []
    new = []
    for trials in (130, 200, 120, 200):
        new.append([c for c in tiles("content", trials, 500, finished) if c not in finished])
        finished += new[-1]
    assert new == [[cell(0, 130)], [cell(130, 200)], [cell(0, 120)], []]


def test_the_order_of_finished_cells_does_not_matter():
    finished = [cell(0, 50), cell(0, 20), cell(50, 60), cell(70, 100), cell(55, 90)]
    expected = [cell(0, 50), cell(50, 60), cell(60, 70), cell(70, 100)]
    assert tiles("content", 100, 25, finished) == expected
    assert tiles("content", 100, 25, finished[::-1]) == expected


@pytest.mark.parametrize("episodes", [1, 7, 100, 49_999, 50_000, 50_001, 10**7])
def test_a_cell_is_as_many_whole_trials_as_its_episodes_allow(episodes):
    trials = trials_a_cell(episodes)
    assert trials >= 1
    assert trials * episodes <= EPISODES_A_CELL or trials == 1
    assert (trials + 1) * episodes > EPISODES_A_CELL
