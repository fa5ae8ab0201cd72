"""Labels that can be read: none covers a point or another label."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qbumpers.analysis.figures.labels import label_in_column, room_for_labels
from qbumpers.analysis.figures.style import figure
from tests.analysis.drawn import segments

SIZE = np.array([6.0, 4.0])
PLACES = st.lists(st.tuples(st.floats(0, 6), st.floats(0, 4)), min_size=1, max_size=25)
# Half a line of text and half a character at 9 points, in inches: 72 points an inch, characters
# about 0.6 of the size wide, on average.
HALF_HEIGHT, HALF_WIDTH = 9 / 72 / 2, 9 / 72 * 0.6 / 2


def boxes(places, offsets, labels):
    """Edges of each placed label: left, right, bottom, top."""
    found = {}
    for index, (offset, label) in enumerate(zip(offsets, labels, strict=True)):
        if np.isfinite(offset[0]):
            x, y = places[index] + offset
            reach = HALF_WIDTH * len(label)
            found[index] = (x - reach, x + reach, y - HALF_HEIGHT, y + HALF_HEIGHT)
    return found


@given(PLACES)
@settings(deadline=None)
def test_labels_cover_neither_points_nor_each_other_and_stay_within(points):
    places = np.array(points)
    labels = [f"α = 0.{index:03}" for index in range(len(points))]
    found = boxes(places, room_for_labels(places, labels, SIZE), labels)
    for index, (left, right, bottom, top) in found.items():
        assert left >= 0
        assert bottom >= 0
        assert right <= SIZE[0]
        assert top <= SIZE[1]
        for x, y in places:
            assert not (left < x < right and bottom < y < top)
        for other, (start, end, low, high) in found.items():
            apart = left >= end or start >= right or bottom >= high or low >= top
            assert other == index or apart


def test_points_far_apart_all_find_room():
    places = np.array([[1.0, 1.0], [3.0, 2.0], [5.0, 3.0]])
    offsets = room_for_labels(places, ["α = 1"] * 3, SIZE)
    assert np.isfinite(offsets).all()
    assert np.abs(offsets).max() < 0.5


def test_the_first_of_two_equal_points_is_served_first_and_points_without_label_count():
    crowd = np.full((12, 2), 2.0) + np.linspace(0, 0.05, 12)[:, np.newaxis]
    offsets = room_for_labels(crowd, ["α = 0.0195"] * 12, SIZE)
    assert np.isfinite(offsets[0]).all()
    assert np.isnan(offsets[-1]).all()
    alone = room_for_labels(np.array([[3.0, 2.0]]), ["α = 1"], SIZE)
    beside = np.concatenate([[[3.0, 2.0]], np.array([[3.0, 2.0]]) + alone])
    assert not np.array_equal(room_for_labels(beside, ["α = 1"], SIZE), alone)


def column(points, labels, **limits):
    with figure(4, 3) as drawing:
        axes = drawing.subplots()
        axes.set(**limits)
        label_in_column(axes, points, labels, at=0.8, ink="#000000")
    return axes


@pytest.mark.parametrize("count", [1, 5, 14])
def test_labels_of_a_cluster_stand_apart_within_the_axes_in_the_order_of_their_points(count):
    generator = np.random.default_rng(count)
    points = np.stack([np.full(count, 50.0), generator.uniform(-500, -480, count)], axis=1)
    labels = [f"p{index}" for index in range(count)]
    axes = column(points, labels, xlim=(40, 60), ylim=(-700, -300))
    texts = {text.get_text().strip(): text.get_position() for text in axes.texts}
    assert {x for x, _ in texts.values()} == {56.0}
    heights = [(texts[f"p{index}"][1] + 700) / 400 for index in np.argsort(points[:, 1])]
    assert heights == sorted(heights)
    assert all(0 < height < 1 for height in heights)
    assert count == 1 or min(np.diff(heights)) > 0.05  # a line of text is lower
    lines = {tuple(start): tuple(end) for start, end in segments(axes.collections[0])}
    assert lines == {tuple(points[index]): texts[f"p{index}"] for index in range(count)}


def test_more_labels_than_fit_still_stay_within_the_axes():
    points = np.stack([np.zeros(30), np.linspace(0.9, 1, 30)], axis=1)
    heights = [text.get_position()[1] for text in column(points, ["x"] * 30).texts]
    assert min(heights) > 0
    assert max(heights) < 1
    assert len(set(heights)) == 30
