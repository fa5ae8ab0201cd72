"""What figures show, as arrays."""

import numpy as np
from matplotlib.collections import Collection, LineCollection
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.text import Annotation, Text

from tests.narrowing import of_kind


def xs(line: Line2D) -> np.ndarray:
    """Horizontal data of a line's points, [N]."""
    return np.asarray(line.get_xdata())


def ys(line: Line2D) -> np.ndarray:
    """Vertical data of a line's points, [N]."""
    return np.asarray(line.get_ydata())


def corners(path: Path) -> np.ndarray:
    """Data of a path's corners, [N, 2]."""
    return np.asarray(path.vertices)


def segments(collection: Collection) -> list[np.ndarray]:
    """Data of the ends of every line in a collection of them, [N, 2] each."""
    return of_kind(LineCollection, collection).get_segments()


def point_of(text: Text) -> tuple[float, float]:
    """Data of the point that a label is at."""
    return of_kind(Annotation, text).xy
