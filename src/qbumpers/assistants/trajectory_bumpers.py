"""Bumpers around a path (after virtual fixtures, Abbott, Marayong and Okamura 2007).

A virtual fixture that forbids regions lets a hand move freely near a reference path and resists
where the region ends. The distance of a state from the path is the number of steps in which the
path can be reached again, over transitions that can happen:

    D(s) = 0 on the path,  D(s) = 1 + min {D(s') : p(s' | s, a) > 0 for some a}  elsewhere.

A proposal that may lead to D(s') > reach is replaced by the best action that cannot, or by the best
of all if every action may.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.registry import register_assistant, unchanged
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value, keep_only, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation
from qbumpers.errors import RequestError


class TrajectoryBumpersOptions(NamedTuple):
    """Options of bumpers around a path.

    Attributes:
        path: numbers of the states on it.
        reach: how many steps away from it the learner may be.
    """

    path: Annotated[tuple[Annotated[int, Field(ge=0)], ...], Field(min_length=1)]
    reach: Annotated[int, Field(ge=0)]


@compiled
def _possible(cumulative: np.ndarray, index: int, first: bool) -> bool:
    return cumulative[index] > (0.0 if first else cumulative[index - 1])


@compiled
def steps_to(path: tuple[int, ...], model: Model) -> np.ndarray:
    """D, float64 [S]: steps in which the path can be reached; infinite if it cannot.

    Raises:
        RequestError: if the path has a state that the task has not.
    """
    dynamics, distance = model.dynamics, np.full(model.states, np.inf)
    for state in path:
        if state >= model.states:
            raise RequestError(
                "assistant trajectory-bumpers: path has the state "
                + str(state)
                + "; the task's states lie in [0, "
                + str(model.states)
                + ")"
            )
        distance[state] = 0.0
    width = dynamics.actions * dynamics.outcomes
    changed, found = True, 0.0
    while changed:  # breadth first: in each round the states one step farther away
        changed = False
        for index in range(model.states * width):
            state = index // width
            near = distance[dynamics.next_state[index]] == found
            first = index % dynamics.outcomes == 0
            if near and distance[state] == np.inf and _possible(dynamics.cumulative, index, first):
                distance[state], changed = found + 1, True
        found += 1
    return distance


@compiled
def farthest(options: TrajectoryBumpersOptions, model: Model) -> np.ndarray:
    """How far from the path each action may lead, float64 [S, A]."""
    distance, dynamics = steps_to(options.path, model), model.dynamics
    found = np.zeros((model.states, dynamics.actions))
    for state in range(model.states):
        for action in range(dynamics.actions):
            for outcome in range(dynamics.outcomes):
                index = (state * dynamics.actions + action) * dynamics.outcomes + outcome
                if _possible(dynamics.cumulative, index, outcome == 0):
                    away = distance[dynamics.next_state[index]]
                    found[state, action] = max(found[state, action], away)
    return found


@register_assistant(
    "trajectory-bumpers", TrajectoryBumpersOptions, start=farthest, observe=unchanged,
    needs=("states", "dynamics"),
)  # fmt: skip
@compiled
def trajectory_bumpers(
    situation: Situation, noise: Noise, options: TrajectoryBumpersOptions, memory: np.ndarray
) -> Decision:
    """Override an action that may lead too far from a path, by the best that cannot.

    The path counts, not the return: a better way to the goal is barred if it leads away from the
    path. `stochastic-q-bumpers` never overrides a best action.
    """
    values, proposed = situation.values, situation.proposed
    within, found = scratch(len(values), False), False
    for action in range(len(values)):
        within[action] = memory[situation.state, action] <= options.reach
        found = found or within[action]
    if within[proposed]:
        return Decision(proposed, 0.0)
    allowed = scratch(len(values), 0.0)
    for action in range(len(values)):
        within[action] = within[action] or not found
    keep_only(values, within, allowed)
    best = best_value(allowed)
    if allowed[proposed] >= best:
        return Decision(proposed, 0.0)
    return Decision(pick(allowed, best, noise.tie), 1.0)
