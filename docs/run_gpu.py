"""Measure a graphics card: `python docs/run_gpu.py [PART ...]`, some minutes on a large card.

Five parts: `seconds`, how long how many learners take on the cores of this machine and on the card,
on the cores alone if there is none; `agreement`, in how many of 10,000 trials a step is another one
than on the processor, and whether means agree; `benchmark`, benchmarks/gpu.py; `divergence`,
benchmarks/divergence.py; `map`, the hypervolume of bumpers over `v_min` and `p_max`, with all
alphas in it, at a hundred thousand learners per point. Numbers are kept in docs/data/gpu, the map
in docs/images/gpu-map.png. `--quick` shows that it runs, with a simulated card too.
"""

import argparse
import functools
import importlib
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from qbumpers import make_assistant, make_task, simulate, solve
from qbumpers.analysis.hypervolume import hypervolume
from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.learners import make_learner
from qbumpers.simulation import Card, device_of, make_condition, simulate_means

FOLDER = Path(__file__).parent
SEED = 17
LEARNERS = ("q-learning", "two-rate", "softmax-q-learning")
"""That are compared step by step: without exponentials, and with them in every choice."""

ALPHAS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
FLOORS = (-400.0, -200.0, -100.0, -50.0, 0.0, 40.0)
SURE = (0.6, 0.8, 0.9, 0.99, 0.999, 0.9999)


class Size(NamedTuple):
    """How much is simulated.

    Attributes:
        agreement: trials that are compared step by step.
        learners: per point of the map.
        episodes: of a trial.
        alphas: of the map.
        floors: values of `v_min`.
        sure: values of `p_max`.
        numbers: learners whose seconds are measured.
    """

    agreement: int = 10_000
    learners: int = 100_000
    episodes: int = 100
    alphas: tuple[float, ...] = ALPHAS
    floors: tuple[float, ...] = FLOORS
    sure: tuple[float, ...] = SURE
    numbers: tuple[int, ...] = (100, 1_000, 10_000, 100_000, 1_000_000)


QUICK = Size(2, 4, 2, (0.2, 0.8), (0.0,), (0.9, 0.999), (2, 4))
MOST_ON_CORES = 100_000


def seconds(size: Size, card: Card | None, keep: Callable[[Any], None]) -> None:
    """How long means of learners with bumpers take, once everything is compiled."""
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7, second=True)
    devices = ["processor"] if card is None else ["processor", "gpu"]
    found: dict[str, dict[int, float]] = {device: {} for device in devices}
    for device in devices:
        for trials in (1, *size.numbers):
            if device == "gpu" or trials <= MOST_ON_CORES:
                begin = time.perf_counter()
                simulate_means(
                    "cliff-walking", bumpers, trials=trials, seed=SEED, device=device,
                    workers=usable_cores(), episodes=size.episodes,
                )  # fmt: skip
                found[device][trials] = time.perf_counter() - begin
                print(f"{device}, {trials} learners: {found[device][trials]:.3f} s")
                keep(found)


def agreement(size: Size, card: Card, keep: Callable[[Any], None]) -> None:
    """How many trials part, and the means of both."""
    from qbumpers.simulation.cuda.agreement import agreement as compared

    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7, second=True)
    found: dict[str, Any] = {}
    for name in LEARNERS:
        condition = make_condition(
            "cliff-walking", bumpers, learner=make_learner(name), episodes=min(size.episodes, 20)
        )
        found[name] = compared(condition, size.agreement, SEED, card)._asdict()
        print(f"{name}: {found[name]['parted']} of {size.agreement} trials part")
    for precision, device in (("float64", "processor"), ("float64", "gpu"), ("float32", "gpu")):
        outcomes = simulate(
            "cliff-walking", bumpers, trials=size.agreement, seed=SEED, device=device,
            precision=precision, episodes=size.episodes,
        ).outcomes  # fmt: skip
        for name in ("assisted_return", "unassisted_return"):
            means = getattr(outcomes, name).mean(axis=1)
            error = means.std() / len(means) ** 0.5
            found[f"{device} {precision} {name}"] = {"mean": means.mean(), "error": error}
            print(f"{device}, {precision}, {name}: {means.mean():.3f} +- {error:.3f}")
            keep(found)


def benchmark(name: str, quick: bool, keep: Callable[[Any], None]) -> None:
    """The rows of a benchmark, each kept as soon as it is measured."""
    sys.path.insert(0, str(FOLDER.parent / "benchmarks"))
    measured, measuring = importlib.import_module(name), importlib.import_module("measuring")
    rows = []
    for row in measuring.watched(measured.measure(quick)):
        rows.append(row)
        keep({"rows": [{**each._asdict(), "ratios": list(each.ratios)} for each in rows]})
    measuring.show(str(measured.__doc__).splitlines()[0], rows)


def map_of_bumpers(size: Size, keep: Callable[[Any], None]) -> None:
    """Normalised hypervolume of bumpers for each `v_min` and `p_max`, over all alphas."""
    task = make_task("cliff-walking")
    best = float(solve(task)(int(np.flatnonzero(task.start)[0])).max())
    reference = np.array([_point(size, "none", {})[0], _point(size, "maximal", {})[1]])
    begin = time.perf_counter()
    points = {
        (floor, sure): [
            _point(size, "stochastic-q-bumpers", {"alpha": alpha, "v_min": floor, "p_max": sure})
            for alpha in size.alphas
        ]
        for floor in size.floors
        for sure in size.sure
    }
    seconds = time.perf_counter() - begin
    box = float(np.prod(best - reference))
    shares = [
        [float(hypervolume(np.array(points[floor, sure]), reference)) / box for sure in size.sure]
        for floor in size.floors
    ]
    print(f"{len(points) * len(size.alphas)} points of {size.learners} learners: {seconds:.1f} s")
    keep({"shares": shares, "seconds": seconds, "points": len(points) * len(size.alphas)})
    draw(shares, size, _folder(size) / "images" / "gpu-map.png")


def _point(size: Size, name: str, options: dict[str, float]) -> tuple[float, float]:
    means = simulate_means(
        "cliff-walking", make_assistant(name, **options), trials=size.learners, seed=SEED,
        device="gpu", episodes=size.episodes,
    )  # fmt: skip
    return float(means.assisted_return.mean()), float(means.unassisted_return.mean())


def draw(shares: list[list[float]], size: Size, file: Path) -> None:
    """Draw the map.

    Args:
        shares: hypervolume by `v_min` and `p_max`, as a share of the box.
        size: what was simulated.
        file: PNG, to be written.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
    image = axes.imshow(shares, origin="lower", aspect="auto", cmap="viridis", vmin=0, vmax=1)
    for row, numbers in enumerate(shares):
        for column, number in enumerate(numbers):
            colour = "black" if number > 0.6 else "white"
            axes.text(column, row, f"{number:.2f}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(size.sure)), [f"{sure:g}" for sure in size.sure])
    axes.set_yticks(range(len(size.floors)), [f"{floor:g}" for floor in size.floors])
    axes.set_xlabel("p_max")
    axes.set_ylabel("v_min")
    figure.colorbar(image, label="share of the box that all alphas cover")
    figure.savefig(file, dpi=150)
    plt.close(figure)


def _folder(size: Size) -> Path:
    """A quick run leaves the documentation alone."""
    place = FOLDER.parent / "results" / "gpu-quick" if size == QUICK else FOLDER
    (place / "images").mkdir(parents=True, exist_ok=True)
    return place


def main() -> None:
    """Measure, print, and keep the numbers."""
    arguments = argparse.ArgumentParser(description=__doc__)
    parts = ("seconds", "agreement", "benchmark", "divergence", "map")
    arguments.add_argument("parts", nargs="*", metavar="PART", help=", ".join(parts))
    arguments.add_argument("--quick", action="store_true", help="small, to see that it runs")
    given = arguments.parse_args()
    for part in given.parts:
        if part not in parts:
            arguments.error(f"PART = {part!r}; one of {', '.join(parts)} is needed")
    card: Any = None
    try:
        card = device_of("gpu")
    except RequestError as error:
        if given.parts != ["seconds"]:
            arguments.error(str(error))
    size = QUICK if given.quick else Size()
    folder = _folder(size) / "data" / "gpu"
    folder.mkdir(parents=True, exist_ok=True)

    def keep(part: str, found: Any) -> None:
        (folder / f"{part}.json").write_text(json.dumps(found, indent=1) + "\n", "utf-8")

    work: dict[str, Callable[[Callable[[Any], None]], None]] = {
        "seconds": lambda keep: seconds(size, card, keep),
        "agreement": lambda keep: agreement(size, card, keep),
        "benchmark": lambda keep: benchmark("gpu", given.quick, keep),
        "divergence": lambda keep: benchmark("divergence", given.quick, keep),
        "map": lambda keep: map_of_bumpers(size, keep),
    }
    for part in given.parts or parts:
        work[part](functools.partial(keep, part))


if __name__ == "__main__":
    main()
