"""Measure learner-aware bumpers against bumpers: `python docs/run_learner_aware.py [PART ...]`.

Prints tables with verdicts, and keeps their numbers for the page in docs/data/learner-aware. All of
it takes about half an hour on one core; `--trials 10` shows in a minute or two what it prints.
"""

import argparse
import json
import statistics
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from learner_aware_fields import (
    ALPHAS,
    AWARE,
    MODEL_FREE,
    PROFILES,
    SEED,
    STOCHASTIC,
    TASKS,
    compared,
    field_of,
    methods,
    q_learner,
    samples,
    show,
)
from learner_aware_filter import TOLD, shares_by_episode
from learner_aware_speed import nanoseconds

from qbumpers import make_assistant, simulate
from qbumpers.assistants.mirrors import PERCEPTIONS
from qbumpers.learners import Motor, QLearner, make_learner
from qbumpers.learners.schedules import Schedule
from qbumpers.tasks import TabularTask, cliff_walking
from qbumpers.values import learn_values

DATA = Path(__file__).with_name("data") / "learner-aware"
POINT_TRIALS, FILTER_TRIALS = 2_000, 60
BLOCKS = ((0, 5), (5, 10), (10, 20), (20, 50), (50, 100))
"""First episode, and the one after the last, of the parts of a course."""

SPEED = 3.0
"""Million learner steps a second that are aimed at."""

AIMS = (("figures", 75.0, -115.0), ("text", 75.0, -250.0), ("text", 50.0, -107.0))
"""Profile, assisted return, unassisted return to be exceeded; -107 is that of practice alone."""


def tasks_compared(names: Iterable[str], rule: str, trials: int | None) -> Any:
    """Compare at tasks in both profiles, one after the other."""
    names = list(names)
    for name in names:
        measured = TASKS[name]
        for profile in PROFILES:
            many = trials or measured.trials
            learner = q_learner(measured.make(), profile)
            field = field_of(measured, many, learner=learner)
            rules = methods(field, profile, rule)
            yield f"{name}, {profile}", compared(field, rules, many, 2 * len(names))


def part_tasks(trials: int | None) -> Any:
    """Eight tasks, both profiles, one rule, alpha alone swept."""
    return show("Tasks, transition learners", tasks_compared(TASKS, AWARE, trials))


def part_model_free(trials: int | None) -> Any:
    """Stochastic tasks without a model."""
    title = "Stochastic tasks, without a model of the task"
    return show(title, tasks_compared(STOCHASTIC, MODEL_FREE, trials))


def part_perceptions(trials: int | None) -> Any:
    """Cliff Walking for learners of three perceptions."""

    def rows() -> Any:
        measured = TASKS["cliff-walking"]
        many = trials or measured.trials
        for perception in PERCEPTIONS:
            for profile in PROFILES:
                learner = q_learner(measured.make(), profile)
                field = field_of(measured, many, learner=learner, perception=perception)
                rules = methods(field, profile)
                yield f"{perception}, {profile}", compared(field, rules, many, 6)

    return show("Cliff Walking, by perception", rows())


def part_filter(trials: int | None) -> Any:
    """What the filter believes by episode, and what it would be worth to be told the truth."""
    measured, many = TASKS["cliff-walking"], trials or FILTER_TRIALS
    task, shares = measured.make(), {}
    ends = [end for _, end in BLOCKS]
    print("\nCliff Walking: weight of the true perception by episode, up to", *ends)
    for perception in PERCEPTIONS:
        for profile in PROFILES:
            learner = q_learner(task, profile)
            found = shares_by_episode(task, learner, perception, 0.2, many, SEED)
            blocks = [float(found[:, first:end].mean()) for first, end in BLOCKS]
            shares[f"{perception}, {profile}"] = blocks
            print(f"{perception + ', ' + profile:26}", *(f"{b:5.2f}" for b in blocks), flush=True)

    def rows() -> Any:
        for perception in PERCEPTIONS:
            for profile in PROFILES:
                learner = q_learner(task, profile)
                field = field_of(measured, many, learner=learner, perception=perception)
                place = PERCEPTIONS.index(perception)
                told = [make_assistant(TOLD, alpha=alpha, perception=place) for alpha in ALPHAS]
                rules = {"aware": methods(field, profile)["aware"], "told": told}
                yield f"{perception}, {profile}", compared(field, rules, many, 6)

    return {"shares": shares, "told": show("Against the same, told the perception", rows(), "told")}


def part_points(trials: int | None) -> Any:
    """Points at Cliff Walking that were aimed at."""
    task, kept = cliff_walking(), {}
    print("\nCliff Walking, transition learners: assisted / unassisted (standard errors)")
    alphas = sorted({*ALPHAS, 0.15, 0.16, 1.05, 1.2})
    for profile in PROFILES:
        learner = q_learner(task, profile)
        for alpha in alphas:
            rows = samples(
                task, make_assistant(AWARE, alpha=alpha), trials or POINT_TRIALS, learner=learner
            )
            mean, error = rows.mean(axis=0), rows.std(axis=0) / np.sqrt(len(rows))
            kept[f"{profile} {alpha:g}"] = [*map(float, mean), *map(float, error)]
            print(
                f"{profile:8} alpha {alpha:<5g} {mean[0]:7.1f} ({error[0]:.1f}) / "
                f"{mean[1]:8.1f} ({error[1]:.0f})",
                flush=True,
            )
    for aim in aimed(kept):
        print(
            f"{aim.profile}: {aim.assisted:g} assisted and more than {aim.unassisted:g} "
            f"unassisted: {aim.verdict}, {aim.above:+.1f} standard errors at alpha {aim.alpha}"
        )
    return kept


class Aim(NamedTuple):
    """A point that was aimed at, and the alpha that comes furthest beyond it.

    Attributes:
        profile: of the learner.
        assisted: the least return.
        unassisted: the return to be exceeded.
        alpha: of those that return enough assisted.
        above: standard errors of the unassisted return by which it is exceeded.
        verdict: reached if by more than two.
    """

    profile: str
    assisted: float
    unassisted: float
    alpha: str
    above: float
    verdict: str


def aimed(points: dict[str, list[float]]) -> list[Aim]:
    """What came of the points that were aimed at, from the rows of `part_points`."""
    found = []
    for profile, assisted, unassisted in AIMS:
        above = {
            name.split()[1]: (learned - unassisted) / error
            for name, (helped, learned, _, error) in points.items()
            if name.startswith(profile) and helped >= assisted
        }
        alpha = max(above, key=lambda each: above[each])
        most = above[alpha]
        verdict = "reached" if most > 2 else "reached by the mean alone" if most > 0 else "missed"
        found.append(Aim(profile, assisted, unassisted, alpha, most, verdict))
    return found


def part_speed(trials: int | None) -> Any:
    """Million learner steps per second of processor time on one core, and what takes them."""
    task, kept = cliff_walking(), {}
    print("\nMillion learner steps a second, one core")
    for profile in PROFILES:
        setup = {"learner": q_learner(task, profile), "trials": trials or 200}
        for alpha in (0.2, 1.0):
            rates = []
            for seed in range(4):  # the first compiles
                begin = time.process_time()
                found = simulate(task, make_assistant(AWARE, alpha=alpha), seed=seed, **setup)
                rates.append(found.steps / (time.process_time() - begin) / 1e6)
            rate = kept[f"{profile} {alpha:g}"] = statistics.median(rates[1:])
            said = "reached" if rate >= SPEED else "missed"
            print(f"{profile:8} alpha {alpha:g}: {rate:.2f}, {SPEED:g} {said}", flush=True)
    pieces = nanoseconds()
    print(f"Nanoseconds of a piece, of the {1e3 / SPEED:.0f} that {SPEED:g} million leave a step")
    for name, each in pieces.items():
        print(f"{name:46}{each:6.0f}")
    return {"rates": kept, "pieces": pieces}


def other_learners(task: TabularTask) -> dict[str, dict[str, Any]]:
    """Learners that the rule was not made for, and values that are not exact."""
    constant = Schedule(0.1, 0.1, 0.0)
    return {
        "Q-learning": {},
        "SARSA": {"learner": make_learner("sarsa")},
        "expected SARSA": {"learner": make_learner("expected-sarsa")},
        "softmax": {"learner": make_learner("softmax-q-learning")},
        "actor-critic": {"learner": make_learner("actor-critic")},
        "two rates": {"learner": make_learner("two-rate")},
        "model-based": {"learner": make_learner("model-based")},
        "imitator": {"learner": make_learner("imitator")},
        "constant rates": {"learner": QLearner(1.0, constant, constant)},
        "slips of the hand": {"motor": Motor(slip=0.1)},
        "forgetting": {"forgetting": 0.05},
        "estimated values": {"values": learn_values(task, episodes=2_000, seed=SEED)},
    }


class Robustness(NamedTuple):
    """What a setting that was chosen for one learner does for another.

    Attributes:
        assisted: mean return.
        unassisted: mean return.
        score: mean of both, as shares of the way from the reference point of Q-learning to the best
            return.
        regret: how much more score the best setting for this learner has.
    """

    assisted: float
    unassisted: float
    score: float
    regret: float


def part_robust(trials: int | None) -> Any:
    """Alpha chosen with Q-learning in `figures`, scored on all others, at Cliff Walking."""
    measured, chosen = TASKS["cliff-walking"], {}
    many, kept = trials or measured.trials, {}
    usual = field_of(measured, many)
    print("\nCliff Walking, alpha chosen with Q-learning: assisted / unassisted, score (regret)")
    rivals = methods(usual, "figures")
    rivals.pop("second")
    for name, setup in other_learners(measured.make()).items():
        kept[name] = {}
        for method, settings in rivals.items():
            means = [samples(usual.task, s, many, **setup).mean(axis=0) for s in settings]
            scores = [float(np.mean((m - usual.reference) / (usual.best - usual.reference)))
                      for m in means]  # fmt: skip
            place = chosen.setdefault(method, int(np.argmax(scores)))
            assisted, unassisted = map(float, means[place])
            regret = max(scores) - scores[place]
            found = Robustness(assisted, unassisted, scores[place], regret)
            kept[name][method] = {"alpha": ALPHAS[place], **found._asdict()}
        print(f"{name:20}", *(
            f"{'bumpers' if method == 'best' else method} (alpha {each['alpha']:g}) "
            f"{each['assisted']:7.1f} / {each['unassisted']:8.1f}, "
            f"{each['score']:6.2f} ({each['regret']:.2f})   "
            for method, each in kept[name].items()
        ), flush=True)  # fmt: skip
    regrets = {name: each["aware"]["regret"] for name, each in kept.items()}
    worst = max(regrets, key=lambda name: regrets[name])
    behind = [n for n, each in kept.items() if each["aware"]["score"] < each["best"]["score"]]
    print(f"Largest regret {regrets[worst]:.2f}, {worst}; behind bumpers: {behind or 'nowhere'}")
    return kept


PARTS = {
    "points": part_points,
    "tasks": part_tasks,
    "perceptions": part_perceptions,
    "filter": part_filter,
    "robust": part_robust,
    "model-free": part_model_free,
    "speed": part_speed,
}


def main() -> None:
    """Measure what was asked for, and keep the numbers of full runs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="parts:\n" + "\n".join(f"  {n:12} {part.__doc__}" for n, part in PARTS.items()),
    )  # fmt: skip
    parser.add_argument("parts", nargs="*", metavar="PART", help="all of them if none is named")
    parser.add_argument("--trials", type=int, help="of every condition; nothing is kept then")
    given = parser.parse_args()
    for name in given.parts:
        if name not in PARTS:
            parser.error(f"there is no part {name!r}; there are {', '.join(PARTS)}")
    for name in given.parts or PARTS:
        kept = PARTS[name](given.trials)
        if given.trials is None:
            DATA.mkdir(parents=True, exist_ok=True)
            text = json.dumps(kept, indent=1, default=float)
            (DATA / f"{name}.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
