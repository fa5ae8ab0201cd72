"""How cells are handed out to a cluster: in batches, large at first and small towards the end."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.experiments import cluster
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.cluster import BATCH_SECONDS, batches

durations = st.lists(st.floats(1e-4, 5.0), max_size=200)


@given(durations=durations, cores=st.integers(1, 64))
def test_batches_are_worth_handing_over_and_cores_end_together(durations, cores):
    seconds = {Cell("c", i, 1): s for i, s in enumerate(sorted(durations, reverse=True))}
    made = list(batches(seconds, cores))
    assert [cell for batch in made for cell in batch] == list(seconds)
    lengths = [sum(seconds[cell] for cell in batch) for batch in made]
    longest = max(durations, default=0.0)
    total = sum(durations)
    for length, batch in zip(lengths, made, strict=True):
        assert length < BATCH_SECONDS + seconds[batch[-1]]
    for length in lengths[:-1]:
        assert length >= min(cluster._SHORTEST_BATCH, BATCH_SECONDS)
    loads = [0.0] * cores
    for length in lengths:
        loads[loads.index(min(loads))] += length
    assert max(loads) <= total / cores * 1.25 + longest + cluster._SHORTEST_BATCH + 1e-9


def test_long_work_is_cut_into_few_batches():
    seconds = {Cell("c", i, 1): 0.1 for i in range(10_000)}
    assert 500 <= len(list(batches(seconds, 2))) <= 530


def test_batches_are_large_at_first_and_small_towards_the_end():
    seconds = {Cell("c", i, 1): 0.01 for i in range(1_000)}
    lengths = [len(batch) * 0.01 for batch in batches(seconds, 8)]
    # Were the first to take twice as long as estimated, the others would still have work.
    assert lengths[0] == pytest.approx(10 / 8 / 4, abs=0.02)
    assert lengths == sorted(lengths, reverse=True)
    assert max(lengths[-8:]) <= cluster._SHORTEST_BATCH + 0.011
