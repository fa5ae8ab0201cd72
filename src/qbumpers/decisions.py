"""One decision of an assistant: what it knows, what chance adds, what it does, what is recorded.

Every host, the Gymnasium wrapper as well as the simulator, builds the same `Situation`, draws the
same `Noise`, calls the same rule and keeps the same `Step`.
"""

from typing import NamedTuple

import numpy as np

from qbumpers.compilation import compiled


class Situation(NamedTuple):
    """What the assistant knows at one decision.

    Attributes:
        values: float64 [A], Q*(s, .), the assistant's action values in the current state.
        proposed: the person's action, in [0, A).
        earned: discounted rewards of this episode so far, sum over i < t of discount**i * r_i.
        discount: the discount of this step, gamma**t.
        start_value: V*(s_0) of this episode, in reward units.
    """

    values: np.ndarray
    proposed: int
    earned: float
    discount: float
    start_value: float


class Noise(NamedTuple):
    """What chance contributes to one decision; drawn by the host and recorded for replay.

    Attributes:
        coin: in [0, 1): override or not.
        tie: in [0, 1): which of equally good actions.
    """

    coin: float
    tie: float


class Decision(NamedTuple):
    """What the assistant does.

    Attributes:
        action: the action to execute, in [0, A).
        probability: of overriding the proposed action, before the coin was tossed.
    """

    action: int
    probability: float


class Step(NamedTuple):
    """The record of one assisted step, the same from every host.

    Attributes:
        proposed: the person's action.
        executed: the action that the environment received.
        credited: the action that the learner credits with the outcome; -1 where it learns nothing.
        overridden: whether `executed` differs from `proposed`.
        probability: of an override, before the coin.
        coin: the noise that decided whether to override.
        tie: the noise that chose among equally good actions.
        values: float64 [A], the assistant's action values in the state of the decision.
        projected_return: G(s_t, proposed), see `projected_return`.
        reward: the environment's reward for the executed action.
    """

    proposed: int
    executed: int
    credited: int
    overridden: bool
    probability: float
    coin: float
    tie: float
    values: np.ndarray
    projected_return: float
    reward: float


@compiled
def projected_return(earned: float, discount: float, value: float) -> float:
    """Return of the whole episode if the assistant's own policy went on from here.

    G = sum_{i<t} gamma**i r_i + gamma**t Q*(s_t, a), Section 3 of the paper with the discount
    exponents made consistent.

    Args:
        earned: discounted rewards so far, as in `Situation`.
        discount: gamma**t, as in `Situation`.
        value: Q*(s_t, a) of the action in question.

    Returns:
        The projected return, in reward units discounted to the start of the episode.
    """
    return earned + discount * value
