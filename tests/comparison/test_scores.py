"""Tables of made-up trials, against what can be worked out by hand."""

import math

import numpy as np
import pytest

from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.results import CaseResults, Comparison
from qbumpers.comparison.scores import covered, find_tables
from qbumpers.comparison.sentences import overall
from tests.comparison.made_up import case_results


def test_the_share_of_a_box_that_points_cover():
    points = np.array([[5.0, 2.0], [2.0, 8.0], [1.0, 1.0]])
    # Above (0, 0): 5 x 2 and, to its left, 2 x 6 more, of 10 x 10.
    assert covered(points, np.zeros(2), 10.0) == pytest.approx(0.22)


def test_points_beyond_the_box_count_as_on_its_edge():
    assert covered(np.array([[20.0, 5.0]]), np.zeros(2), 10.0) == pytest.approx(0.5)
    assert covered(np.array([[20.0, -1.0]]), np.zeros(2), 10.0) == 0


def around(assisted, unassisted):
    """Two settings of equal returns, on either side of 10% of overridden steps."""
    return [(0.15, assisted, unassisted), (0.05, assisted, unassisted)]


@pytest.fixture(scope="module")
def tables():
    first = case_results("easy", {BASELINE: around(4, 4), "undo": around(6, 5)})
    second = case_results("hard", {BASELINE: around(5, 5), "undo": [(0.3, 2, 5)]})
    third = case_results("same", {BASELINE: around(9, 9), "undo": around(9, 9)}, best=0.05)
    methods = {name: {"dial": "a", "formula": "b"} for name in (BASELINE, "undo")}
    return find_tables(Comparison("1", "qbumpers compare", methods, [first, second, third]))


def test_scores_are_shares_of_the_box(tables):
    rows = {(r["task"], r["method"]): r for r in tables.scores.rows(named=True)}
    expected = {("easy", BASELINE): 0.16, ("easy", "undo"): 0.3, ("hard", BASELINE): 0.25,
                ("hard", "undo"): 0.1}  # fmt: skip
    assert {key: row["hypervolume_mean"] for key, row in rows.items()} == pytest.approx(
        expected, abs=0.01
    )
    assert rows["easy", "undo"]["advantage_low"] > 0.1
    assert rows["hard", "undo"]["advantage_high"] < -0.1
    assert rows["easy", BASELINE]["advantage_mean"] is None
    assert [rows[key]["rank"] for key in expected] == [2, 1, 1, 2]
    assert rows["easy", "undo"]["largest"] == 1


def test_a_case_without_a_conflict_is_not_scored(tables):
    assert dict(tables.cases.select("task", "comparable").iter_rows()) == {
        "easy": True, "hard": True, "same": False,
    }  # fmt: skip
    assert "same" not in tables.scores["task"].to_list()


def test_a_method_that_returns_more_than_any_policy_is_not_scored():
    case = case_results("paying", {BASELINE: around(4, 4), "undo": around(12, 4)})
    methods = {name: {"dial": "", "formula": ""} for name in (BASELINE, "undo")}
    found = find_tables(Comparison("1", "", methods, [case]))
    assert found.scores["method"].to_list() == [BASELINE]
    (said,) = [each for each in overall(found) if each.startswith("undo is not scored")]
    assert "paying with q-learning" in said
    assert "12.00 against 10.00" in said


def test_aggregates_are_over_the_scored_cases(tables):
    rows = {row["method"]: row for row in tables.aggregates.rows(named=True)}
    assert rows["undo"]["cases"] == 2
    assert rows["undo"]["iqm_mean"] == pytest.approx(0.2, abs=0.01)
    assert rows["undo"]["rank_mean"] == 1.5
    assert rows["undo"]["improvement_mean"] == 0.5
    assert rows["undo"]["lead_mean"] == pytest.approx(0.2 - 0.205, abs=0.01)
    assert rows[BASELINE]["lead_mean"] is None


def test_matched_shares_are_known_only_if_they_are_reached(tables):
    undo = tables.matched.filter(method="undo", share=0.1)
    found = dict(undo.select("task", "assisted_mean").iter_rows())
    assert found["easy"] == pytest.approx(6, abs=0.1)
    assert found["hard"] is None
    lead = undo.filter(task="easy").row(0, named=True)
    assert lead["assisted_lead_low"] < 2 < lead["assisted_lead_high"]
    assert tables.matched.filter(share=0.4)["assisted_mean"].null_count() == 6


def test_a_few_trials_have_no_interval_but_a_number():
    case = case_results("few", {BASELINE: around(4, 4)})
    single = CaseResults(**{**case._asdict(), "methods": {BASELINE: case.methods[BASELINE][:, :1]}})
    found = find_tables(Comparison("1", "", {BASELINE: {"dial": "", "formula": ""}}, [single]))
    row = found.scores.row(0, named=True)
    assert math.isfinite(row["hypervolume_mean"])
    assert row["hypervolume_low"] is None


def test_what_is_learned_at_a_floor_of_performance_is_read_off_a_frontier():
    methods = {BASELINE: [(0.1, 6, 4), (0.3, 9.5, 2)], "undo": [(0.1, 6, 8), (0.3, 9.5, 1)]}
    made = {name: {"dial": "", "formula": ""} for name in methods}
    found = find_tables(Comparison("1", "", made, [case_results("one", methods)])).floors
    rows = {(row["method"], row["floor"]): row for row in found.rows(named=True)}
    middle, high = (7.5 - 6) / 3.5, (9 - 6) / 3.5  # of the way between the two settings
    expected = {
        (BASELINE, 0.5): 4,
        (BASELINE, 0.75): 4 - 2 * middle,
        (BASELINE, 0.9): 4 - 2 * high,
        ("undo", 0.5): 8,
        ("undo", 0.75): 8 - 7 * middle,
        ("undo", 0.9): 8 - 7 * high,
    }
    for key, learned in expected.items():
        assert rows[key]["unassisted_mean"] == pytest.approx(learned, abs=0.02), key
    for floor, sign in ((0.5, 1), (0.75, 1), (0.9, -1)):
        row = rows["undo", floor]
        assert sign * row["unassisted_lead_low"] > 0 < sign * row["unassisted_lead_high"]
    assert found.filter(method=BASELINE)["unassisted_lead_mean"].null_count() == 3
