"""Motor noise: what the hand does is not always what was meant.

What the hand did is the proposal, and what the learner credits. (Reddy, Dragan and Levine 2018
simulate laggy and noisy pilots so.)
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import compiled, inlined
from qbumpers.random_streams import draw

Probability = Annotated[float, Field(ge=0, le=1)]


class Motor(NamedTuple):
    """A hand that errs.

    Attributes:
        slip: probability of another action than the one meant, each of the others alike.
        lag: probability that the hand repeats what it did on the step before in this episode.
    """

    slip: Probability = 0.0
    lag: Probability = 0.0


@compiled
def slipped(action: int, actions: int, chance: float) -> int:
    """One of the other actions.

    Args:
        action: the action that was meant, in [0, A).
        actions: A, at least 2.
        chance: in [0, 1), which.
    """
    other = int(chance * (actions - 1))
    return other + 1 if other >= action else other


@inlined
def move(motor: Motor | None, meant: int, last: int, actions: int, stream: np.ndarray) -> int:
    """What the hand does. Numbers are drawn only for what has a probability above 0.

    Args:
        motor: how it errs; None if it never does.
        meant: the action that the learner chose, in [0, A).
        last: what the hand did on the step before; -1 on the first step of an episode.
        actions: A.
        stream: uint64 [4], of the learner; in unassisted probes of the evaluation.

    Returns:
        The action.
    """
    if motor is None:
        return meant
    done = meant
    if motor.slip > 0 and draw(stream) < motor.slip and actions > 1:
        done = slipped(meant, actions, draw(stream))
    if motor.lag > 0 and last >= 0 and draw(stream) < motor.lag:
        done = last
    return done


@compiled
def moved_policy(motor: Motor, policy: np.ndarray, last: int, out: np.ndarray) -> None:
    """Probabilities of what the hand does, from those of what is meant.

    Args:
        motor: how it errs.
        policy: float64 [A], of what is meant.
        last: what the hand did on the step before; -1 on the first step of an episode.
        out: float64 [A], overwritten; may be `policy`.
    """
    actions = len(policy)
    slip = motor.slip if actions > 1 else 0.0
    lag = motor.lag if last >= 0 else 0.0
    for action in range(actions):
        meant = policy[action]
        slips_here = slip * (1 - meant) / (actions - 1) if slip > 0 else 0.0
        out[action] = (1 - lag) * ((1 - slip) * meant + slips_here)
    if last >= 0:
        out[last] += lag
