"""Forgetting between episodes: a share each time, or by a power law since the last practice.

A layer over the tables of any learner's memory: what is forgotten is a part of the way that a value
has come from what it was at first.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import inlined


class PowerLaw(NamedTuple):
    """Forgetting by a power law: (1 + t)^-d is left t episodes after the last practice.

    An action in a state is practised when something is learned from it. The form is that of ACT-R's
    decay of a single trace, whose d is 0.5 by convention (Anderson and Schooler 1991; Anderson,
    Fincham and Douglass 1999), with episodes in place of seconds. That 0.5 is much here: 29% is
    gone an episode later.

    Attributes:
        decay: d, above 0.
    """

    decay: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.5


class Practice(NamedTuple):
    """When each action in each state was practised, and what is forgotten by then.

    Attributes:
        age: int64 [S, A], episodes since the last practice, or since the first episode.
        shares: float64 [E], by age, share of what is left that is lost until the next episode.
    """

    age: np.ndarray
    shares: np.ndarray


def practice_for(law: PowerLaw, states: int, actions: int, episodes: int) -> Practice:
    """What is to be kept of a learner's practice.

    Args:
        law: by which it forgets.
        states: S.
        actions: A.
        episodes: E, of a trial.

    Returns:
        The practice of a learner without any.
    """
    ages = np.arange(episodes)
    shares = 1 - ((1 + ages) / (2 + ages)) ** law.decay
    return Practice(np.zeros((states, actions), np.int64), shares)


@inlined
def begin_practice(practice: Practice | None) -> None:
    """Before a trial."""
    if practice is None:
        return
    for state in range(practice.age.shape[0]):
        for action in range(practice.age.shape[1]):
            practice.age[state, action] = 0


@inlined
def practise(practice: Practice | None, state: int, action: int) -> None:
    """Note that an action was learned from; nothing if nobody asks."""
    if practice is None:
        return
    practice.age[state, action] = 0


@inlined
def grow_older(practice: Practice) -> None:
    """Note that an episode has passed."""
    for state in range(practice.age.shape[0]):
        for action in range(practice.age.shape[1]):
            practice.age[state, action] += 1


def fade(table: np.ndarray, origin: np.ndarray, share: float) -> None:
    """Move a table towards what it was at first.

    Args:
        table: float64 [N, K], changed in place.
        origin: float64 [N, K], as it was at first.
        share: of the way, in [0, 1].
    """
    for state in range(table.shape[0]):
        for action in range(table.shape[1]):
            table[state, action] += share * (origin[state, action] - table[state, action])


@inlined
def _age(practice: Practice, state: int, column: int, columns: int) -> int:
    """Age of a number of a table, of which `columns` belong to each action, or 0 to none."""
    if columns > 0:
        return practice.age[state, column // columns]
    youngest = practice.age[state, 0]
    for action in range(practice.age.shape[1]):
        youngest = min(youngest, practice.age[state, action])
    return youngest


def fade_by_age(table: np.ndarray, origin: np.ndarray, practice: Practice) -> None:
    """Move a table towards what it was at first, by as much as the age of each number asks for.

    Args:
        table: float64 [S, K], changed in place. If K is a multiple of A, the same number of columns
            belongs to each action; else a number belongs to its state, and is as old as what was
            practised there last. A table of other than S rows is left alone.
        origin: float64 [S, K], as it was at first.
        practice: how often, and when, each pair was practised.
    """
    states, actions = practice.age.shape
    if table.shape[0] != states:
        return
    columns = table.shape[1] // actions if table.shape[1] % actions == 0 else 0
    for state in range(states):
        for column in range(table.shape[1]):
            share = practice.shares[_age(practice, state, column, columns)]
            table[state, column] += share * (origin[state, column] - table[state, column])
