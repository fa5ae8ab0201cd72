"""Q-learning with a softmax choice, perseveration and decay of unchosen actions.

The form that is fitted to choices of people and animals (perseveration: Lau and Glimcher 2005;
decay: Ito and Doya 2009; both in the comparison of Katahira 2015):

    P(a | s) is in proportion to exp(beta Q(s, a) + kappa 1[a = last action in s])
    Q(s, a) <- Q(s, a) + eta (r + gamma max_b Q(s', b) - Q(s, a)) for the credited action
    Q(s, b) <- Q(s, b) + alpha_F (Q_0 - Q(s, b)) for the others in s

The last action in a state is the one that the learner credited there the last time: what it takes
for its own. In a probe the greedy action is taken.

Fitted constants differ from task to task, so the defaults are this package's own: neither
perseveration nor decay, and an inverse temperature for tasks that cost 1 a step. It is per reward
unit: at 1, an action that is worth 1 more is chosen 2.7 times as often, and one that is worth 100
more practically always. If values differ by hundreds, divide by as much: 0.01 is then what 1 is for
values that differ by a few. (For rewards of 0 or 1, fits mostly lie between 1 and 10.)
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.q_learning import best_future, q_update
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled
from qbumpers.learners.softmax import by_weight, normalise, softmax_weights
from qbumpers.random_streams import draw


class SoftmaxQLearner(NamedTuple):
    """Q-learning that chooses by a softmax, perseverates and forgets what it does not choose.

    Attributes:
        discount: gamma of the learner's own values, in (0, 1].
        inverse_temperature: beta, at least 0, per reward unit; 0 chooses at random.
        perseveration: kappa, added for the last action in a state; negative to alternate.
        unchosen_decay: alpha_F, share of the way to the initial value that the other actions of a
            state go when one is learned there, in [0, 1].
        learning_rate: eta, step size, by episode.
        initial_value: Q_0, what every action in every state is worth at first, in reward units.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    inverse_temperature: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 1.0
    perseveration: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    unchosen_decay: Annotated[float, Field(ge=0, le=1)] = 0.0
    learning_rate: Schedule = Schedule()
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class SoftmaxMemory(NamedTuple):
    """The memory of a learner that chooses by a softmax.

    Attributes:
        values: float64 [S, A], its action values.
        width: as in `Shape`.
        last: int64 [S], the action that it credited last in a state; -1 if none.
        workspace: float64 [A], for the weights of a choice.
    """

    values: np.ndarray
    width: tuple[int, ...]
    last: np.ndarray
    workspace: np.ndarray


@compiled
def start(settings: SoftmaxQLearner, shape: Shape, stream: np.ndarray) -> SoftmaxMemory:
    """A table in which every action has the initial value, and no action credited."""
    actions = len(shape.width)
    values = np.full((shape.states, actions), settings.initial_value)
    return SoftmaxMemory(values, shape.width, np.full(shape.states, -1), np.zeros(actions))


@compiled
def begin(settings: SoftmaxQLearner, memory: SoftmaxMemory, episode: int, episodes: int) -> Rates:
    """Step size of an episode."""
    return Rates(0.0, scheduled(settings.learning_rate, episode, episodes))


@compiled
def _weights(
    settings: SoftmaxQLearner, memory: SoftmaxMemory, state: int, out: np.ndarray
) -> float:
    return softmax_weights(
        row(memory.values, state, memory.width), settings.inverse_temperature, memory.last[state],
        settings.perseveration, out,
    )  # fmt: skip


@compiled
def choose(
    settings: SoftmaxQLearner, memory: SoftmaxMemory, state: int, rates: Rates, stream: np.ndarray
) -> int:
    """An action drawn from the softmax."""
    total = _weights(settings, memory, state, memory.workspace)
    return by_weight(memory.workspace, total, len(memory.width), draw(stream))


@compiled
def policy(
    settings: SoftmaxQLearner, memory: SoftmaxMemory, state: int, rates: Rates, out: np.ndarray
) -> None:
    """The probabilities of `choose`."""
    normalise(out, _weights(settings, memory, state, out))


@compiled
def learn(
    settings: SoftmaxQLearner, memory: SoftmaxMemory, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Move the credited action as Q-learning does, and let the others of its state decay."""
    future = best_future(memory, transition, settings.discount)
    values = row(memory.values, transition.state, memory.width)
    for action in range(len(values)):
        if action == transition.action:
            values[action] = q_update(
                values[action], transition.reward, future, rates.learning_rate
            )
        else:
            values[action] += settings.unchosen_decay * (settings.initial_value - values[action])
    memory.last[transition.state] = transition.action


register_learner(
    "softmax-q-learning", SoftmaxQLearner, start=start, begin=begin, choose=choose,
    prefer=q_learning.prefer, policy=policy, learn=learn,
)  # fmt: skip
