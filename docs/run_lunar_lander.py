"""Run all that the page on Lunar Lander is made of: `python docs/run_lunar_lander.py FOLDER`.

Figure 4 at full size, then smaller runs with one thing changed in each, then the page. It takes
hours on two cores; stopped, it goes on where it was.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import tomli_w

from qbumpers import make_task
from qbumpers.experts.choosing import best, judge
from qbumpers.experts.loading import load_network
from qbumpers.reproduction.experiments import profiles, reproduction
from qbumpers.values import NetworkValues

TASK = "lunar-lander"
MAIN, SECOND, CORRECTED = "full", "second-expert", "corrected-values"
ALPHAS = {"none": None, "stochastic-q-bumpers": [1.0, 0.8], "local-q-thresholding": 0.9}
"""Of the assistants in smaller runs."""

TRIALS = 4


def main() -> None:
    """Run everything, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="for all results")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    qbumpers("reproduce", TASK, "--out", folder / MAIN)
    expert, second, corrected = (folder / f"{name}.npz" for name in ("expert", SECOND, CORRECTED))
    if not second.exists():
        qbumpers("expert", TASK, "--out", expert)
        second_best(expert).save(second)
    if not corrected.exists():
        qbumpers("expert", TASK, "--check", expert, "--corrected", corrected)
    others = profiles(TASK)[1:]
    for profile in others:
        run_smaller(folder, profile, profile)
    for values in (second, corrected):
        run_smaller(folder, values.stem, values=str(values))
    runs = [f"{name}={folder / name}" for name in (*others, SECOND, CORRECTED)]
    checked = [f"{path.stem}={path}" for path in (expert, corrected, second)]
    page = Path(__file__).with_name("make_lunar_lander.py")
    python(page, "--keep", folder / MAIN, "--runs", *runs, "--quality", *checked)


def second_best(expert: Path) -> NetworkValues:
    """The expert that would have been kept if the best had not been trained."""
    task = make_task(TASK)
    kept = load_network(task, expert)
    paths = sorted(expert.with_name(f"{expert.name}.work").iterdir())
    trained = [load_network(task, path) for path in paths]
    others = [values for values in trained if values.digest() != kept.digest()]
    return others[best([judge(task, values) for values in others])]


def run_smaller(
    folder: Path, name: str, profile: str = "figures", values: str | None = None
) -> None:
    """Four conditions of a few learners in a profile, or with other values."""
    design = reproduction(TASK, profile, trials=TRIALS, values=values)
    settings = design.model_dump(mode="json", exclude_none=True)
    settings["name"] = f"{TASK}-{name}"
    settings["assistants"] = [
        each | ({"alpha": ALPHAS[each["name"]]} if "alpha" in each else {})
        for each in settings["assistants"]
        if each["name"] in ALPHAS
    ]
    path = folder / f"{name}.toml"
    path.write_text(tomli_w.dumps(settings), encoding="utf-8")
    qbumpers("run", path, "--out", folder / name)


def qbumpers(*arguments: str | Path) -> None:
    """Run the command line."""
    python("-m", "qbumpers", *arguments)


def python(*arguments: str | Path) -> None:
    """Run Python; stop if it fails."""
    ended = subprocess.run([sys.executable, *map(str, arguments)])
    if ended.returncode:
        sys.exit(ended.returncode)


if __name__ == "__main__":
    main()
