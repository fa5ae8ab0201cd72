"""Expected SARSA (van Seijen et al. 2009): learns the value of its own exploring policy."""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Rates, Table, Transition
from qbumpers.learners.q_learning import q_update
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule


class ExpectedSarsa(NamedTuple):
    """A tabular learner of expected SARSA; its fields are those of `QLearner`.

    Attributes:
        discount: gamma of the learner's own values, in (0, 1].
        epsilon: probability of a random action, by episode.
        learning_rate: step size, by episode.
        initial_value: what every action in every state is worth at first, in reward units.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    epsilon: Schedule = Schedule()
    learning_rate: Schedule = Schedule()
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


@compiled
def expected_value(values: np.ndarray, epsilon: float) -> float:
    """Mean of the values [A] under the epsilon-greedy policy, in reward units."""
    total = 0.0
    for value in values:
        total += value
    return (1 - epsilon) * best_value(values) + epsilon * total / len(values)


@compiled
def learn(
    settings: ExpectedSarsa, memory: Table, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Move the credited action towards its reward and what the policy expects of where it led."""
    future = 0.0
    if not transition.terminated:
        following = row(memory.values, transition.next_state, memory.width)
        future = settings.discount * expected_value(following, rates.epsilon)
    values = row(memory.values, transition.state, memory.width)
    values[transition.action] = q_update(
        values[transition.action], transition.reward, future, rates.learning_rate
    )


register_learner(
    "expected-sarsa", ExpectedSarsa, start=q_learning.start, begin=q_learning.begin,
    choose=q_learning.choose, prefer=q_learning.prefer, policy=q_learning.policy, learn=learn,
)  # fmt: skip
