"""Two-rate adaptation (Smith, Ghazizadeh and Shadmehr 2006), with action values as its states.

A fast process learns and forgets quickly, a slow one does both slowly, and what the learner goes by
is their sum. In the source a movement leaves an error, from which both learn. Here every action in
every state is such a movement, its error is the temporal-difference error, and a trial of it is a
step from which it is learned:

    x(s, a) = x_f(s, a) + x_s(s, a)
    e = r + gamma max_b x(s', b) - x(s, a), without the second term after an end
    x_f(s, a) <- A_f x_f(s, a) + B_f e and x_s(s, a) <- A_s x_s(s, a) + B_s e

The defaults are the constants of the source, fitted to reaches in force fields. Actions that were
not tried keep both states; forgetting between episodes is a layer of its own.

What to expect: after a change, for instance of the keys, the fast process follows at once while the
slow one still holds what was learned before, so what is changed back is learned faster than it was
the first time (savings), and an unlearned response comes back by itself when errors stay away
(spontaneous recovery). Because both processes forget at every trial, a value stops at 75% of what
was to be learned with the constants of the source, and that in each state of a chain of them: the
learner discounts, and looks few steps ahead. The model does not explain savings after a washout
that was long enough to bring both processes back to 0 (Zarahn et al. 2008).
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.q_learning import best_future
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled


class TwoRate(NamedTuple):
    """Action values with a fast and a slow part, which forget and learn at different rates.

    Attributes:
        discount: gamma of the learner's own values, in (0, 1].
        epsilon: probability of a random action, by episode.
        fast_retention: A_f, what the fast part keeps in a trial, in [0, 1].
        fast_learning: B_f, share of the error that it learns, in [0, 1].
        slow_retention: A_s, of the slow part; above that of the fast one.
        slow_learning: B_s, of the slow part; below that of the fast one.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    epsilon: Schedule = Schedule()
    fast_retention: Annotated[float, Field(ge=0, le=1)] = 0.59
    fast_learning: Annotated[float, Field(ge=0, le=1)] = 0.21
    slow_retention: Annotated[float, Field(ge=0, le=1)] = 0.992
    slow_learning: Annotated[float, Field(ge=0, le=1)] = 0.02


class TwoRateMemory(NamedTuple):
    """The memory of a two-rate learner, in reward units.

    Attributes:
        values: float64 [S, A], the sum of both parts.
        width: as in `Shape`.
        fast: float64 [S, A].
        slow: float64 [S, A].
    """

    values: np.ndarray
    width: tuple[int, ...]
    fast: np.ndarray
    slow: np.ndarray


@compiled
def start(settings: TwoRate, shape: Shape, stream: np.ndarray) -> TwoRateMemory:
    """Tables of zeros: nothing was adapted to."""
    size = (shape.states, len(shape.width))
    return TwoRateMemory(np.zeros(size), shape.width, np.zeros(size), np.zeros(size))


@compiled
def begin(settings: TwoRate, memory: TwoRateMemory, episode: int, episodes: int) -> Rates:
    """Exploration of an episode; the rates of learning stay."""
    return Rates(scheduled(settings.epsilon, episode, episodes), 0.0)


@compiled
def learn(
    settings: TwoRate, memory: TwoRateMemory, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Let both parts of the credited action forget a little, and learn from the error."""
    future = best_future(memory, transition, settings.discount)
    values = row(memory.values, transition.state, memory.width)
    fast = row(memory.fast, transition.state, memory.width)
    slow = row(memory.slow, transition.state, memory.width)
    action = transition.action
    error = transition.reward + future - values[action]
    fast[action] = settings.fast_retention * fast[action] + settings.fast_learning * error
    slow[action] = settings.slow_retention * slow[action] + settings.slow_learning * error
    values[action] = fast[action] + slow[action]


register_learner(
    "two-rate", TwoRate, start=start, begin=begin, choose=q_learning.choose,
    prefer=q_learning.prefer, policy=q_learning.policy, learn=learn,
)  # fmt: skip
