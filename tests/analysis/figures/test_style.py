"""What figures have in common, and how they are saved."""

import re
from xml.etree import ElementTree

import matplotlib as mpl
import numpy as np
import pytest
from PIL import Image

from qbumpers.analysis.figures.style import (
    NAMES,
    colour,
    figure,
    label_in_column,
    marker,
    readable,
    save,
)


def drawn():
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        axes.plot([0, 1], [2, 5])
        axes.set(xlabel="episode", ylabel="return")
    return drawing


def test_a_saved_figure_is_a_png_of_the_right_size_and_an_svg(tmp_path):
    path = save(drawn(), tmp_path / "figures", "curve")
    assert sorted(p.name for p in path.parent.iterdir()) == ["curve.png", "curve.svg"]
    with Image.open(path) as picture:
        assert (picture.format, picture.size) == ("PNG", (4 * 150, 3 * 150))
        assert len(picture.convert("RGB").getcolors(1 << 20)) > 10  # something is drawn
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
    looks = [(colour(name), marker(name)) for name in NAMES]
    assert len({ink for ink, _ in looks}) == len({shape for _, shape in looks}) == 4
    own = (colour("my-own-rule"), marker("my-own-rule"))
    assert own == (colour("my-own-rule"), marker("my-own-rule"))
    assert own[0] not in {ink for ink, _ in looks}
    assert own[1] not in {shape for _, shape in looks}
    assert re.fullmatch("#[0-9a-f]{6}", own[0])


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


@pytest.mark.parametrize("count", [1, 5, 14])
def test_labels_of_a_cluster_stand_apart_within_the_axes_in_the_order_of_their_points(count):
    generator = np.random.default_rng(count)
    points = np.stack([np.full(count, 50.0), generator.uniform(-500, -480, count)], axis=1)
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        axes.set(xlim=(40, 60), ylim=(-700, -300))
        label_in_column(axes, points, [f"p{i}" for i in range(count)], at=0.8, ink="#000000")
    notes = {note.get_text(): note for note in axes.texts}
    assert {note.xy for note in notes.values()} == {tuple(point) for point in points}
    assert {note.xyann[0] for note in notes.values()} == {0.8}
    heights = [notes[f"p{index}"].xyann[1] for index in np.argsort(points[:, 1])]
    assert heights == sorted(heights)
    assert all(0 < height < 1 for height in heights)
    assert count == 1 or min(np.diff(heights)) > 0.05  # a line of text is lower


def test_more_labels_than_fit_still_stay_within_the_axes():
    points = np.stack([np.zeros(30), np.linspace(0.9, 1, 30)], axis=1)
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        label_in_column(axes, points, ["x"] * 30, at=0.8, ink="#000000")
    heights = [note.xyann[1] for note in axes.texts]
    assert min(heights) > 0
    assert max(heights) < 1
    assert len(set(heights)) == 30
