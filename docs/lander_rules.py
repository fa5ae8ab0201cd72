"""Rules that were tried at Lunar Lander; `run_lander_rules.py` measures them.

They are registered here rather than in the package, since none of them is better than bumpers.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from qbumpers import register_assistant
from qbumpers.assistants.random_override import overridden_with
from qbumpers.assistants.stochastic_q_bumpers import override_probability
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step, projected_return
from qbumpers.learners.double_dqn import DoubleDQN, DQNMemory, learn
from qbumpers.learners.interface import Rates, Transition
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import draw
from qbumpers.registration import as_numbers
from qbumpers.tasks.dynamics import TERMINATED

_P_MAX, _V_MIN = 0.999, 0.0  # as of bumpers
_HIDDEN = 64
_MIRROR = as_numbers(DoubleDQN())  # the settings of the learner itself: the best case of a mirror


@compiled
def bumped(situation: Situation, alpha: float, earned: float, discount: float) -> float:
    """Probability with which bumpers override a worse proposal.

    Args:
        situation: of the decision.
        alpha: of bumpers; it may exceed 1.
        earned: discounted rewards so far, of the situation or as if the episode began here.
        discount: likewise.
    """
    values, start = situation.values, situation.start_value
    room = alpha * (start - _V_MIN)
    if start - projected_return(earned, discount, best_value(values)) >= room:
        return 1.0
    lost = start - projected_return(earned, discount, values[situation.proposed])
    return override_probability(lost, room, _P_MAX, True)


@compiled
def bumpers(situation: Situation, alpha: float) -> float:
    """Probability with which bumpers override a worse proposal."""
    return bumped(situation, alpha, situation.earned, situation.discount)


@compiled
def mended(situation: Situation, noise: Noise, probability: float) -> Decision:
    """Override a worse proposal by a best action, with a probability."""
    return overridden_with(situation, noise, best_value(situation.values), probability)


@compiled
def loss(values: np.ndarray, action: int) -> float:
    """How much less an action is worth than a best one."""
    return best_value(values) - values[action]


class Scheduled(NamedTuple):
    """Bumpers whose alpha rises from `begin` to 1 over episodes, until help ends.

    Attributes:
        begin: alpha of the first episode.
        over: episodes in which it rises.
        until: episodes with help.
    """

    begin: float
    over: int = 1
    until: int = 1_000_000


@register_assistant("scheduled-bumpers", Scheduled)
@compiled
def scheduled_bumpers(situation: Situation, noise: Noise, options: Scheduled) -> Decision:
    """More help, or less, at first."""
    if situation.episode >= options.until:
        return Decision(situation.proposed, 0.0)
    risen = min(situation.episode / options.over, 1.0)
    alpha = options.begin + (1 - options.begin) * risen
    return mended(situation, noise, bumpers(situation, alpha))


class Recent(NamedTuple):
    """An account that forgets.

    Attributes:
        alpha: as of bumpers.
        kept: share of what was lost that still counts a step later.
    """

    alpha: float
    kept: float = 0.98


class Lost(NamedTuple):
    """What was lost of late, in an episode."""

    lost: float
    episode: int


@compiled
def nothing_lost(options: Recent, model: Model) -> Lost:
    """Before the first episode."""
    return Lost(0.0, -1)


@compiled
def lost_more(memory: Lost, step: Step, options: Recent) -> Lost:
    """After a step."""
    before = options.kept * memory.lost if memory.episode == step.episode else 0.0
    return Lost(before + loss(step.values, step.executed), step.episode)


@register_assistant("recent", Recent, start=nothing_lost, observe=lost_more)
@compiled
def recent(situation: Situation, noise: Noise, options: Recent, memory: Lost) -> Decision:
    """Bumpers for which what was lost of late counts most, not what was lost first."""
    before = options.kept * memory.lost if memory.episode == situation.episode else 0.0
    lost = before + loss(situation.values, situation.proposed)
    room = options.alpha * (situation.start_value - _V_MIN)
    return mended(situation, noise, override_probability(lost, room, _P_MAX, True))


class Watchful(NamedTuple):
    """Bumpers that look ahead, too.

    Attributes:
        alpha: as of bumpers, of the whole return and of the return from here on.
    """

    alpha: float


@register_assistant("watchful", Watchful)
@compiled
def watchful(situation: Situation, noise: Noise, options: Watchful) -> Decision:
    """Late in an episode a crash weighs as much as at its start."""
    from_here = bumped(situation, options.alpha, 0.0, 1.0)
    probability = max(bumpers(situation, options.alpha), from_here)
    return mended(situation, noise, probability)


class Governed(NamedTuple):
    """An alpha that follows the overrides.

    Attributes:
        share: of the steps that is to be overridden.
        rate: how fast alpha follows.
    """

    share: float
    rate: float = 0.002


@compiled
def widest(options: Governed, model: Model) -> float:
    """Alpha before the first episode."""
    return 1.0


@compiled
def governed_alpha(alpha: float, step: Step, options: Governed) -> float:
    """Alpha after a step: larger after an override, else smaller."""
    happened = 1.0 if step.overridden else 0.0
    return min(1.0, max(0.05, alpha * math.exp(options.rate * (happened - options.share))))


@register_assistant("governed", Governed, start=widest, observe=governed_alpha)
@compiled
def governed(situation: Situation, noise: Noise, options: Governed, memory: float) -> Decision:
    """Start wide and tighten as the learner needs less help."""
    return mended(situation, noise, bumpers(situation, memory))


class Mirrored(NamedTuple):
    """Help with slips.

    Attributes:
        alpha: of bumpers for what the learner does not think best.
        meant: of bumpers for what it does.
    """

    alpha: float
    meant: float = 1.0


class Mirror(NamedTuple):
    """A learner like the one who is helped.

    Attributes:
        learner: its networks and what it remembers.
        stream: uint64 [4], what it draws.
    """

    learner: DQNMemory
    stream: np.ndarray


@compiled
def blank_mirror(options: Mirrored, model: Model) -> Mirror:
    """Before the first episode: small random weights."""
    inputs, actions, stream = model.observation_size, model.actions, np.ones(4, np.uint64)
    layers = ((_HIDDEN, inputs), (_HIDDEN, _HIDDEN), (actions, _HIDDEN))
    size = 0
    for outputs, below in layers:
        size += outputs * (below + 1)
    parameters = np.zeros(size, np.float32)
    place = 0
    for outputs, below in layers:
        for i in range(place, place + outputs * below):
            parameters[i] = math.sqrt(6 / (outputs + below)) * (2 * draw(stream) - 1)
        place += outputs * (below + 1)
    width = inputs + 2 * _HIDDEN + actions
    learner = DQNMemory(
        Layout((inputs, _HIDDEN, _HIDDEN), actions, 0, False),
        parameters, parameters.copy(), np.zeros(size, np.float32),
        np.zeros((2, size), np.float32),
        np.zeros((_MIRROR.replay_size, 2 * inputs + 3), np.float32), np.zeros(2, np.int64),
        np.zeros(4 * width * _MIRROR.batch_size, np.float32), np.zeros(width, np.float32),
    )  # fmt: skip
    return Mirror(learner, stream)


@compiled
def reflected(memory: Mirror, step: Step, options: Mirrored) -> Mirror:
    """The mirror takes what happened for what the proposal did, and learns."""
    over = step.events & TERMINATED != 0
    seen = Transition(step.state, step.proposed, step.reward, step.next_state, over, -1)
    learn(_MIRROR, memory.learner, seen, Rates(0.0, _MIRROR.learning_rate), memory.stream)
    return memory


@register_assistant("mirrored", Mirrored, start=blank_mirror, observe=reflected)
@compiled
def mirrored(situation: Situation, noise: Noise, options: Mirrored, memory: Mirror) -> Decision:
    """Mend slips more readily than what is meant, which an override would confirm."""
    learner: Any = memory.learner
    believed = values_of(learner.layout, learner.parameters, learner.workspace, situation.state)
    slip = believed[situation.proposed] < best_value(believed)
    return mended(situation, noise, bumpers(situation, options.alpha if slip else options.meant))
