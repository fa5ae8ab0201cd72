"""Tabular tasks from the forms in which they are usually written down."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from qbumpers.errors import RequestError, in_short
from qbumpers.tasks.checking import normalised_rows
from qbumpers.tasks.wrapping import followed_reward, step_limit

Judge = Callable[[int, int, int, float, bool], bool]
"""`(state, action, next_state, reward, terminated) -> bool`."""

Table = Mapping[int, Mapping[int, list[tuple[float, int, float, bool]]]]
"""`table[state][action]`, a list of (probability, next state, reward, terminated)."""


def outcomes_of_arrays(
    transition: ArrayLike,
    reward: ArrayLike,
    terminal: ArrayLike,
    success: ArrayLike | None,
    crash: ArrayLike | None,
) -> dict[str, np.ndarray | None]:
    """The outcomes [S, A, K] of each action; see `TabularTask.from_arrays`."""
    transition = np.asarray(transition, np.float64)
    if transition.ndim != 3 or transition.shape[0] != transition.shape[2]:
        raise RequestError(f"transition has shape {transition.shape}; [S, A, S] is needed")
    transition = normalised_rows("transition", transition)
    states, actions, _ = transition.shape
    outcomes = max(1, int((transition > 0).sum(axis=2).max()))
    # Possible outcomes first: the others' probability is 0 and they are never drawn.
    order = np.argsort(transition == 0, axis=2, kind="stable")[:, :, :outcomes]
    full_reward = np.asarray(reward, np.float64)
    if full_reward.shape == (states, actions):
        full_reward = np.repeat(full_reward[:, :, None], states, axis=2)
    if full_reward.shape != transition.shape:
        raise RequestError(
            f"reward has shape {full_reward.shape}; [S, A] or [S, A, S] of the transition's "
            f"{transition.shape} is needed"
        )
    return {
        "next_state": order,
        "probability": np.take_along_axis(transition, order, 2),
        "reward": np.take_along_axis(full_reward, order, 2),
        "terminated": _state_flags("terminal", terminal, states)[order],
        "success": None if success is None else _state_flags("success", success, states)[order],
        "crash": None if crash is None else _state_flags("crash", crash, states)[order],
    }


def start_distribution(start: ArrayLike, states: int) -> np.ndarray:
    """Distribution of the first state, float64 [S], if it may be given as one state."""
    if np.ndim(start):
        return np.asarray(start, np.float64)
    if start not in range(states):
        raise RequestError(f"start = {start!r}; it must lie in [0, {states})")
    return np.eye(states)[int(np.asarray(start))]


def outcomes_of_table(
    table: Table, success: Judge | None, crash: Judge | None
) -> dict[str, np.ndarray | None]:
    """The outcomes [S, A, K] of each action; see `TabularTask.from_table`."""
    states, actions = len(table), len(table.get(0, ()))
    if any(set(table.get(s, ())) != set(range(actions)) for s in range(states)) or not actions:
        raise RequestError(
            "table must have states 0, 1, ... and in each the same actions 0, 1, ..."
        )
    outcomes = max(len(table[s][a]) for s in range(states) for a in range(actions))
    shape = (states, actions, outcomes)
    probability, next_state = np.zeros(shape), np.zeros(shape, np.int64)
    reward, terminated = np.zeros(shape), np.zeros(shape, np.bool_)
    for s, a in np.ndindex(states, actions):
        for k, row in enumerate(table[s][a]):
            place = s, a, k
            probability[place], next_state[place], reward[place], terminated[place] = row
            if next_state[place] != row[1]:
                raise RequestError(
                    f"table[{s}][{a}]: next state = {row[1]!r}; a whole number is needed"
                )
    if success is None and crash is None:
        events = endings(terminated, reward, probability)
    else:
        judges = {"success": success, "crash": crash}
        events = {name: _judged(table, shape, judge) for name, judge in judges.items()}
    return {
        "next_state": next_state,
        "probability": probability,
        "reward": reward,
        "terminated": terminated,
        **events,
    }


def _judged(table: Table, shape: tuple[int, int, int], judge: Judge | None) -> np.ndarray | None:
    """Which possible outcomes a judge says yes to, bool [S, A, K]."""
    if judge is None:
        return None
    judged = np.zeros(shape, np.bool_)
    for s, a in np.ndindex(*shape[:2]):
        for k, (p, to, r, done) in enumerate(table[s][a]):
            judged[s, a, k] = p > 0 and judge(s, a, to, r, done)
    return judged


def endings(
    terminated: np.ndarray, reward: np.ndarray, probability: np.ndarray
) -> dict[str, np.ndarray | None]:
    """If some ending pays: those that do are successes, and the others crashes.

    Args:
        terminated: bool [S, A, K].
        reward: float [S, A, K].
        probability: float [S, A, K].

    Returns:
        Fields `success` and `crash` of a task; None if no ending pays.
    """
    endings = terminated & (probability > 0)
    paid = endings & (reward > 0)
    # Absorbing states loop on themselves with reward 0; no episode gets there, they do not matter.
    return (
        {"success": paid, "crash": endings & ~paid}
        if paid.any()
        else {"success": None, "crash": None}
    )


class Description(NamedTuple):
    """What is known of a Gymnasium environment with a transition table.

    Attributes:
        table: arguments of `TabularTask.from_table`, states and actions counted from 0.
        first_state: number that the environment gives to state 0.
        first_action: number that the environment gives to action 0.
        reward: what its wrappers make of a reward.
    """

    table: dict[str, Any]
    first_state: int
    first_action: int
    reward: Callable[[float], float]


def description_of(environment: Any, episode_limit: int | None) -> Description:
    """What a task needs of a Gymnasium environment with a transition table.

    Args:
        environment: with any wrappers.
        episode_limit: steps; the environment's own limit if None.

    Raises:
        RequestError: if it has no table or no limit is known, a wrapper cannot be followed, or its
            spaces are not the table's.
    """
    if not isinstance(environment, gymnasium.Env):
        raise RequestError(
            f"environment = {in_short(environment)}; a Gymnasium environment is needed, for "
            "instance of gymnasium.make"
        )
    inner: Any = environment.unwrapped
    name = environment.spec.id if environment.spec else type(inner).__name__
    table = getattr(inner, "P", None)
    start = getattr(inner, "initial_state_distrib", None)
    if table is None or start is None:
        lacks = (
            "no attribute P: a tabular task needs its transition table; give one"
            if table is None
            else "a table of transitions P but no initial_state_distrib: set that attribute to the "
            "probability of each first state, float [S], or give table and start"
        )
        raise RequestError(
            f"environment {name} has {lacks} with TabularTask.from_table or "
            "TabularTask.from_arrays, have it estimated with TabularTask.estimated, or do without "
            "by VectorTask.from_gymnasium"
        )
    reward = followed_reward(environment, name)
    first_state, first_action = _starts(environment, name, table)
    if episode_limit is None:
        episode_limit = step_limit(environment)
    if episode_limit is None:
        raise RequestError(f"environment {name} has no step limit: give episode_limit")
    grid = np.shape(inner.desc) if np.ndim(getattr(inner, "desc", 0)) == 2 else None
    if grid is not None and int(np.prod(grid)) != len(table):
        grid = None
    followed = _followed(table, first_state, first_action, reward)
    return Description(
        {"table": followed, "start": start, "name": name, "episode_limit": episode_limit,
         "grid": grid},
        first_state, first_action, reward,
    )  # fmt: skip


def _starts(environment: Any, name: str, table: Table) -> tuple[int, int]:
    """The first numbers of states and actions; RequestError if the spaces are not the table's."""
    rows = table[min(table)] if table else {}
    shown = (("observation", "states", len(table)), ("action", "actions", len(rows)))
    starts = []
    for kind, counted, size in shown:
        space = getattr(environment, f"{kind}_space")
        if not isinstance(space, spaces.Discrete) or int(space.n) != size:
            raise RequestError(
                f"environment {name}: its {kind} space is {space}; its table has {size} {counted}, "
                f"so Discrete({size}) is needed"
            )
        starts.append(int(space.start))
    return starts[0], starts[1]


def _followed(
    table: Table, first_state: int, first_action: int, reward: Callable[[float], float]
) -> Table:
    """A table with the rewards that wrappers make of its own, its numbers counted from 0."""
    # It may count as the spaces do, or from 0 all the same.
    state = first_state if first_state == min(table) else 0
    action = first_action if first_action == min(table[min(table)]) else 0
    return {
        s - state: {
            a - action: [(p, to - state, reward(float(paid)), end) for p, to, paid, end in rows]
            for a, rows in actions.items()
        }
        for s, actions in table.items()
    }


def _state_flags(name: str, flags: ArrayLike, states: int) -> np.ndarray:
    array = np.asarray(flags, np.bool_)
    if array.shape != (states,):
        raise RequestError(
            f"{name} has shape {array.shape}; one flag per state, [{states}], is needed"
        )
    return array
