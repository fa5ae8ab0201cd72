"""Power against SciPy's test and the textbook's formula; what is said if there is no effect."""

from typing import Any

import numpy as np
import pytest
import scipy.stats

from qbumpers.errors import RequestError
from qbumpers.study.outcomes.power import SIZES, found_share, power_of, welch


def test_p_values_are_those_of_scipy():
    generator = np.random.default_rng(1)
    first, second = generator.normal(0, 1, (20, 7)), generator.normal(0.5, 3, (20, 12))
    found: Any = scipy.stats.ttest_ind(first, second, axis=1, equal_var=False)
    expected = found.pvalue
    np.testing.assert_allclose(welch(first, second), expected, rtol=1e-12)
    same = np.ones((1, 4))
    assert welch(same, same).tolist() == [1.0]
    assert welch(same, 2 * same).tolist() == [0.0]


def test_power_is_that_of_the_noncentral_t():
    generator = np.random.default_rng(2)
    pools = generator.normal(0.8, 1, 5000), generator.normal(0, 1, 5000)
    effect = (pools[0].mean() - pools[1].mean()) / np.sqrt((pools[0].var() + pools[1].var()) / 2)
    for size in (10, 26, 60):
        freedom, shift = 2 * size - 2, effect * np.sqrt(size / 2)
        limit = scipy.stats.t.ppf(0.975, freedom)
        expected = 1 - scipy.stats.nct.cdf(limit, freedom, shift)
        found = np.mean([found_share(*pools, size, 0.05, generator) for _ in range(10)])
        assert found == pytest.approx(expected, abs=0.03)


def test_a_rehearsal_says_how_many_are_needed(study, participants):
    found = power_of(study, participants)
    assert [row.size for row in found.table] == list(SIZES)
    assert sum(found.arms) == sum(p.now.outcome == "complete" for p in participants)
    for row in found.table:
        assert row.low <= row.high
        assert row.null < 0.15
    assert found.needed is None or found.table[SIZES.index(found.needed)].power >= 0.8


def test_too_few_are_refused(study, participants):
    with pytest.raises(RequestError, match="at least 8 each are needed: simulate more"):
        power_of(study, participants[:6])
    bare = study.model_copy(update={"analysis": None})
    with pytest.raises(RequestError, match="the study plans no test"):
        power_of(bare, participants)
