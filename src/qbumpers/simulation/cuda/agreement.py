"""How far a card and the processor do the same, step by step."""

from typing import NamedTuple

from qbumpers.decisions import Step
from qbumpers.simulation import tabular
from qbumpers.simulation.condition import Condition
from qbumpers.simulation.cuda.devices import Card
from qbumpers.simulation.cuda.engine import records

_DOING = ("state", "proposed", "executed", "overridden", "next_state", "events")


class Agreement(NamedTuple):
    """What a comparison found.

    Attributes:
        trials: how many were compared.
        parted: in how many of them some step is another one.
        steps: how many steps were compared, up to where trials part.
        differing: on how many of those the probability of an override is another number.
        largest: the largest of these differences.
    """

    trials: int
    parted: int
    steps: int
    differing: int
    largest: float


def agreement(condition: Condition, trials: int, seed: int, card: Card) -> Agreement:
    """Compare every step of training on a card with that on the processor.

    Args:
        condition: what is simulated, of a task with a table.
        trials: how many, from 0 on.
        seed: for the random streams.
        card: where.
    """
    parted = steps = differing = 0
    largest = 0.0
    for trial, found in enumerate(records(condition, range(trials), seed, card)):
        expected = tabular.record(condition, range(trial, trial + 1), seed, None)
        alike = _alike(found, expected)
        parted += alike < max(len(found.state), len(expected.state))
        apart = abs(found.probability[:alike] - expected.probability[:alike])
        steps += alike
        differing += int((apart > 0).sum())
        largest = max(largest, float(apart.max(initial=0.0)))
    return Agreement(trials, parted, steps, differing, largest)


def _alike(found: Step, expected: Step) -> int:
    """How many steps are the same before the first other one."""
    length = min(len(found.state), len(expected.state))
    for field in _DOING:
        other = (getattr(found, field)[:length] != getattr(expected, field)[:length]).nonzero()[0]
        length = min([length, *other.tolist()])
    return length
