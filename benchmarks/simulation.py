"""Learner steps per second on one core, against a plain Python loop and a plain C loop.

Rates on one core are of processor time, which a busy machine disturbs less than the clock on the
wall; those of two threads are of wall-clock time.
"""

import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import plain_python
from measuring import Row, Target, Timed, alternate, compared, is_quick, seconds_of, show

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.learners import make_learner
from qbumpers.simulation import Condition, make_condition, run
from qbumpers.tasks import cliff_walking

ASSISTANTS = {
    "none": make_assistant("none"),
    "maximal": make_assistant("maximal"),
    "local-q-thresholding": make_assistant("local-q-thresholding", alpha=0.0195, second=True),
    "stochastic-q-bumpers": make_assistant("stochastic-q-bumpers", alpha=0.7, second=True),
}
LEARNERS = tuple(name for name in cliff_walking().learners if name != "q-learning")
FLOOR = Target(30, at_least=True)
UNIT = "M steps/s"

_TRIALS, _PYTHON_TRIALS, _THREADED_TRIALS = 1_000, 4, 4_000
_SOURCE = Path(__file__).with_name("cliff_walking.c")
_STANDARD_ERRORS = 4


class Loops:
    """The same learner in three programs, with the means that each has found so far.

    Args:
        folder: for the compiled C program.
    """

    def __init__(self, folder: Path) -> None:
        self.condition = condition_of(ASSISTANTS["stochastic-q-bumpers"])
        self.program = _compile(folder)
        self.own_means: list[np.ndarray] = []  # a row per trial: assisted, unassisted
        self.other_means: dict[str, list[tuple[float, float]]] = {"Python": [], "C": []}

    def package(self, seed: int) -> float:
        """Million steps per second of the package's compiled loops."""
        begin = time.process_time()
        simulation = run(self.condition, trials=_TRIALS, seed=seed)
        seconds = time.process_time() - begin
        outcomes = simulation.outcomes
        returns = np.stack([outcomes.assisted_return, outcomes.unassisted_return])
        self.own_means.append(returns.mean(axis=2).T)
        return simulation.steps / seconds / 1e6

    def python(self, seed: int) -> float:
        """Million steps per second of the plain Python loop."""
        begin = time.process_time()
        totals = plain_python.run(
            self.condition.assistant, self.condition.values, _PYTHON_TRIALS, seed
        )
        seconds = time.process_time() - begin
        self.other_means["Python"].append((totals.assisted_mean, totals.unassisted_mean))
        return totals.steps / seconds / 1e6

    def c(self, seed: int) -> float:
        """Million steps per second of the plain C loop."""
        answer = subprocess.run(
            [str(self.program), str(_TRIALS), str(seed)], capture_output=True, text=True, check=True
        )
        steps, seconds, assisted, unassisted = map(float, answer.stdout.split())
        self.other_means["C"].append((assisted, unassisted))
        return steps / seconds / 1e6

    def check_agreement(self) -> None:
        """Raise RuntimeError if the programs' means lie too far apart."""
        own = np.concatenate(self.own_means)
        for name, trials in (("Python", _PYTHON_TRIALS), ("C", _TRIALS)):
            rounds = self.other_means[name]
            if not rounds:
                continue
            # Trials are alike in every program: the package's many give the spread of them all.
            error = own.std(axis=0) * np.sqrt(1 / len(own) + 1 / (trials * len(rounds)))
            apart = np.abs(own.mean(axis=0) - np.mean(rounds, axis=0)) / error
            if (apart > _STANDARD_ERRORS).any():
                raise RuntimeError(
                    f"the package and the plain {name} loop disagree by {apart.round(1).tolist()} "
                    "standard errors (assisted, unassisted): they do not measure the same learner"
                )


def condition_of(assistant: Assistant, learner: str = "q-learning") -> Condition:
    """The assistant and a learner at Cliff Walking, their loop compiled."""
    condition = make_condition(cliff_walking(), assistant, learner=make_learner(learner))
    run(condition, trials=1)
    return condition


def _compile(folder: Path) -> Path | None:
    compiler = shutil.which("cc")
    if compiler is None:
        print("No C compiler (cc): the comparison with the C loop is left out.")
        return None
    program = folder / "cliff_walking"
    flags = ["-O3", "-march=native"]
    subprocess.run([compiler, *flags, str(_SOURCE), "-o", str(program), "-lm"], check=True)
    return program


def against_plain_loops(rounds: int) -> list[Row]:
    """The package against the plain Python loop and, if it can be compiled, the C loop."""
    with tempfile.TemporaryDirectory() as folder:
        loops = Loops(Path(folder))
        timed: dict[str, Timed] = {"ours": loops.package, "Python": loops.python}
        if loops.program is not None:
            timed["C"] = loops.c
        rates = alternate(timed, rounds)
    loops.check_agreement()
    ours = rates.pop("ours")
    return [
        compared("simulation, one core", ours, UNIT, f"plain {name} loop", theirs, FLOOR)
        for name, theirs in rates.items()
    ]


def by_assistant(rounds: int) -> list[Row]:
    """Each assistant's rate, in proportion to that without an assistant."""
    rates = alternate(
        {name: _rate(condition_of(assistant)) for name, assistant in ASSISTANTS.items()}, rounds
    )
    return [
        compared(f"simulation, {name}", rate, UNIT, "none", rates["none"], FLOOR)
        for name, rate in rates.items()
    ]


def by_learner(rounds: int) -> list[Row]:
    """Each learner's rate, in proportion to that of Q-learning with the same assistant."""
    rows = []
    for name in ("none", "stochastic-q-bumpers"):
        learners = {
            learner: _rate(condition_of(ASSISTANTS[name], learner))
            for learner in ("q-learning", *LEARNERS)
        }
        rates = alternate(learners, rounds)
        rows += [
            compared(f"{learner}, {name}", rates[learner], UNIT, "q-learning", rates["q-learning"])
            for learner in LEARNERS
        ]
    return rows


def _rate(condition: Condition) -> Timed:
    def timed(seed: int) -> float:
        begin = time.process_time()
        simulation = run(condition, trials=_TRIALS, seed=seed)
        return simulation.steps / (time.process_time() - begin) / 1e6

    return timed


def two_workers(rounds: int) -> Row:
    """Two threads against one; a ratio of 2 would be perfect."""
    condition = condition_of(ASSISTANTS["stochastic-q-bumpers"])
    steps = run(condition, trials=_THREADED_TRIALS).steps

    def rate(workers: int) -> Timed:
        def timed(_: int) -> float:
            seconds = seconds_of(lambda: run(condition, trials=_THREADED_TRIALS, workers=workers))
            return steps / seconds / 1e6

        return timed

    rates = alternate({"two": rate(2), "one": rate(1)}, rounds)
    row = compared("simulation, two workers", rates["two"], UNIT, "one worker", rates["one"])
    efficiency = statistics.median(row.ratios) / 2
    return row._replace(name=f"{row.name}, efficiency {efficiency:.0%}")


def measure(quick: bool) -> list[Row]:
    """Every row of this benchmark."""
    rounds = 2 if quick else 9
    return [
        *against_plain_loops(rounds),
        *by_assistant(rounds),
        *by_learner(rounds),
        two_workers(rounds),
    ]


if __name__ == "__main__":
    show("Simulation", measure(is_quick(__doc__)))
