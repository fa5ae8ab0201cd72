"""Sentences say what the tables show, and nothing that an interval leaves open."""

import pytest

from qbumpers.comparison import sentences
from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.results import Comparison
from qbumpers.comparison.scores import find_tables
from tests.comparison.made_up import case_results

CASES = [
    case_results(
        "easy",
        {
            BASELINE: [(0.3, 4, 2), (0.04, 2, 4)],
            "undo": [(0.3, 8, 8), (0.04, 8, 9)],
            "correct": [(0.3, 4, 2), (0.04, 2, 4)],
        },
    ),
    case_results(
        "hard",
        {
            BASELINE: [(0.3, 8, 8), (0.04, 8, 9)],
            "undo": [(0.3, 4, 2), (0.15, 2, 4)],
            "correct": [(0.3, 8, 8), (0.04, 8, 9)],
        },
    ),
    case_results("same", {BASELINE: [(0.11, 9, 9)], "undo": [(0.11, 9, 9)]}, best=0.05),
]


@pytest.fixture(scope="module")
def tables():
    methods = {name: {"dial": "", "formula": ""} for name in (BASELINE, "undo", "correct")}
    return find_tables(Comparison("1", "", methods, CASES))


def test_where_a_method_is_clearly_ahead_and_behind(tables):
    found = sentences.by_method(tables)
    assert BASELINE not in found
    assert "In 2 comparable cases, undo covers clearly more in 1 of them (easy" in found["undo"]
    assert "clearly less in 1 of them (hard" in found["undo"]
    assert "neither clearly more nor clearly less in any of them" in found["correct"]


def test_a_case_without_a_conflict_is_named(tables):
    (said,) = [each for each in sentences.overall(tables) if "conflict" in each]
    assert "in same with q-learning" in said
    assert "easy" not in said


def test_nothing_is_clearly_more_over_two_cases_that_disagree(tables):
    text = " ".join(sentences.overall(tables))
    assert "covers most" in text
    assert "Clearly more" not in text or "undo" not in text.partition("Clearly more")[2]


def test_shares_that_are_out_of_reach_are_counted(tables):
    said = {each.split()[0]: each for each in sentences.reach(tables)}
    # Its shares go from 4% to 30%, from 15% to 30%, and are 11% alone.
    assert "5% in 2, 10% in 2, 20% in 1 and 40% in 3" in said["undo"]
    assert said["undo"].endswith("of 3 cases.")


def test_ahead_and_behind_at_equal_shares(tables):
    counts = {
        (r["share"], r["method"]): r for r in sentences.versus_at_shares(tables).rows(named=True)
    }
    assert counts[0.2, "undo"]["ahead"] == counts[0.2, "undo"]["behind"] == 1
    assert counts[0.2, "correct"]["ahead"] == counts[0.2, "correct"]["behind"] == 0
    assert counts[0.1, "undo"]["cases"] == 1
    (said,) = [each for each in sentences.at_shares(tables) if each.startswith("At 5%")]
    assert "undo (1 of 1) is ahead" in said


def test_what_is_left_out_is_said_with_its_reason(tables):
    assert sentences.left_out(tables) == [
        "shield is left out of easy, hard and same: the task announces no crash."
    ]


def test_who_teaches_more_at_equal_performance_in_most_cases():
    better = {BASELINE: [(0.3, 8, 2), (0.1, 6, 4)], "undo": [(0.3, 8, 6), (0.1, 6, 8)]}
    cases = [case_results(name, better) for name in ("one", "two")]
    methods = {name: {"dial": "", "formula": ""} for name in (BASELINE, "undo")}
    said = sentences.at_floors(find_tables(Comparison("1", "", methods, cases)))
    assert [each.partition(",")[0] for each in said] == [
        f"If assisted return must be {floor} of the way from no assistance to the best"
        for floor in ("50%", "75%")
    ]
    assert all("undo (2 of 2) teaches clearly more in most" in each for each in said)
