"""Draw and write the page on learner-aware bumpers: `python docs/make_learner_aware.py [FOLDER]`.

Its numbers are those that `run_learner_aware.py` kept.
"""

import json
import sys
from pathlib import Path
from typing import Any

from lander_picture import lander_picture
from learner_aware_picture import belief_picture
from make_pictures import keep
from run_learner_aware import DATA, aimed
from writing import DOCS, number, template


def signed(value: float) -> str:
    """A difference, with its sign."""
    return ("+" if value > 0 else "") + number(value, 3)


def write(folder: Path) -> None:
    """Draw the picture into `folder`/images, and write the page into `folder`."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    keep(belief_picture(), images, "learner-aware")
    data: dict[str, Any] = {
        path.stem.replace("-", "_"): json.loads(path.read_text(encoding="utf-8"))
        for path in sorted(DATA.glob("*.json"))
    }
    keep(lander_picture(data["lunar_lander"]["rules"]), images, "learner-aware-lander")
    losing = min(data["tasks"].items(), key=lambda row: row[1]["low"])
    page = template("learner-aware.md.j2", signed).render(
        data, aims=aimed(data["points"]), losing=losing
    )
    (folder / "learner-aware.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS)
