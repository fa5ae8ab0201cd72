"""Points that can be read one by one: every condition, where and with the numbers it has."""

from itertools import pairwise

import polars as pl
import pytest

from qbumpers.analysis.page.points import BELOW, HEIGHT, LEFT, WIDTH, panels
from tests.analysis.examples import ALPHAS
from tests.analysis.page.made_up import about

MINUS = "\N{MINUS SIGN}"


def learner(**columns):
    found = about()
    added = {"probability": pl.lit(0.25), **columns}
    return found._replace(frontier=found.frontier.with_columns(**added))


def test_all_conditions_have_a_point_and_those_that_override_a_panel_of_their_own():
    swept, everything = panels(learner())
    assert (swept.title, everything.title) == ("Assistants that override", "All conditions")
    assert len(everything.points) == len(ALPHAS)
    assert len(swept.points) == len(ALPHAS) - 2
    assert everything.points[0].name == "No assistance"


def number(text):
    return float(text.replace(",", "").replace(MINUS, "-"))


def test_points_stand_where_the_axes_say():
    found = learner()
    for panel in panels(found):
        rows = {row["condition"]: row for row in found.frontier.iter_rows(named=True)}
        (x0, a0), (x1, a1) = ((place, number(text)) for place, text in panel.across[:2])
        (y0, u0), (y1, u1) = ((place, number(text)) for place, text in panel.up[:2])
        names = {point.name: point for point in panel.points}
        point, row = names["Stochastic Q Bumpers, α = 0.5"], rows["stochastic-q-bumpers/alpha=0.5"]
        assert a0 + (point.x - x0) * (a1 - a0) / (x1 - x0) == pytest.approx(
            row["assisted_mean"], abs=0.01 * abs(a1 - a0)
        )
        assert u0 + (point.y - y0) * (u1 - u0) / (y1 - y0) == pytest.approx(
            row["unassisted_mean"], abs=0.01 * abs(u1 - u0)
        )
        assert point.left < point.x < point.right
        assert point.top < point.y < point.bottom
        for each in panel.points:
            assert LEFT <= each.left <= each.right <= WIDTH
            assert 0 <= each.top <= each.bottom <= HEIGHT - BELOW


def test_a_point_tells_its_numbers():
    none = panels(learner())[1].points[0]
    assert none.numbers == [
        f"assisted return {MINUS}300.0 [{MINUS}301.0, {MINUS}298.0] per episode",
        f"unassisted return {MINUS}100.0 [{MINUS}130.0, {MINUS}60.0] per episode",
        "0.0 overrides per episode",
        "Pareto-optimal; in 25% of the resamples it is",
    ]


def test_single_trials_have_no_interval_and_no_probability():
    unknown = {
        f"{side}_{end}": pl.lit(None, pl.Float64)
        for side in ("assisted", "unassisted")
        for end in ("low", "high")
    }
    point = panels(learner(probability=pl.lit(None, pl.Float64), **unknown))[1].points[-1]
    assert point.numbers[0] == "assisted return 52.0, no interval per episode"
    assert point.numbers[-1] == "not Pareto-optimal"
    assert (point.left, point.top) == (point.x, point.y) == (point.right, point.bottom)


@pytest.mark.parametrize("size", [0.0007, 0.07, 7.0, 8.4e6])
def test_numbers_of_the_axes_stand_at_even_distances(size):
    scaled = pl.selectors.starts_with("assisted", "unassisted") * size / 100
    for panel in panels(learner()._replace(frontier=learner().frontier.with_columns(scaled))):
        for axis in (panel.across, panel.up):
            places, texts = zip(*axis, strict=True)
            numbers = [number(text) for text in texts]
            steps = {round((b - a) / (numbers[1] - numbers[0]), 6) for a, b in pairwise(numbers)}
            assert steps == {1.0}
            gaps = [b - a for a, b in pairwise(places)]
            assert gaps == pytest.approx([gaps[0]] * len(gaps), abs=0.2)
