"""Learner steps per second on a graphics card, against all cores and against a plain kernel.

The rate of a card is that of its kernel alone, and beside it that of `simulate_means` as a whole,
which also draws seeds and averages. Everything is compiled before anything is timed.
"""

import functools
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from measuring import Row, Target, Timed, alternate, compared, is_quick, show, watched

from qbumpers.assistants import make_assistant
from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.learners import make_learner
from qbumpers.simulation import Card, Condition, device_of, make_condition, run

UNIT = "M steps/s"
TASKS = {"cliff-walking": 0.0, "taxi": -20.0, "frozen-lake": 0.0}
"""With a return that bumpers may let an episode fall to."""

SHARES = {"float32": 0.5, "float64": 0.2}
"""Of the plain kernel's rate that the package is to reach with bumpers at Cliff Walking."""

_FEWER = 8  # times fewer trials of the heaviest rule, and again on the cores of this machine
_FULL = (1 << 17, 100, 3)  # trials, episodes, rounds
_QUICK = (8, 1, 1)
_STANDARD_ERRORS = 4


def conditions(task: str, episodes: int) -> dict[str, Condition]:
    """No assistant, bumpers, bumpers with SARSA, and the rule with the most to remember."""
    floor = TASKS[task]
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7, v_min=floor)
    heaviest = make_assistant("learner-aware-bumpers", alpha=0.7, v_min=floor)
    q_learning, sarsa = make_learner("q-learning"), make_learner("sarsa")
    return {
        name: make_condition(task, assistant, learner=learner, episodes=episodes)
        for name, assistant, learner in (
            ("none", make_assistant("none"), q_learning),
            ("bumpers", bumpers, q_learning),
            ("bumpers, SARSA", bumpers, sarsa),
            ("learner-aware", heaviest, q_learning),
        )
    }


def whole(condition: Condition, trials: int, card: Card) -> Timed:
    """Million steps per second of what `simulate_means` does on a card."""
    from qbumpers.simulation.cuda.engine import run_means

    run_means(condition, range(1), 0, card)

    def timed(seed: int) -> float:
        begin = time.perf_counter()
        means = run_means(condition, range(trials), seed, card)
        steps = (means.assisted_length + means.unassisted_length).sum() * condition.episodes
        return float(steps) / (time.perf_counter() - begin) / 1e6

    return timed


def kernel(condition: Condition, trials: int, card: Card) -> Timed:
    """Million steps per second of a kernel alone."""
    from qbumpers.simulation.cuda import card as cards
    from qbumpers.simulation.cuda.block import begin
    from qbumpers.simulation.cuda.engine import kernel_arguments

    begun = begin(condition, card.precision, recorded=False)

    def launched(trials: int, seed: int) -> tuple[Any, float]:
        with cards.chosen(card):
            arguments: Any = cards.sent(
                kernel_arguments(
                    condition, begun, [range(trials)], seed, cards.own_arrays, cards.empty_array
                )
            )
            started = time.perf_counter()
            cards.launch(begun.space, arguments, trials)
            seconds = time.perf_counter() - started
            return cards.returned(arguments[-2].outcomes), seconds

    launched(1, 0)  # compiles

    def timed(seed: int) -> float:
        outcomes, seconds = launched(trials, seed)
        steps = outcomes.assisted_length.sum() + outcomes.unassisted_length.sum()
        return float(steps) / seconds / 1e6

    return timed


def here(condition: Condition, trials: int) -> Timed:
    """Million steps per second of all cores of this machine."""
    run(condition, trials=1)

    def timed(seed: int) -> float:
        begin = time.perf_counter()
        simulation = run(condition, trials=trials, seed=seed, workers=usable_cores())
        return simulation.steps / (time.perf_counter() - begin) / 1e6

    return timed


class Prepared(NamedTuple):
    """What is to be timed of one condition, compiled.

    Attributes:
        name: of the condition.
        baseline: of `timed`, in words.
        timed: by name; the baseline too.
        target: of the package's kernel, as a share of the baseline's rate; None if there is none.
    """

    name: str
    baseline: str
    timed: dict[str, Timed]
    target: float | None = None


def against_cores(task: str, quick: bool, number: int) -> list[Prepared]:
    """A card against all cores, in both precisions."""
    found = []
    trials, episodes, _ = _QUICK if quick else _FULL
    for name, condition in conditions(task, episodes).items():
        if quick and name == "learner-aware":
            continue
        many = trials // _FEWER if name == "learner-aware" else trials
        timed = {"all cores": here(condition, many // _FEWER)}
        for precision in SHARES:
            card = Card(number, precision)  # type: ignore[arg-type]
            timed[f"kernel, {precision}"] = kernel(condition, many, card)
            timed[f"means, {precision}"] = whole(condition, many, card)
        found.append(Prepared(f"{task}, {name}", "all cores", timed))
    return found


def against_plain_kernel(quick: bool, number: int) -> list[Prepared]:
    """Bumpers at Cliff Walking against a kernel written by hand for them."""
    import plain_gpu

    trials, episodes, _ = _QUICK if quick else _FULL
    found = []
    bumpers = make_assistant("stochastic-q-bumpers", alpha=0.7, second=True)
    condition = make_condition("cliff-walking", bumpers, episodes=episodes)
    for precision, share in SHARES.items():
        card = Card(number, precision)  # type: ignore[arg-type]

        def plain(_: int, kind: str = precision, bits: str = "32 bits") -> float:
            one = plain_gpu.run(trials, episodes, 0.7, kind, bits)
            return one.steps / one.seconds / 1e6

        for bits in plain_gpu.STREAMS:
            by_hand = plain_gpu.run(trials, episodes, 0.7, precision, bits)
            _check_agreement(by_hand, condition, trials, card)
        timed = {
            "plain kernel": plain,
            f"plain kernel with 64-bit streams, {precision}": functools.partial(
                plain, bits="64 bits"
            ),
            f"kernel, {precision}": kernel(condition, trials, card),
        }
        found.append(Prepared("cliff-walking, bumpers", "plain kernel", timed, share))
    return found


def _check_agreement(found: Any, condition: Condition, trials: int, card: Card) -> None:
    outcomes = run(condition, trials=trials, card=card).outcomes
    pairs = {
        "assisted": (found.assisted, outcomes.assisted_return),
        "unassisted": (found.unassisted, outcomes.unassisted_return),
    }
    for which, (theirs, ours) in pairs.items():
        own = ours.mean(axis=1)
        error = np.sqrt((own.var() + theirs.var()) / trials)
        if abs(own.mean() - theirs.mean()) > _STANDARD_ERRORS * error:
            raise RuntimeError(
                f"{which}: the package finds {own.mean():.2f}, the plain kernel "
                f"{theirs.mean():.2f}: they do not measure the same learner"
            )


def measure(quick: bool) -> Iterator[Row]:
    """Every row of this benchmark; none, with a sentence, if there is no card."""
    try:
        card = device_of("gpu")
    except RequestError as error:
        print(f"Skipped: {error}")
        return
    number = card.number if card else 0
    tasks = list(TASKS)[:1] if quick else list(TASKS)
    prepared = against_plain_kernel(quick, number)
    for task in tasks:
        prepared += against_cores(task, quick, number)
    rounds = (_QUICK if quick else _FULL)[-1]
    for each in prepared:
        yield from _rows(each, rounds)


def _rows(prepared: Prepared, rounds: int) -> list[Row]:
    name, baseline, timed, share = prepared
    rates = alternate(timed, rounds)
    compared_with = rates.pop(baseline)
    target = None
    if share is not None:
        target = Target(share * float(np.median(compared_with)), at_least=True)
    return [
        compared(
            f"{name}, {what}", rate, UNIT, baseline, compared_with,
            target if what.startswith("kernel") else None,
        )
        for what, rate in rates.items()
    ]  # fmt: skip


if __name__ == "__main__":
    show("On a graphics card", [*watched(measure(is_quick(__doc__)))])
