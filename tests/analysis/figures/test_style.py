"""What figures have in common, and how they are saved."""

import itertools
import re
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
import pytest
from PIL import Image

from qbumpers.analysis.figures.style import (
    NAMES,
    assistant_of,
    figure,
    looks,
    readable,
    save,
    setting,
    show_returns,
)
from tests.narrowing import present


def drawn():
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        axes.plot([0, 1], [2, 5])
        axes.set(xlabel="episode", ylabel="return")
    return drawing


def test_a_figure_looks_the_same_whatever_the_settings_of_a_notebook(tmp_path):
    plain = save(drawn(), tmp_path / "plain", "curve").read_bytes()
    hostile: dict[Any, Any] = {
        "text.usetex": True, "axes.facecolor": "black", "savefig.bbox": "tight", "font.size": 30,
        "font.family": "monospace", "path.sketch": (1, 100, 2), "lines.linewidth": 9,
        "figure.autolayout": True, "axes.unicode_minus": False,
    }  # fmt: skip
    with mpl.rc_context(hostile):
        settings = dict(mpl.rcParams)
        assert save(drawn(), tmp_path / "hostile", "curve").read_bytes() == plain
        assert dict(mpl.rcParams) == settings


def test_a_saved_figure_is_a_png_of_the_right_size_and_an_svg(tmp_path):
    path = save(drawn(), tmp_path / "figures", "curve")
    assert sorted(p.name for p in path.parent.iterdir()) == ["curve.png", "curve.svg"]
    with Image.open(path) as picture:
        assert (picture.format, picture.size) == ("PNG", (4 * 150, 3 * 150))
        assert len(present(picture.convert("RGB").getcolors(1 << 20))) > 10  # something is drawn
    root = ElementTree.parse(path.with_suffix(".svg")).getroot()
    assert root.tag.endswith("svg")
    assert (root.get("width"), root.get("height")) == ("288pt", "216pt")
    texts = {"".join(element.itertext()) for element in root.iter() if element.tag.endswith("text")}
    assert {"episode", "return"} <= texts  # as text, not as outlines


def test_saving_again_gives_the_same_bytes(tmp_path):
    for name in ("first", "second"):
        save(drawn(), tmp_path / name, "curve")
    for ending in ("png", "svg"):
        files = [(tmp_path / name / f"curve.{ending}").read_bytes() for name in ("first", "second")]
        assert files[0] == files[1]


def test_drawing_leaves_the_users_own_style_alone():
    before = dict(mpl.rcParams)
    drawn()
    assert dict(mpl.rcParams) == before


def test_assistants_are_told_apart_by_colour_and_by_marker():
    own = ["one-rule", "eno-rule"]  # of equal letters
    drawn = looks([*NAMES, *own])
    assert list(drawn) == [*NAMES, *own]
    assert len({look.colour for look in drawn.values()}) == len(drawn)
    assert len({look.marker for look in drawn.values()}) == len(drawn)
    assert all(re.fullmatch("#[0-9a-f]{6}", look.colour) for look in drawn.values())


def test_twenty_rules_of_ones_own_all_look_different():
    drawn = looks(f"rule-{index}" for index in range(20))
    assert len(set(drawn.values())) == 20


def test_what_an_assistant_looks_like_does_not_depend_on_how_often_it_is_named():
    once, often = looks(["own", "none", "other"]), looks(["own", "own", "none", "other", "own"])
    assert once == often


@pytest.mark.parametrize(
    ("condition", "text"),
    [
        ("none", "No assistance"),
        ("stochastic-q-bumpers/alpha=0.7", "Stochastic Q Bumpers, α = 0.7"),
        ("local-q-thresholding/alpha=0,second=true", "Local Q-Thresholding, α = 0, second=true"),
        ("my-own-rule/zeal=3", "my-own-rule, zeal=3"),
    ],
)
def test_conditions_are_called_readably(condition, text):
    assert readable(condition) == text


def test_the_learner_is_left_out_of_a_conditions_name():
    condition = "stochastic-q-bumpers/alpha=0.7,p_max=0.8@perception=observant"
    assert readable(condition) == "Stochastic Q Bumpers, α = 0.7, p_max=0.8"
    assert setting(condition) == "α = 0.7, p_max=0.8"
    assert assistant_of(condition) == "stochastic-q-bumpers"
    assert (readable("none@penalty=2"), setting("none@penalty=2")) == ("No assistance", "")
    assert assistant_of("none@penalty=2") == "none"


@pytest.mark.parametrize("axis", ["x", "y"])
def test_only_returns_of_very_different_size_are_stretched(axis):
    for deepest, scale in ((-900, "linear"), (-1100, "symlog")):
        with figure(4, 3) as drawing:
            axes = drawing.subplots()
            axes.plot([0, deepest], [0, deepest])
            axes.margins(0)
            show_returns(axes, axis)
        assert {"x": axes.get_xscale(), "y": axes.get_yscale()}[axis] == scale
    along = axes.xaxis if axis == "x" else axes.yaxis
    for place, label in zip(along.get_ticklocs(), along.get_ticklabels(), strict=True):
        assert float(label.get_text().replace(",", "").replace("\N{MINUS SIGN}", "-")) == place


def test_returns_of_millions_are_written_in_full_and_not_stretched():
    with figure(9, 3) as drawing:
        axes = drawing.subplots()
        axes.plot([8.0e6, 8.4e6], [-8.4e6, -8.0e6])
        show_returns(axes, "x")
        show_returns(axes, "y")
    drawing.draw_without_rendering()
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "linear")
    for along in (axes.xaxis, axes.yaxis):
        low, high = along.get_view_interval()
        shown = [label.get_text() for label in along.get_ticklabels()]
        read = [float(text.replace(",", "").replace("\N{MINUS SIGN}", "-")) for text in shown]
        assert read == pytest.approx(along.get_ticklocs().tolist())
        assert sum(low <= number <= high for number in read) >= 2
        assert all("," in text for text in shown)
        assert along.get_offset_text().get_text() == ""


def test_small_returns_keep_their_decimals():
    with figure(9, 3) as drawing:
        axes = drawing.subplots()
        axes.plot([0.871, 0.874], [0, 1])
        show_returns(axes, "x")
    drawing.draw_without_rendering()
    shown = [float(label.get_text()) for label in axes.get_xticklabels()]
    assert shown == pytest.approx(axes.get_xticks().tolist())


def test_gains_of_millions_beside_losses_of_thousands_are_not_stretched():
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        axes.plot([0, 1], [-20_000, 6_000_000])
        show_returns(axes, "y")
    assert axes.get_yscale() == "linear"


@pytest.mark.parametrize("deepest", [-3e4, -8.4e6, -2e8])
def test_numbers_of_stretched_axes_do_not_overlap(deepest):
    with figure(10, 3) as drawing:
        axes = drawing.subplots(1, 2)[0]
        axes.plot([0, deepest], [0, 1])
        show_returns(axes, "x")
    drawing.draw_without_rendering()
    low, high = axes.get_xlim()
    labels = [
        label.get_window_extent()
        for label, place in zip(axes.get_xticklabels(), axes.get_xticks(), strict=True)
        if low <= place <= high
    ]
    assert len(labels) >= 3
    ordered = sorted(labels, key=lambda box: box.x0)
    assert all(first.x1 < second.x0 for first, second in itertools.pairwise(ordered))
