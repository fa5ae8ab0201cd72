"""Figures of a check of values show its numbers."""

import numpy as np
import polars as pl
import pytest

from qbumpers.analysis.figures.quality import quality_figure
from qbumpers.analysis.figures.style import save
from qbumpers.experts.quality import BEFORE_CRASH, check_values
from tests.values.walking import DISCOUNT, GOAL, exact, flattering, line, random_policy


@pytest.fixture(scope="module")
def claims():
    return [
        (
            name,
            check_values(
                line(), values, discount=DISCOUNT, episodes=40, policies={"r": random_policy()}
            ),
        )
        for name, values in [("exact", exact), ("flattering", flattering)]
    ]


def lines_of(axes):
    return [container.lines[0] for container in axes.containers]


def test_panels_show_claims_against_returns_and_bias(claims):
    calibration, before, distance = quality_figure(claims).axes
    plain, flattered = lines_of(calibration)
    assert plain.get_xdata() == pytest.approx(plain.get_ydata(), abs=1e-4)
    assert (flattered.get_xdata() > flattered.get_ydata() + 1.9).all()
    plain, flattered = lines_of(before)
    assert set(flattered.get_xdata()) <= set(BEFORE_CRASH)
    assert plain.get_ydata() == pytest.approx(0, abs=1e-4)
    assert flattered.get_ydata()[0] == pytest.approx(2 * (GOAL - 1))
    assert np.diff(lines_of(distance)[1].get_ydata()).min() > 0  # worse, the farther away
    assert [a.get_title(loc="left") for a in (calibration, before, distance)] == [
        "Calibration", "Before crashes", "Off the path",
    ]  # fmt: skip


def test_time_runs_towards_the_crash(claims):
    _, before, _ = quality_figure(claims[:1]).axes
    left, right = before.get_xlim()
    assert left > right


def test_a_check_without_crashes_is_drawn_and_saved(claims, tmp_path):
    name, rows = claims[0]
    safe = rows.with_columns(before_crash=None)
    assert save(quality_figure([(name, safe)]), tmp_path, "quality").exists()


def test_values_that_are_all_alike_are_drawn_as_one_point(claims):
    name, rows = claims[0]
    alike = rows.with_columns(value=pl.lit(3.0))
    [point] = lines_of(quality_figure([(name, alike)]).axes[0])
    assert point.get_xdata() == pytest.approx(3.0)
