"""Figures show what the tables hold, and the page is whole with or without scores."""

import re

import numpy as np
import pytest

from qbumpers.comparison.figures import drawings, normalised
from qbumpers.comparison.methods import BASELINE
from qbumpers.comparison.page import floors_table, page, shares_table
from qbumpers.comparison.report import read_tables
from qbumpers.comparison.results import Comparison
from qbumpers.comparison.scores import find_tables
from qbumpers.errors import RequestError
from tests.comparison.made_up import case_results

METHODS = {name: {"dial": "a dial", "formula": "b < c"} for name in (BASELINE, "undo")}
CASES = [
    case_results("easy", {BASELINE: [(0.3, 4, 2), (0.05, 2, 4)], "undo": [(0.3, 8, 6)]}),
    case_results(
        "hard",
        {BASELINE: [(0.3, 8, 8), (0.05, 6, 9)], "undo": [(0.3, 8, 8), (0.05, 6, 9)]},
        learner="sarsa",
    ),
]
WITHOUT = [case_results("same", {BASELINE: [(0.1, 9, 9)], "undo": [(0.1, 9, 9)]}, best=0.05)]


def compared(cases):
    made = Comparison("1.2", "qbumpers compare --tasks easy", METHODS, cases)
    return made, find_tables(made)


@pytest.fixture(scope="module")
def tables():
    return compared(CASES)[1]


def test_every_figure_is_drawn_from_its_numbers(tables):
    found = {drawing.name: drawing for drawing in drawings(tables)}
    assert list(found) == ["planes@q-learning", "planes@sarsa", "matched", "scores", "ranks"]
    for drawing in found.values():
        assert drawing.numbers.height
        assert drawing.draw().axes
    plane = found["planes@q-learning"].draw().axes[0]
    assert plane.get_title(loc="left") == "easy"
    lines = [line.get_xydata() for line in plane.get_lines()]
    pairs = [xy for xy in lines if np.shape(xy) == (2, 2)]
    assert any(np.allclose(xy, [(4, 2), (2, 4)], atol=0.01) for xy in pairs)


def test_equal_shares_are_on_scales_from_the_reference_to_the_best(tables):
    row = normalised(tables).filter(method=BASELINE, share=0.2).row(0, named=True)
    # 10 is best, 0 the reference; at 20%, (3.2, 2.8) in one case and (7.2, 8.4) in the other.
    assert row["cases"] == row["of"] == 2
    assert row["assisted"] == pytest.approx(np.mean([0.32, 0.72]), abs=0.01)
    assert row["unassisted"] == pytest.approx(np.mean([0.28, 0.84]), abs=0.01)


def test_tables_of_levels_count_cases(tables):
    cells = {row[0]: row[1:] for row in shares_table(tables).rows}
    assert cells["undo"][4] == "1 of 2"  # in the easy case its only setting is at 30%
    cells = {row[0]: row[1:] for row in floors_table(tables).rows}
    assert cells["Stochastic Q Bumpers"][0] == "1 of 2"
    assert cells["undo"][0] == "2 of 2"


@pytest.mark.parametrize(("cases", "scored"), [(CASES, True), (WITHOUT, False)])
def test_a_page_is_whole_with_and_without_scores(cases, scored):
    made, found = compared(cases)
    text = page(made, found, [])
    assert ('id="scores"' in text) == scored
    assert "qbumpers compare --tasks easy" in text
    assert "b &lt; c" in text
    for anchor in re.findall(r"href=\"#([^\"]+)\"", text):
        assert f'id="{anchor}"' in text


def test_a_table_that_is_missing_is_named(tmp_path):
    with pytest.raises(RequestError, match=r"cases\.csv: there is no such file"):
        read_tables(tmp_path)
