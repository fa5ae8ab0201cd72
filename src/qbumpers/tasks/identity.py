"""What Q* of a task depends on beside the discount, as a digest that values can state."""

import hashlib
import inspect
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces, wrappers

from qbumpers.random_streams import content_digest
from qbumpers.tasks.dynamics import TERMINATED, Dynamics
from qbumpers.tasks.wrapping import altering_wrappers

_DECIMALS = 9  # of probabilities: the same table may have been summed up in another order


def transitions_digest(dynamics: Dynamics) -> str:
    """A SHA-256 of transitions, rewards and ends; of nothing else, in whatever order they stand.

    Args:
        dynamics: of a task with a table.
    """
    outcomes = dynamics.outcomes
    probability = np.diff(dynamics.cumulative.reshape(-1, outcomes), axis=1, prepend=0).ravel()
    pair = np.repeat(np.arange(len(probability) // outcomes), outcomes)
    ends = (dynamics.events & TERMINATED).astype(np.int64)
    order = np.lexsort((dynamics.reward, ends, dynamics.next_state, pair))
    whole = np.stack([pair, dynamics.next_state, ends], axis=1)[order]
    reward = dynamics.reward[order] + 0.0  # + 0.0 turns -0.0 into 0.0
    new = np.ones(len(order), bool)
    new[1:] = (whole[1:] != whole[:-1]).any(axis=1) | (reward[1:] != reward[:-1])
    first = np.flatnonzero(new)
    together = np.round(np.add.reduceat(probability[order], first), _DECIMALS)
    possible = together > 0
    sizes = np.array([dynamics.actions, len(probability) // outcomes])
    parts = (sizes, whole[first][possible], reward[first][possible], together[possible])
    return hashlib.sha256(b"|".join(part.tobytes() for part in parts)).hexdigest()


def environment_digest(environment: Any) -> str:
    """A SHA-256 of what a Gymnasium environment was made from: id, arguments, and wrappers.

    Args:
        environment: with its spec; wrappers that only watch or flatten do not count, nor does
            drawing.

    Returns:
        The digest, equal if an argument is given or left at the same default; empty if it has no
        spec.
    """
    if environment.spec is None:
        return ""
    arguments = dict(environment.spec.kwargs)
    try:
        bound = inspect.signature(type(environment.unwrapped)).bind_partial(**arguments)
    except (TypeError, ValueError):  # made by a function, or by a class that hides its arguments
        pass
    else:
        bound.apply_defaults()
        arguments = dict(bound.arguments)
    arguments.pop("render_mode", None)
    around = [_described(layer) for layer in altering_wrappers(environment)]
    around = [each for each in around if each]
    described = {name: repr(value) for name, value in arguments.items()}
    return content_digest([environment.spec.id, described, around]).hex()


def _described(layer: Any) -> Any:
    """What a wrapper changes, JSON-like; nothing if that does not change what actions are worth."""
    if type(layer) is wrappers.FlattenObservation:
        return None  # the same numbers in a row
    if type(layer) is wrappers.FilterObservation:
        kept: Any = layer.observation_space
        return ["FilterObservation", sorted(kept.spaces)]
    return type(layer).__name__


def task_inside(environment: Any) -> Any:
    """The task that an environment is made from and states as `task`; None if it states none."""
    task = getattr(environment.unwrapped, "task", None)
    return task if callable(getattr(task, "identity", None)) else None


def has_table(environment: Any) -> bool:
    """Whether an environment has a transition table and shows the number of its state."""
    table = getattr(environment.unwrapped, "P", None)
    return isinstance(table, Mapping) and isinstance(environment.observation_space, spaces.Discrete)
