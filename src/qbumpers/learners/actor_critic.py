"""One-step actor-critic with a table (Sutton and Barto 2018, Section 13.5).

The actor chooses by a softmax of preferences h, the critic says what a state is worth. After a step

    delta = r + gamma v(s') - v(s), with v(s') = 0 after an end
    v(s) <- v(s) + alpha_v delta
    h(s, b) <- h(s, b) + alpha_h I delta (1[b = a] - pi(b | s)) for every action b
    I <- gamma I, which is 1 when an episode begins

where pi is what the actor would have done before the step. If what the learner credits is not what
it chose, for instance because an override was noticed, a is the credited action all the same: the
actor then learns from a step that its policy did not take. A step from which nothing is learned
leaves I as it was. In a probe an action of the largest preference is taken.

The source gives no constants; the defaults are this package's own, small because delta is in reward
units: where returns are in the hundreds, a larger step of the actor ends all exploration at once.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.compilation import compiled
from qbumpers.learners.epsilon_greedy import greedy
from qbumpers.learners.interface import Shape, Transition
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled
from qbumpers.learners.softmax import by_weight, normalise, softmax_weights
from qbumpers.random_streams import draw


class ActorCritic(NamedTuple):
    """An actor-critic: prefers what turned out better than its critic had expected.

    Attributes:
        discount: gamma of the critic's values, in (0, 1].
        actor_rate: alpha_h, step size of the preferences, by episode.
        critic_rate: alpha_v, step size of the critic, by episode.
        initial_value: what every state is worth to the critic at first, in reward units.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    actor_rate: Schedule = Schedule(0.05, 0.05, 0.0)
    critic_rate: Schedule = Schedule(0.2, 0.2, 0.0)
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class ActorCriticMemory(NamedTuple):
    """The memory of an actor-critic.

    Attributes:
        preferences: float64 [S, A], h of the actor.
        width: as in `Shape`.
        critic: float64 [S, 1], v of the critic, in reward units.
        weight: float64 [1], I, discounts of the episode so far.
        workspace: float64 [A], for the weights of a choice.
    """

    preferences: np.ndarray
    width: tuple[int, ...]
    critic: np.ndarray
    weight: np.ndarray
    workspace: np.ndarray


class ActorCriticRates(NamedTuple):
    """The numbers of one episode.

    Attributes:
        actor: alpha_h.
        critic: alpha_v.
    """

    actor: float
    critic: float


@compiled
def start(settings: ActorCritic, shape: Shape, stream: np.ndarray) -> ActorCriticMemory:
    """No preference, and a critic to whom every state has the initial value."""
    actions = len(shape.width)
    return ActorCriticMemory(
        np.zeros((shape.states, actions)), shape.width,
        np.full((shape.states, 1), settings.initial_value), np.ones(1), np.zeros(actions),
    )  # fmt: skip


@compiled
def begin(
    settings: ActorCritic, memory: ActorCriticMemory, episode: int, episodes: int
) -> ActorCriticRates:
    """Step sizes of an episode, of which nothing is discounted yet."""
    memory.weight[0] = 1.0
    return ActorCriticRates(
        scheduled(settings.actor_rate, episode, episodes),
        scheduled(settings.critic_rate, episode, episodes),
    )


@compiled
def _weights(memory: ActorCriticMemory, state: int, out: np.ndarray) -> float:
    return softmax_weights(row(memory.preferences, state, memory.width), 1.0, -1, 0.0, out)


@compiled
def choose(
    settings: ActorCritic, memory: ActorCriticMemory, state: int, rates: ActorCriticRates,
    stream: np.ndarray,
) -> int:  # fmt: skip
    """An action drawn from the softmax of the preferences."""
    total = _weights(memory, state, memory.workspace)
    return by_weight(memory.workspace, total, len(memory.width), draw(stream))


@compiled
def policy(
    settings: ActorCritic, memory: ActorCriticMemory, state: int, rates: ActorCriticRates,
    out: np.ndarray,
) -> None:  # fmt: skip
    """The probabilities of `choose`."""
    normalise(out, _weights(memory, state, out))


@compiled
def prefer(settings: ActorCritic, memory: ActorCriticMemory, state: int, tie: float) -> int:
    """An action of the largest preference."""
    return greedy(row(memory.preferences, state, memory.width), tie)


@compiled
def learn(
    settings: ActorCritic, memory: ActorCriticMemory, transition: Transition,
    rates: ActorCriticRates, stream: np.ndarray,
) -> None:  # fmt: skip
    """Move the critic towards what happened, and the preferences by how much better that was."""
    future = 0.0
    if not transition.terminated:
        future = settings.discount * memory.critic[transition.next_state, 0]
    error = transition.reward + future - memory.critic[transition.state, 0]
    memory.critic[transition.state, 0] += rates.critic * error
    step = rates.actor * memory.weight[0] * error
    total = _weights(memory, transition.state, memory.workspace)
    preferences = row(memory.preferences, transition.state, memory.width)
    for action in range(len(preferences)):
        credited = 1.0 if action == transition.action else 0.0
        preferences[action] += step * (credited - memory.workspace[action] / total)
    memory.weight[0] *= settings.discount


register_learner(
    "actor-critic", ActorCritic, start=start, begin=begin, choose=choose, prefer=prefer,
    policy=policy, learn=learn,
)  # fmt: skip
