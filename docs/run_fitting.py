"""What `qbumpers fit` recovers: `python docs/run_fitting.py > docs/data/fitting.txt`.

Simulated participants at Cliff Walking, whose learner is known, are explained by every learner. It
takes about half an hour on one core. The parts recovery, confusion and strangers can be named.
"""

import sys
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from qbumpers import Step, make_assistant
from qbumpers.fitting import Likelihood, choices_of, estimate, fit, interval, make_candidate
from qbumpers.learners import Schedule, make_learner, register_learner
from qbumpers.learners.interface import Shape
from qbumpers.random_streams import draw
from qbumpers.simulation import make_condition, record

ASSISTANT = make_assistant("stochastic-q-bumpers", alpha=0.5)
SHAPE = Shape(48, 0, (0,) * 4)
LEARNERS = ("q-learning", "sarsa", "expected-sarsa", "softmax-q-learning", "actor-critic",
            "model-based", "two-rate")  # fmt: skip
PEOPLE, PARTICLES = 4, 30
SEEN = ("transition", "observant", "interruption")
CONSTANT = ("epsilon", "learning_rate", "actor_rate", "critic_rate")
"""Schedules that do not change, in what is simulated and in what is fitted."""

RANGES = {
    "q-learning": {"epsilon": (0.05, 0.4), "learning_rate": (0.05, 0.9)},
    "softmax-q-learning": {
        "inverse_temperature": (0.1, 2.0), "perseveration": (-1.0, 1.0),
        "unchosen_decay": (0.0, 0.1), "learning_rate": (0.05, 0.9),
    },
}  # fmt: skip
"""From which the numbers of simulated participants are drawn."""


class Habit(NamedTuple):
    """Repeats in a state what it did there last, if no fall came of it; else anything.

    Attributes:
        error: probability of any action.
    """

    error: float = 0.1


class HabitMemory(NamedTuple):
    """What it did last: int64 [S], -1 if nothing that it would repeat."""

    last: np.ndarray


def start(settings, shape, stream):
    """Nothing that it would repeat."""
    return HabitMemory(np.full(shape.states, -1))


def policy(settings, memory, state, rates, out):
    """The probabilities of `choose`."""
    last = memory.last[state]
    for action in range(len(out)):
        out[action] = 1 / len(out)
        if last >= 0:
            out[action] *= settings.error
    if last >= 0:
        out[last] += 1 - settings.error


def choose(settings, memory, state, rates, stream):
    """What it did last in this state, or any action."""
    chance, other = draw(stream), int(draw(stream) * 4)
    last = memory.last[state]
    return last if last >= 0 and chance >= settings.error else other


def prefer(settings, memory, state, tie):
    """What it did last in this state."""
    return memory.last[state] if memory.last[state] >= 0 else int(tie * 4)


def learn(settings, memory, transition, rates, stream):
    """Remember what it did, unless that led to a fall or nowhere."""
    fell = transition.reward < -10
    stayed = transition.next_state == transition.state
    memory.last[transition.state] = -1 if fell or stayed else transition.action


HABIT = register_learner(
    "habit", Habit, start=start, choose=choose, prefer=prefer, policy=policy, learn=learn
)


def constant(numbers: Mapping[str, float]) -> dict[str, Any]:
    """Settings in which schedules do not change."""
    return {
        name: Schedule(number, number, 0.0) if name in CONSTANT else number
        for name, number in numbers.items()
    }


def played(learner: Any, trial: int, episodes: int, perception: str = "transition") -> Step:
    """The record of a simulated participant."""
    condition = make_condition(
        "cliff-walking", ASSISTANT, learner=learner, perception=perception, episodes=episodes
    )
    return record(condition, trial=trial)


def first_episodes(steps: Step, episodes: int) -> Step:
    """The beginning of a record."""
    return Step(*(column[steps.episode < episodes] for column in steps))


def recovery(learner: str, people: int, sizes: tuple[int, ...]) -> None:
    """Print how far estimates are from the truth, and how often intervals hold it."""
    generator = np.random.default_rng([2031, len(learner)])
    names, rows = [*RANGES[learner]], []
    candidate = make_candidate(learner, "transition", free=["learning_rate"]
                               + ["epsilon"] * ("epsilon" in names))  # fmt: skip
    for person in range(people):
        truth = {name: float(generator.uniform(*RANGES[learner][name])) for name in names}
        whole = played(make_learner(learner, **constant(truth)), person, max(sizes))
        for size in sizes:
            choices = choices_of(first_episodes(whole, size), f"participant {person}")
            likelihood = Likelihood(candidate, choices, SHAPE, size)
            found = estimate(likelihood)
            for name in names:
                low, high = interval(likelihood, found, name)
                rows.append((size, name, truth[name], found.parameters[name], low, high))
    table = pl.DataFrame(rows, ("episodes", "parameter", "truth", "estimate", "low", "high"),
                         orient="row")  # fmt: skip
    error = (pl.col("estimate") - pl.col("truth")).abs().median()
    width = (pl.col("high") - pl.col("low")).median()
    held = ((pl.col("low") <= pl.col("truth")) & (pl.col("truth") <= pl.col("high"))).sum()
    print(f"\n{learner}, {people} participants")
    print(f"{'parameter':20} episodes  median error  median width  intervals that hold the truth")
    summary = table.group_by("parameter", "episodes", maintain_order=True).agg(
        error.alias("error"), width.alias("width"), held.alias("held")
    )
    for row in summary.sort("parameter", "episodes").iter_rows():
        print(f"{row[0]:20} {row[1]:8} {row[2]:13.3f} {row[3]:13.3f} {row[4]:6} of {people}")


def winners(table: pl.DataFrame) -> dict[str, int]:
    """For how many participants each model has the largest held-out log-likelihood."""
    best = table.sort("held_out", descending=True).group_by("participant").first()
    return dict(best.group_by("model").len().iter_rows())


def confusion(title: str, truths: Mapping[str, Mapping[str, Step]], **models: Any) -> None:
    """Print which model wins for participants of each kind."""
    print(f"\n{title}")
    for truth, people in truths.items():
        found = fit(people, intervals=False, particles=PARTICLES, **models)
        counts = sorted(winners(found.scores).items(), key=lambda each: -each[1])
        shown = ", ".join(f"{model} {count}" for model, count in counts)
        probability = found.models["probability"][0]
        print(f"  {truth:28} {shown}; {probability:.3f} per choice", flush=True)


def of_kind(
    name: str, people: int, episodes: int, perception: str = "transition"
) -> dict[str, Step]:
    """Records of participants that learn in the same way."""
    numbers = {"epsilon": 0.1, "learning_rate": 0.5}
    known = {k: v for k, v in constant(numbers).items() if k in make_learner(name)._fields}
    learner = make_learner(name, **known)
    return {str(trial): played(learner, trial, episodes, perception) for trial in range(people)}


def recoveries() -> None:
    """Print what is known of parameters."""
    print("RECOVERY: how far estimates are from the truth", flush=True)
    recovery("q-learning", 20, (5, 20, 80))
    recovery("softmax-q-learning", 10, (5, 20))


def confusions() -> None:
    """Print what is known of learners and perceptions."""
    print("CONFUSION: which model wins, for how many participants", flush=True)
    for episodes in (5, 20):
        confusion(
            f"learners, {PEOPLE} participants of {episodes} episodes each",
            {name: of_kind(name, PEOPLE, episodes) for name in LEARNERS},
            learners=LEARNERS, perceptions=["transition"], free=CONSTANT,
        )  # fmt: skip
        confusion(
            f"perceptions of q-learning, {PEOPLE} participants of {episodes} episodes each",
            {seen: of_kind("q-learning", PEOPLE, episodes, seen) for seen in SEEN},
            learners=["q-learning"], perceptions=SEEN, free=CONSTANT[:2],
        )  # fmt: skip


def strangers() -> None:
    """Print what is found if none of the models is right, and if one is."""
    print("NONE OF THE MODELS: a learner of habits", flush=True)
    people = {str(trial): played(HABIT(), trial, 20) for trial in range(PEOPLE)}
    for models in (LEARNERS, (*LEARNERS, "habit")):
        title = f"{PEOPLE} participants of 20 episodes, {len(models)} models"
        confusion(
            title, {"habit": people}, learners=models, perceptions=["transition"], free=CONSTANT
        )


PARTS = {"recovery": recoveries, "confusion": confusions, "strangers": strangers}


def main() -> None:
    """Print the parts that are named, or all."""
    names = sys.argv[1:] or [*PARTS]
    for number, name in enumerate(names):
        if number:
            print()
        PARTS[name]()


if __name__ == "__main__":
    main()
