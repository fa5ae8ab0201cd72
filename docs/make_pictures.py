"""Draw the pictures of the page on ideas: `python docs/make_pictures.py`."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke
from PIL import Image

from qbumpers import make_assistant, make_task
from qbumpers.analysis.figures.style import NAMES, figure, looks, save
from qbumpers.assistants.stochastic_q_bumpers import override_probability
from qbumpers.simulation import make_condition, record
from qbumpers.tasks.cliff_walking import ACTION_NAMES, COLUMNS, state_of
from qbumpers.tasks.displays.cliff_walking import cliff_walking_display
from qbumpers.tasks.drawing import picture

DOCS = Path(__file__).parent
CELL = 64  # pixels of a cell as rendered
OWN, DONE = "#d55e00", "#0072b2"
ASSISTANTS = {
    "none": {},
    "stochastic-q-bumpers": {"alpha": 0.7, "second": True},
    "maximal": {},
}


def make(folder: Path) -> None:
    """Draw every picture into `folder`/images."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    Image.fromarray(walker_picture()).save(images / "figure1.png", optimize=True)
    keep(credit_picture(), images, "credit")
    keep(probability_picture(), images, "override-probability")
    keep(belief_picture(), images, "belief")


def walker_picture() -> np.ndarray:
    """The walker beside the cliff."""
    return picture(cliff_walking_display(), state_of(2, 6))


def keep(drawing: Figure, images: Path, name: str, colours: int = 128) -> None:
    """Save a figure as a small PNG of so many colours."""
    path = save(drawing, images, name)
    path.with_suffix(".svg").unlink()
    shrink(path, colours)


def shrink(path: Path, colours: int = 128) -> None:
    """Reduce a PNG to a few colours, a third of its size."""
    with Image.open(path) as large:
        small = large.convert("RGB").quantize(colours, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def credit_picture() -> Figure:
    """One overridden step, as it happened and as a transition learner remembers it."""
    with figure(9, 2.45) as drawing:
        happened, remembered = drawing.subplots(1, 2)
        for axes in (happened, remembered):
            draw_corner(axes)
        draw_arrow(happened, (0, 0.95), OWN, "dashed")
        draw_arrow(happened, (0.9, 0), DONE, "solid")
        happened.set_title("What happened")
        happened.set_xlabel("chose down (dashed); the assistant executed right")
        draw_arrow(remembered, (0, 0.95), OWN, "solid")
        remembered.plot(3.5, 0.5, "o", markersize=24, fillstyle="none", color=OWN, mew=2.6)
        remembered.set_title("What a transition learner remembers")
        remembered.set_xlabel("down: lost 1, and came to the ringed cell")
    return drawing


def draw_corner(axes: Axes) -> None:
    """Five columns of the two lower rows, the walker in the middle."""
    corner = walker_picture()[2 * CELL :, 4 * CELL : 9 * CELL]
    axes.imshow(corner, extent=(0, 5, 2, 0))
    axes.set(xticks=[], yticks=[])
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def draw_arrow(axes: Axes, move: tuple[float, float], ink: str, line: str) -> None:
    """An arrow from the walker, outlined in white to be seen on the cliff."""
    arrow = FancyArrowPatch(
        (2.5, 0.5), (2.5 + move[0], 0.5 + move[1]), shrinkA=0, shrinkB=0, arrowstyle="-|>",
        mutation_scale=18, linewidth=2.6, linestyle=line, color=ink,
    )  # fmt: skip
    arrow.set_path_effects([withStroke(linewidth=5, foreground="white")])
    axes.add_patch(arrow)


def probability_picture() -> Figure:
    """Probability of an override against the projected return, for several alphas."""
    best, worst = 87.0, 0.0
    projected = np.linspace(worst, best, 400)
    alphas = (1.0, 0.7, 0.4, 0.15)
    with figure(8, 3.6) as drawing:
        axes = drawing.subplots()
        for alpha, shade in zip(alphas, (0.45, 0.63, 0.81, 1.0), strict=True):
            room = alpha * (best - worst)
            curve = [override_probability(best - g, room, 0.999, True) for g in projected]
            ink = (0.0, 0.447 * shade, 0.698 * shade, 1.0)
            axes.plot(projected, curve, color=ink, linewidth=2)
            axes.annotate(
                f"α = {alpha:g}", (best - room / 2, 0.5), xytext=(5, -9), fontsize=10,
                textcoords="offset points", color=ink, weight="bold",
            )  # fmt: skip
        axes.invert_xaxis()
        axes.set(
            xlabel="projected return of the episode, from V* = 87 down to v_min = 0",
            ylabel="probability of\nan override",
            title="The more an action gives away, the surer the override",
        )
    return drawing


def belief_picture() -> Figure:
    """How often learners beside the cliff choose to step off it, by episode."""
    with figure(8, 3.6) as drawing:
        axes = drawing.subplots()
        for name, options in ASSISTANTS.items():
            share = share_of_falls(name, options, trials=60)
            episodes = np.arange(1, len(share) + 1)
            axes.plot(
                episodes,
                100 * share,
                color=looks(NAMES)[name].colour,
                linewidth=2,
                label=NAMES[name],
            )
        axes.set(
            xlabel="episode",
            ylabel="choices beside the cliff\nthat step off it, per cent",
            title="Whom nobody lets fall does not learn to stay away",
            ylim=(0, None),
        )
        axes.legend()
    return drawing


def share_of_falls(name: str, options: dict[str, float], trials: int) -> np.ndarray:
    """Of the choices made beside the cliff, the share that steps off it, by episode."""
    condition = make_condition(make_task("cliff-walking"), make_assistant(name, **options))
    chosen, falls = np.zeros(condition.episodes), np.zeros(condition.episodes)
    down = ACTION_NAMES.index("down")
    for trial in range(trials):
        steps = record(condition, trial=trial)
        row, column = np.divmod(steps.state, COLUMNS)
        beside = (row == 2) & (column > 0) & (column < COLUMNS - 1)
        np.add.at(chosen, steps.episode[beside], 1)
        np.add.at(falls, steps.episode[beside & (steps.proposed == down)], 1)
    return falls / chosen


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS)
