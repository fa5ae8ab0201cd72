"""Why no threshold serves on Cliff Walking: Section 4.1 of the paper, computed.

Local Q-Thresholding overrides a suboptimal move exactly if alpha is below a critical value of
the move. The figures show which moves those are.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Noise, Situation
from qbumpers.tasks.cliff_walking import ACTION_NAMES, COLUMNS, GOAL, ROWS, is_cliff, state_of

KINDS = ("onto the cliff", "backwards beside the cliff", "away from the cliff")
"""Suboptimal moves: those that fall; others beside the cliff or at the start; all the rest."""

EXAMPLES = ((2, 6), (1, 6))
"""The positions that Section 4.1 discusses, as (row, column): beside the cliff, and one above."""


class Move(NamedTuple):
    """A suboptimal move.

    Attributes:
        row: row of the cell in which it starts.
        column: column of that cell.
        action: number of the action, in [0, 4).
        kind: index into `KINDS`.
        critical: it is overridden if alpha is below this.
    """

    row: int
    column: int
    action: int
    kind: int
    critical: float


def positions() -> list[tuple[int, int]]:
    """Where a walker can act, as (row, column): everywhere but on the cliff and at the goal."""
    return [
        (row, column)
        for row, column in np.ndindex(ROWS, COLUMNS)
        if not is_cliff(row, column) and (row, column) != GOAL
    ]


def suboptimal_moves(table: np.ndarray) -> list[Move]:
    """Every suboptimal move with its critical threshold.

    Args:
        table: Q*, float64 [S, A].

    Returns:
        The moves, by position; critical = (V - Q(a)) / (V - min Q), from Q' < (1 - alpha) V'.
    """
    moves = []
    for row, column in positions():
        values = table[state_of(row, column)]
        best, worst = values.max(), values.min()
        for action in np.flatnonzero(values < best):
            kind = _kind(row, column, int(action))
            critical = float((best - values[action]) / (best - worst))
            moves.append(Move(row, column, int(action), kind, critical))
    return moves


def _kind(row: int, column: int, action: int) -> int:
    below = ACTION_NAMES[action] == "down" and row == 2 and bool(is_cliff(3, column))
    into = ACTION_NAMES[action] == "right" and row == 3
    if below or into:
        return 0
    return 1 if row == 3 or (row == 2 and bool(is_cliff(3, column))) else 2


def overridden(table: np.ndarray, alpha: float, second: bool = False) -> np.ndarray:
    """What Local Q-Thresholding overrides, by asking its rule.

    Args:
        table: Q*, float64 [S, A].
        alpha: threshold of the rule, in [0, 1].
        second: whether it overrides with the second-best action.

    Returns:
        bool [S, A].
    """
    assistant = make_assistant("local-q-thresholding", alpha=float(alpha), second=second)
    decided, others = np.zeros(table.shape, np.bool_), np.zeros((0, table.shape[1]))
    for state, action in np.ndindex(*table.shape):
        situation = Situation(
            state=state, values=table[state], others=others, proposed=action, earned=0.0,
            discount=1.0, start_value=table[state].max(), episode=0, step=0,
        )  # fmt: skip
        decided[state, action] = assistant.decide(situation, Noise(0.5, 0.5)).action != action
    return decided


def overridden_share(moves: list[Move], kind: int, alphas: np.ndarray) -> np.ndarray:
    """Share of the moves of a kind that are overridden.

    Args:
        moves: from `suboptimal_moves`.
        kind: index into `KINDS`.
        alphas: float64 [N], thresholds.

    Returns:
        float64 [N].
    """
    critical = np.sort([move.critical for move in moves if move.kind == kind])
    return 1 - np.searchsorted(critical, alphas, side="right") / len(critical)


def distinct_thresholds(moves: list[Move]) -> list[float]:
    """The critical values at which the assistant's behaviour changes, falling."""
    return sorted({round(move.critical, 9) for move in moves}, reverse=True)


def distinct_behaviours(table: np.ndarray, alphas: Sequence[float], second: bool) -> int:
    """How many different sets of moves these thresholds override, where a walker can act.

    Args:
        table: Q*, float64 [S, A].
        alphas: thresholds of the rule, each in [0, 1].
        second: whether they override with the second-best action.
    """
    acted = [state_of(row, column) for row, column in positions()]
    return len({overridden(table, alpha, second)[acted].tobytes() for alpha in alphas})


class ThresholdSummary(NamedTuple):
    """The numbers of Section 4.1.

    Attributes:
        examples: suboptimal moves from `EXAMPLES`, as (row, column, name of the action, its Q
            value, the best Q value there, critical threshold).
        thresholds: at which the assistant's behaviour changes, falling.
        alphas: settings that the experiment compares.
        behaviours_best: how many different behaviours they give with best-action overrides.
        behaviours_second: how many with second-best overrides.
    """

    examples: list[tuple[int, int, str, float, float, float]]
    thresholds: list[float]
    alphas: list[float]
    behaviours_best: int
    behaviours_second: int


def summarise_thresholds(table: np.ndarray, alphas: Sequence[float]) -> ThresholdSummary:
    """The numbers of Section 4.1.

    Args:
        table: Q* of Cliff Walking, float64 [48, 4].
        alphas: settings of Local Q-Thresholding to be compared.

    Returns:
        The numbers.
    """
    moves = suboptimal_moves(table)
    examples = []
    for move in moves:
        if (move.row, move.column) in EXAMPLES:
            values = table[state_of(move.row, move.column)]
            name, value = ACTION_NAMES[move.action], float(values[move.action])
            examples.append(
                (move.row, move.column, name, value, float(values.max()), move.critical)
            )
    return ThresholdSummary(
        examples=examples,
        thresholds=distinct_thresholds(moves),
        alphas=list(alphas),
        behaviours_best=distinct_behaviours(table, alphas, second=False),
        behaviours_second=distinct_behaviours(table, alphas, second=True),
    )
