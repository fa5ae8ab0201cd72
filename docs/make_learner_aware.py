"""Draw and write the page on learner-aware bumpers: `python docs/make_learner_aware.py [FOLDER]`.

Its numbers are those that `run_learner_aware.py` kept.
"""

import json
import sys
from pathlib import Path
from typing import Any

import make_pictures as pictures
from lander_picture import lander_picture
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from writing import DOCS, number, template

from qbumpers.analysis.figures.style import figure
from qbumpers.learners.q_learning import q_update

DATA = DOCS / "data" / "learner-aware"
RATE, TIMES = 0.3, 10
ALONG, AWAY, FALL = 80.0, 60.0, -100.0 + 60.0
"""What the learner of the picture believes of the cell along the cliff, the one back, the start."""

LOOKS = {
    "executed right each time": ("#0072b2", "solid"),
    "executed left each time": ("#009e73", "solid"),
    "one fall, then left": (pictures.OWN, "solid"),
}


def beliefs(outcomes: list[float]) -> list[float]:
    """What a transition learner believes of an action, before and after each outcome."""
    found = [0.0]
    for outcome in outcomes:
        found.append(q_update(found[-1], outcome, 0.0, RATE))
    return found


def belief_picture() -> Figure:
    """What is executed for a proposal, and what the learner comes to believe of the proposal."""
    courses = (
        [ALONG - 1] * TIMES,
        [AWAY - 1] * TIMES,
        [FALL] + [AWAY - 1] * (TIMES - 1),
    )
    with figure(10, 3.4) as drawing:
        corner, axes = drawing.subplots(1, 2, width_ratios=(1, 1.25))
        _draw_choices(corner)
        for (name, (ink, line)), outcomes in zip(LOOKS.items(), courses, strict=True):
            axes.plot(range(TIMES + 1), beliefs(outcomes), color=ink, linestyle=line, label=name)
        axes.axhline(ALONG - 1, color="black", linewidth=1, linestyle="dotted")
        axes.annotate("what it believes of right", (TIMES, ALONG), ha="right", va="bottom")
        axes.set(
            xlabel="times that down was proposed here", ylabel="what is believed of down",
            title="... and what the learner comes to believe", ylim=(-20, 100),
        )  # fmt: skip
        axes.legend(fontsize=8, loc="lower right")
    return drawing


def _draw_choices(axes: Axes) -> None:
    pictures.draw_corner(axes)
    pictures.draw_arrow(axes, (0, 0.95), pictures.OWN, "dashed")
    pictures.draw_arrow(axes, (0.9, 0), LOOKS["executed right each time"][0], "solid")
    pictures.draw_arrow(axes, (-0.9, 0), LOOKS["executed left each time"][0], "solid")
    axes.set_title("Down is proposed; what is executed ...")


def signed(value: float) -> str:
    """A difference, with its sign."""
    return ("+" if value > 0 else "") + number(value, 3)


def write(folder: Path) -> None:
    """Draw the picture into `folder`/images, and write the page into `folder`."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    pictures.keep(belief_picture(), images, "learner-aware")
    data: dict[str, Any] = {
        path.stem.replace("-", "_"): json.loads(path.read_text(encoding="utf-8"))
        for path in sorted(DATA.glob("*.json"))
    }
    pictures.keep(lander_picture(data["lunar_lander"]["rules"]), images, "learner-aware-lander")
    page = template("learner-aware.md.j2", signed).render(data)
    (folder / "learner-aware.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS)
