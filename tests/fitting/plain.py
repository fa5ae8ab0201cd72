"""The likelihood of proposals, written a second time in plain Python with dictionaries."""

import itertools
import math

import numpy as np

from qbumpers.decisions import Step
from qbumpers.tasks.dynamics import TERMINATED
from tests.narrowing import present


def greedy_shares(values, epsilon):
    best = [value == max(values) for value in values]
    return [epsilon / len(values) + (1 - epsilon) * each / sum(best) for each in best]


def softmax_shares(values, beta):
    weights = [math.exp(beta * (value - max(values))) for value in values]
    return [weight / sum(weights) for weight in weights]


def perceived(step, perception, noticed):
    """What is credited, the reward that is felt, and whether the state seems to come back."""
    if not step.overridden:
        return step.proposed, step.reward, False
    if not noticed:
        return step.proposed, step.reward, step.undone
    if perception.credits == "nothing":
        return None, step.reward, step.undone
    action = step.executed if perception.credits == "executed" else step.proposed
    felt = step.reward - perception.penalty
    return action, felt, step.undone and perception.credits == "proposed"


def log_likelihoods(
    steps, perception, *, rate, shares, discount=1.0, on_policy=False, noticed=None, lapse=0.0
):
    """Log-probability of each proposal of a learner with constant numbers.

    `shares` gives probabilities from values; `noticed` says so of each overridden step in turn.
    """
    rows, actions = list(rows_of(steps)), np.asarray(steps.values).shape[1]
    noticed = iter(noticed or [])
    values, found, ahead = {}, [], None

    def of(state):
        return values.setdefault(int(state), [0.0] * actions)

    for step, after in itertools.zip_longest(rows, rows[1:]):
        chances = ahead or shares(of(step.state))
        ahead = None
        found.append(math.log((1 - lapse) * chances[step.proposed] + lapse / actions))
        sees = perception.notices == 1
        if step.overridden and 0 < perception.notices < 1:
            sees = next(noticed)
        action, reward, back = perceived(step, perception, sees)
        if action is None:
            continue
        target = step.state if back else step.next_state
        future = 0.0
        if back or not step.events & TERMINATED:
            future = max(of(target))
            if on_policy:
                following = present(after)  # or the next action was not recorded
                assert (following.episode, following.state) == (step.episode, target)
                ahead = shares(of(target))
                future = of(target)[following.proposed]
        old = of(step.state)[action]
        of(step.state)[action] = old + rate * (reward + discount * future - old)
    return found


def rows_of(steps):
    for place in range(len(steps.episode)):
        yield Step(*(column[place] for column in steps))
