"""Wall-clock times of whole commands, and of the grid of Figure 2."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from measuring import Row, Target, Timed, alternate, compared, is_quick, seconds_of, show

from qbumpers.experiments.plan import make_plan
from qbumpers.reproduction.experiments import reproduction
from qbumpers.simulation import run

UNIT = "s"
_LIBRARIES = "import gymnasium, matplotlib.pyplot"


def command_time(*arguments: str, cache: Path | None = None) -> float:
    """Seconds that a fresh Python process takes.

    Args:
        *arguments: of the interpreter.
        cache: where compiled code is kept; the usual place if None.

    Returns:
        From its start to its end, on the wall clock.
    """
    environment = {**os.environ, **({"NUMBA_CACHE_DIR": str(cache)} if cache else {})}
    return seconds_of(
        lambda: subprocess.run(
            [sys.executable, *arguments], env=environment, check=True, stdout=subprocess.DEVNULL
        )
    )


def reproduction_time(cache: Path | None = None) -> float:
    """Seconds that `qbumpers reproduce cliff-walking` takes into a fresh folder."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "results")
        return command_time(
            "-m", "qbumpers", "reproduce", "cliff-walking", "--out", out, cache=cache
        )


def importing(rounds: int) -> Row:
    """`import qbumpers` against the library that it registers its environments with."""
    ours, theirs = "import qbumpers", "import gymnasium"
    times = alternate({code: _starting(code) for code in (ours, theirs)}, rounds)
    return compared(ours, times[ours], UNIT, theirs, times[theirs], Target(0.5))


def reproducing(rounds: int) -> Row:
    """The whole reproduction, compiled before, against importing the libraries it draws with."""
    timed: dict[str, Timed] = {"ours": lambda _: reproduction_time(), "idle": _starting(_LIBRARIES)}
    alternate(timed, 1)  # compiles what is not compiled yet
    times = alternate(timed, rounds)
    return compared("reproduce, warm", times["ours"], UNIT, _LIBRARIES, times["idle"], Target(15))


def reproducing_cold() -> Row:
    """The whole reproduction with nothing compiled, once."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        cold = reproduction_time(cache)
        if not any(cache.rglob("*.nbc")):
            raise RuntimeError(f"no compiled code in {cache}: the run was not cold")
        idle = command_time("-c", _LIBRARIES)
    return compared("reproduce, cold", [cold], UNIT, _LIBRARIES, [idle], Target(60))


def figure_2(rounds: int) -> Row:
    """The grid of Figure 2 without its figures: 26 conditions, 100 trials of 100 episodes."""
    plan = make_plan(reproduction("cliff-walking", "figures"))

    def simulated(workers: int) -> Timed:
        def timed(seed: int) -> float:
            return seconds_of(
                lambda: [
                    run(condition, trials=plan.experiment.trials, seed=seed, workers=workers)
                    for condition in plan.conditions.values()
                ]
            )

        return timed

    timed = {"two": simulated(2), "one": simulated(1)}
    alternate(timed, 1)  # compiles what is not compiled yet
    times = alternate(timed, rounds)
    title = f"Figure 2 grid, {len(plan.conditions)} conditions, two threads"
    return compared(title, times["two"], UNIT, "one thread", times["one"], Target(3))


def _starting(code: str) -> Timed:
    return lambda _: command_time("-c", code)


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark; the cold run takes up to a minute, so not if quick."""
    imports, processes = (3, 1) if quick else (15, 5)
    rows = [importing(imports), figure_2(imports), reproducing(processes)]
    return rows if quick else [*rows, reproducing_cold()]


if __name__ == "__main__":
    show("Whole processes", measure(is_quick(__doc__)))
