"""A model-based learner: it counts what actions do, and plans with that.

It keeps how often each action in each state led where, and the mean of its rewards (maximum
likelihood; Sutton and Barto 2018, Sections 8.1 and 8.5), and works out values from them by full
backups, as in adaptive real-time dynamic programming (Barto, Bradtke and Singh 1995):

    Q(s, a) <- mean r(s, a) + gamma sum_s' n(s, a, s') / n(s, a) max_b Q(s', b)

with nothing after an end. After every step it backs up the action that it credited, and then a
fixed number of others that it has tried, in turn, from the latest one that was new to it to the
first (asynchronous value iteration, Sutton and Barto 2018, Section 4.5). An action that was never
tried has the initial value. There is no step size: what one step teaches reaches every state from
which the learner knows a way there.

Of an action in a state it remembers only so many different outcomes; a further one takes the place
of the rarest. If anything is forgotten between episodes, plan and counts fade: later experience
then weighs more, and the plan is made again from what is left.

The defaults of both numbers are this package's own.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.borrowing import row
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.learners import q_learning
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.registry import register_learner
from qbumpers.learners.schedules import Schedule, scheduled

_END, _UNUSED = -1, -2
_TRIED, _NEXT = range(2)  # places in `ModelMemory.counters`


class ModelBased(NamedTuple):
    """Learns what actions lead to, and plans a few backups after every step.

    Attributes:
        discount: gamma of the learner's own values, in (0, 1].
        epsilon: probability of a random action, by episode.
        backups: after each step, beside that of the credited action.
        outcomes: different ones that it remembers of an action in a state.
        initial_value: what every action in every state is worth at first, in reward units.
    """

    discount: Annotated[float, Field(gt=0, le=1)] = 1.0
    epsilon: Schedule = Schedule()
    backups: Annotated[int, Field(ge=0)] = 10
    outcomes: Annotated[int, Field(ge=1)] = 4
    initial_value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class ModelMemory(NamedTuple):
    """The memory of a model-based learner; K is the number of outcomes that it remembers.

    Attributes:
        values: float64 [S, A], what it planned, in reward units.
        width: as in `Shape`.
        trials: float64 [S, A], how often it learned from an action.
        rewards: float64 [S, A], their sums.
        counts: float64 [S, A K], how often each outcome came.
        outcomes: int64 [S, A K], the state of each outcome; -1 for an end, -2 if unused.
        tried: int64 [S A], actions that it has tried, as s A + a, in the order of the first times.
        counters: int64 [2], how many there are, and the place after the next one in turn.
    """

    values: np.ndarray
    width: tuple[int, ...]
    trials: np.ndarray
    rewards: np.ndarray
    counts: np.ndarray
    outcomes: np.ndarray
    tried: np.ndarray
    counters: np.ndarray


@compiled
def start(settings: ModelBased, shape: Shape, stream: np.ndarray) -> ModelMemory:
    """An empty model, and a plan in which every action has the initial value."""
    states, actions = shape.states, len(shape.width)
    size, remembered = (states, actions), (states, actions * settings.outcomes)
    return ModelMemory(
        np.full(size, settings.initial_value), shape.width, np.zeros(size), np.zeros(size),
        np.zeros(remembered), np.full(remembered, _UNUSED), np.zeros(states * actions, np.int64),
        np.zeros(2, np.int64),
    )  # fmt: skip


@compiled
def begin(settings: ModelBased, memory: ModelMemory, episode: int, episodes: int) -> Rates:
    """Exploration of an episode."""
    return Rates(scheduled(settings.epsilon, episode, episodes), 0.0)


@compiled
def _place_of(settings: ModelBased, memory: ModelMemory, state: int, first: int, led: int) -> int:
    """Where an outcome is counted among those from `first` on: its place, a free one, the rarest's.

    Counts in a place that is taken from another outcome begin anew.
    """
    rarest = first
    for place in range(first, first + settings.outcomes):
        if memory.outcomes[state, place] == led:
            return place
        if memory.outcomes[state, place] == _UNUSED:
            memory.outcomes[state, place] = led
            return place
        if memory.counts[state, place] < memory.counts[state, rarest]:
            rarest = place
    memory.outcomes[state, rarest] = led
    memory.counts[state, rarest] = 0.0
    return rarest


@compiled
def _remember(settings: ModelBased, memory: ModelMemory, transition: Transition) -> None:
    state, action = transition.state, transition.action
    first = action * settings.outcomes
    if memory.outcomes[state, first] == _UNUSED:
        memory.tried[memory.counters[_TRIED]] = state * len(memory.width) + action
        memory.counters[_TRIED] += 1
    led = _END if transition.terminated else transition.next_state
    memory.counts[state, _place_of(settings, memory, state, first, led)] += 1.0
    memory.trials[state, action] += 1.0
    memory.rewards[state, action] += transition.reward


@compiled
def _back_up(settings: ModelBased, memory: ModelMemory, state: int, action: int) -> None:
    """Work out an action's value from the model, unless all of it is forgotten."""
    counted, worth = 0.0, 0.0
    first = action * settings.outcomes
    for place in range(first, first + settings.outcomes):
        led, count = memory.outcomes[state, place], memory.counts[state, place]
        if led == _UNUSED:
            break
        counted += count
        if led != _END:
            worth += count * best_value(row(memory.values, led, memory.width))
    if counted > 0:
        mean = memory.rewards[state, action] / memory.trials[state, action]
        memory.values[state, action] = mean + settings.discount * (worth / counted)


@compiled
def learn(
    settings: ModelBased, memory: ModelMemory, transition: Transition, rates: Rates,
    stream: np.ndarray,
) -> None:  # fmt: skip
    """Add a step to the model, and plan."""
    _remember(settings, memory, transition)
    _back_up(settings, memory, transition.state, transition.action)
    tried, actions = memory.counters[_TRIED], len(memory.width)
    for _ in range(min(settings.backups, tried)):
        place = memory.counters[_NEXT] - 1
        if place < 0:
            place = tried - 1
        memory.counters[_NEXT] = place
        pair = int(memory.tried[place])
        _back_up(settings, memory, pair // actions, pair % actions)


register_learner(
    "model-based", ModelBased, start=start, begin=begin, choose=q_learning.choose,
    prefer=q_learning.prefer, policy=q_learning.policy, learn=learn,
)  # fmt: skip
