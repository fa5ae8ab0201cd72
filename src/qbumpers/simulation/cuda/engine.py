"""Trials on a card, block by block; a trial that comes to no end there is left to the processor."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from qbumpers.decisions import Step
from qbumpers.simulation import tabular
from qbumpers.simulation.condition import Condition, outcome_room, streams
from qbumpers.simulation.cuda import card as cards
from qbumpers.simulation.cuda.block import Begun, begin
from qbumpers.simulation.cuda.devices import Card
from qbumpers.simulation.cuda.kernel import Found
from qbumpers.simulation.cuda.layout import LANES, Far, changed, of_one
from qbumpers.simulation.outcomes import (
    Outcomes,
    Simulation,
    Sinks,
    StateCounts,
    TrialMeans,
    joined,
    trial_means,
)

_MOST_TRIALS = 1 << 18  # of a block: more than a large card runs at once, and over in a second
_SHARE = 0.5  # of the free memory that a block may take


class _Part(NamedTuple):
    """Trials of one group in one block; `ends` says whether they are the last of their group."""

    trials: range
    ends: bool


class _Ran(NamedTuple):
    """What a block of T trials gave, on the processor again.

    Attributes:
        outcomes: arrays [T, E].
        totals: of arrays [G, S], a row per part of the block.
        finished: uint8 [T].
        record: `Step` of arrays as `Far` has them; None if nothing is kept.
    """

    outcomes: Outcomes
    totals: StateCounts
    finished: np.ndarray
    record: Any


def run_groups(
    condition: Condition, groups: Iterable[range], seed: int, card: Card
) -> Iterator[Simulation]:
    """Simulate groups of trials, and count states for each group by itself.

    Args:
        condition: what to simulate, of a task with a table.
        groups: which trials, ranges of step 1.
        seed: the experiment's, for the random streams.
        card: where.

    Yields:
        What each group found, in their order. A stop, as by Ctrl-C, takes effect between blocks.

    Raises:
        RequestError: what a rule or learner raises in a trial, or if it cannot run on a card.
    """
    begun = begin(condition, card.precision, recorded=False)
    pieces: list[Simulation] = []
    for block in _blocks(groups, _most_trials(begun, card)):
        ran = _run(condition, begun, block, seed, card)
        _finish(condition, block, seed, ran)
        first = 0
        for group, part in enumerate(block):
            rows = slice(first, first + len(part.trials))
            first = rows.stop
            pieces.append(
                Simulation(
                    Outcomes(*(array[rows] for array in ran.outcomes)),
                    StateCounts(*(array[group] for array in ran.totals)),
                )
            )
            if part.ends:
                yield joined(pieces)
                pieces = []


def run_block(condition: Condition, trials: range, seed: int, card: Card) -> Simulation:
    """Simulate trials as one group; `run_groups` says what the arguments are."""
    [found] = run_groups(condition, [trials], seed, card)
    return found


def run_means(condition: Condition, trials: range, seed: int, card: Card) -> TrialMeans:
    """Means of trials, found on the card; `run_groups` says what the arguments are."""
    begun, parts = begin(condition, card.precision, recorded=False), list[TrialMeans]()
    for block in _blocks([trials], _most_trials(begun, card)):
        with cards.chosen(card):
            sinks, kept = _launched(condition, begun, block, seed)
            means = cards.means(sinks.outcomes, condition.episodes)
            finished = cards.returned(kept.finished)
        for place, alone in _left(condition, block, seed, finished):
            own = trial_means(alone.outcomes, condition.episodes)
            for array, mean in zip(means, own, strict=True):
                array[place] = mean[0]
        parts.append(means)
    return TrialMeans(*map(np.concatenate, zip(*parts, strict=True)))


def records(condition: Condition, trials: range, seed: int, card: Card) -> Iterator[Step]:
    """Every step of training of trials.

    Args:
        condition: what to simulate, of a task with a table.
        trials: which, a range of step 1.
        seed: the experiment's, for the random streams.
        card: where.

    Yields:
        A table of steps of each trial, `Step` of arrays [N].

    Raises:
        RequestError: as `run_groups`.
    """
    begun = begin(condition, card.precision, recorded=True)
    for block in _blocks([trials], _most_trials(begun, card)):
        ran = _run(condition, begun, block, seed, card)
        lengths = ran.outcomes.assisted_length.sum(axis=1).tolist()
        for place, trial in enumerate(_numbers(block)):
            if ran.finished[place]:
                steps = [of_one(column, place)[: lengths[place]] for column in ran.record]
                yield Step(*map(np.ascontiguousarray, steps))
            else:
                yield tabular.record(condition, range(trial, trial + 1), seed, None)


def _most_trials(begun: Begun, card: Card) -> int:
    fit = int(_SHARE * cards.free_bytes(card)) // begun.bytes
    return max(1, min(_MOST_TRIALS, fit))


def _blocks(groups: Iterable[range], most: int) -> Iterator[list[_Part]]:
    """Parts of groups, as many trials at once as may be."""
    block: list[_Part] = []
    left = most
    for group in groups:
        rest = group
        while len(rest):
            part, rest = rest[:left], rest[left:]
            block.append(_Part(part, not len(rest)))
            left -= len(part)
            if not left:
                yield block
                block, left = [], most
    if block:
        yield block


def _numbers(block: list[_Part]) -> list[int]:
    return list(itertools.chain.from_iterable(part.trials for part in block))


def kernel_arguments(
    condition: Condition,
    begun: Begun,
    groups: Sequence[range],
    seed: int,
    own: Callable[[np.ndarray, int], Far],
    empty: Callable[[tuple[int, ...], Any], Any],
) -> tuple[Any, ...]:
    """What the kernel takes for a block of trials.

    Args:
        condition: what is simulated.
        begun: what its trials begin with.
        groups: which trials, one range after another.
        seed: the experiment's, for the random streams.
        own: makes, of an array that a trial begins with and the number of groups of `LANES` trials,
            those of all trials.
        empty: makes an array of a shape and type to be filled, its first axis innermost.

    Returns:
        Its arguments, in arrays of the processor but for those that `own` and `empty` make.
    """
    sizes = [len(group) for group in groups]
    trials, states = sum(sizes), condition.task.states
    parts = begun.learner, begun.minds, begun.counts, begun.record
    whole = -(-trials // LANES)
    learner, minds, counts, record = changed(Far, lambda far: own(far.arrays, whole), parts)
    # Trials are innermost in memory: threads that run in step write side by side.
    room = outcome_room(condition, 0)
    outcomes = Outcomes(*(empty((trials, *each.shape[1:]), each.dtype) for each in room))
    found = Found(
        StateCounts(*(np.zeros((len(groups), states), np.int64) for _ in range(3))),
        np.repeat(np.arange(len(groups), dtype=np.int32), sizes),
        np.zeros(trials, np.uint8),
    )
    drawn = np.concatenate([streams(condition, group, seed) for group in groups])
    return (
        begun.dynamics, begun.assistance, learner, minds, (drawn,), begun.retention,
        Sinks(outcomes, counts, record, None), found,
    )  # fmt: skip


def _run(condition: Condition, begun: Begun, block: list[_Part], seed: int, card: Card) -> _Ran:
    """Run a block of trials, however each of them ends."""
    with cards.chosen(card):
        sinks, kept = _launched(condition, begun, block, seed)
        outcomes, found, record = cards.returned((sinks.outcomes, kept, sinks.record))
    steps = changed(Far, lambda far: far.arrays, record)
    return _Ran(outcomes, found.totals, found.finished, steps)


def _launched(
    condition: Condition, begun: Begun, block: list[_Part], seed: int
) -> tuple[Sinks, Found]:
    """What a block of trials came to, on the card."""
    groups = [part.trials for part in block]
    arguments: Any = cards.sent(
        kernel_arguments(condition, begun, groups, seed, cards.own_arrays, cards.empty_array)
    )
    cards.launch(begun.space, arguments, sum(map(len, groups)))
    return arguments[-2:]


def _left(
    condition: Condition, block: list[_Part], seed: int, finished: np.ndarray
) -> Iterator[tuple[int, Simulation]]:
    """What came to no end on the card, by its place: the processor does it, or raises its error."""
    numbers = _numbers(block)
    for place in np.flatnonzero(finished == 0).tolist():
        trials = range(numbers[place], numbers[place] + 1)
        yield place, tabular.run_block(condition, trials, seed)


def _finish(condition: Condition, block: list[_Part], seed: int, ran: _Ran) -> None:
    """Fill in what came to no end on the card."""
    groups = np.repeat(np.arange(len(block)), [len(part.trials) for part in block])
    for place, alone in _left(condition, block, seed, ran.finished):
        for array, row in zip(ran.outcomes, alone.outcomes, strict=True):
            array[place] = row[0]
        group = groups[place]
        for array, counted in zip(ran.totals, alone.counts or (), strict=True):
            array[group] += counted
