"""How good action values are: what they claim against what is achieved.

Q(s, a) claims the discounted return of doing a in s and what the values prefer from then on. The
check does just that: it plays episodes by some policy, a learner's for instance, goes back to
states that they visited, repeats the action that was chosen there and lets the values decide the
rest. Environments follow from their chance and the actions, so going back means playing the same
actions again.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import polars as pl
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from qbumpers.errors import RequestError
from qbumpers.experts.checking import MeanWithError, mean_with_error
from qbumpers.experts.episodes import Episode, Policy, epsilon_greedy, greedy, play, replay_then
from qbumpers.tasks.stepping import Stepper
from qbumpers.tasks.tabular import TabularTask
from qbumpers.tasks.task import Task
from qbumpers.values.exact import reachable_states, solve
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.tabular import QValues, as_values, check_width

BEFORE_CRASH = (1, 2, 3, 5, 10, 20, 40)
"""Steps before a crash that are looked at."""

_NEGLIGIBLE = 0.01  # weight of what a truncation cut off that may be left out


class Quality(NamedTuple):
    """What a check of action values found; errors are standard errors over episodes.

    Attributes:
        start_value: V(s_0), mean over episodes.
        start_return: discounted return of greedy episodes, of those that were not cut off early.
        bias: mean of Q(s, a) minus the return achieved, over states that the policies visited.
        absolute: mean size of that difference.
        crash_value: mean Q of the very action that crashed; None if nothing did.
        crash_return: mean reward that this action brought; None if nothing crashed.
        overestimated: share of values above what was achieved.
    """

    start_value: MeanWithError
    start_return: MeanWithError
    bias: MeanWithError
    absolute: MeanWithError
    crash_value: MeanWithError | None
    crash_return: MeanWithError | None
    overestimated: float


def returns_to_go(rewards: np.ndarray, discount: float, terminated: bool) -> np.ndarray:
    """Discounted return from each step to the end.

    Args:
        rewards: float64 [T].
        discount: in (0, 1].
        terminated: whether the episode ended for good. If it was truncated, returns of which
            more than 1% hangs on what would have followed are unknown; nothing is bootstrapped.

    Returns:
        float64 [T], NaN if unknown.
    """
    returns, total = np.empty(len(rewards)), 0.0
    for step in range(len(rewards) - 1, -1, -1):
        total = rewards[step] + discount * total
        returns[step] = total
    if not terminated:
        left = np.arange(len(rewards), 0, -1)
        returns[discount**left > _NEGLIGIBLE] = np.nan
    return returns


def default_policies(
    task: Task, values: QValues, generator: np.random.Generator
) -> dict[str, Policy]:
    """Policies that leave the expert's path: greedy with several shares of random actions."""
    best = greedy(values, task.actions, generator)
    return {
        f"{epsilon:.0%} random": epsilon_greedy(best, epsilon, task.actions, generator)
        for epsilon in (0.1, 0.3, 1.0)
    }


def check_values(
    task: Task,
    values: QValues,
    *,
    discount: float,
    policies: Mapping[str, Policy] | None = None,
    episodes: int = 20,
    seed: int = 0,
) -> pl.DataFrame:
    """Compare action values with what is achieved, in states that policies visit.

    Args:
        task: what the values are of.
        values: any callable from an observation to a value per action.
        discount: that the values state, in (0, 1].
        policies: that visit states, by name, for instance a learner's; if None, greedy ones with
            10%, 30% and all actions random. "greedy" is always among them.
        episodes: how many each policy plays, at least 2.
        seed: decides chance of the environment and random actions; not negative.

    Returns:
        A row per state and action compared: policy, episode, time (of the step, from 0),
        before_crash (steps until that episode crashed, 1 for the step that did; null if it did
        not), distance (of the observation from the nearest one of greedy episodes, in standard
        deviations of visited observations), at_random (whether the state was picked so), value
        (claimed) and achieved (null if truncation hides it). In each episode four states at random
        and those of `BEFORE_CRASH`, in greedy ones all.

    Raises:
        RequestError: if a number is out of range, or values or observations are wrong.
    """
    if episodes < 2 or seed < 0 or not 0 < discount <= 1:
        raise RequestError(
            f"episodes = {episodes}, seed = {seed}, discount = {discount}; at least 2, 0 and a "
            "number in (0, 1] are needed"
        )
    generator = np.random.default_rng(seed)
    check_fit(values, use_at(task))
    stepper, best = task.make_stepper(), greedy(values, task.actions, generator)
    if policies is None:
        policies = default_policies(task, values, generator)
    rows: list[pl.DataFrame] = []
    path: list[np.ndarray] = []
    for number in range(episodes):
        played = play(task, stepper, best, generator.random())
        every = dict.fromkeys(range(len(played.actions)), True)
        rows.append(_comparisons("greedy", number, played, played, every, values, discount))
        path.append(played.observations)
    for name, policy in policies.items():
        for number in range(episodes):
            visited = play(task, stepper, policy, generator.random())
            for place, at_random in _places(visited, generator).items():
                achieved = branch(task, stepper, visited, place, best)
                chosen = {place: at_random}
                rows.append(_comparisons(name, number, visited, achieved, chosen, values, discount))
    found = pl.concat(rows)
    states = np.stack(found["observation"].to_list())
    distance = _distances(states, np.concatenate(path))
    return found.drop("observation").with_columns(distance=pl.Series(distance))


def branch(task: Task, stepper: Stepper, visited: Episode, place: int, policy: Policy) -> Episode:
    """Play an episode again up to and with step `place`, and go on by another policy."""
    return play(task, stepper, replay_then(visited.actions[: place + 1], policy), visited.chance)


def _places(visited: Episode, generator: np.random.Generator) -> dict[int, bool]:
    """Steps to go back to, and whether they were picked at random."""
    length = len(visited.actions)
    picked = set(generator.integers(length, size=4).tolist())
    late = {length - before for before in BEFORE_CRASH if visited.crash and before <= length}
    return {place: place in picked for place in sorted(picked | late)}


def _comparisons(
    policy: str,
    number: int,
    visited: Episode,
    achieved: Episode,
    places: Mapping[int, bool],
    values: QValues,
    discount: float,
) -> pl.DataFrame:
    """Rows of some steps of an episode."""
    steps, length = np.array(list(places)), len(visited.actions)
    returns = returns_to_go(achieved.rewards, discount, achieved.terminated)[steps]
    claimed = [float(values(visited.observations[s])[visited.actions[s]]) for s in steps]
    before: Any = length - steps if visited.crash else [None] * len(steps)
    return pl.DataFrame(
        {
            "policy": [policy] * len(steps),
            "episode": np.full(len(steps), number),
            "time": steps,
            "before_crash": pl.Series(before, dtype=pl.Int64),
            "at_random": list(places.values()),
            "value": np.array(claimed),
            "achieved": pl.Series(returns, nan_to_null=True),
            "observation": list(visited.observations[steps]),
        }
    )


def _distances(observations: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distance of observations [N, D] to the nearest of a path [M, D], in standard deviations."""
    scale = observations.std(axis=0)
    scale[scale == 0] = 1
    tree: Any = KDTree(path / scale)
    return tree.query(observations / scale)[0]


def summarise(comparisons: pl.DataFrame) -> Quality:
    """The findings of a check in a few numbers.

    Args:
        comparisons: from `check_values`.

    Returns:
        The summary.
    """
    known = comparisons.drop_nulls("achieved").with_columns(
        error=pl.col("value") - pl.col("achieved")
    )
    left = known.filter(pl.col("policy") != "greedy")
    visited, crashed = left.filter("at_random"), left.filter(before_crash=1)
    first = comparisons.filter(policy="greedy", time=0)
    return Quality(
        start_value=mean_with_error(first["value"].to_numpy()),
        start_return=_over_episodes(known.filter(policy="greedy", time=0), "achieved"),
        bias=_over_episodes(visited, "error"),
        absolute=_over_episodes(visited.with_columns(pl.col("error").abs()), "error"),
        crash_value=_over_episodes(crashed, "value") if crashed.height else None,
        crash_return=_over_episodes(crashed, "achieved") if crashed.height else None,
        overestimated=float((visited["error"] > 0).sum()) / visited.height
        if visited.height
        else np.nan,
    )


def _over_episodes(rows: pl.DataFrame, column: str) -> MeanWithError:
    """Mean over episodes, the independent unit, of their own means."""
    means = rows.group_by("policy", "episode").agg(pl.col(column).mean())[column].to_numpy()
    return mean_with_error(means) if len(means) else MeanWithError(np.nan, np.inf)


def bias_by(comparisons: pl.DataFrame, column: str, edges: Sequence[float]) -> pl.DataFrame:
    """Bias of values within bins of another number.

    Args:
        comparisons: from `check_values`.
        column: for instance "distance", "time", "before_crash" or "value".
        edges: float [B + 1], ascending; a bin holds its lower edge but not its upper one.

    Returns:
        A row per bin that is not empty: low, high (its edges), value, achieved, bias and error
        (means over episodes, and the standard error of the bias), episodes.
    """
    known = comparisons.drop_nulls(["achieved", column])
    rows: list[dict[str, Any]] = []
    for low, high in itertools.pairwise(edges):
        inside = known.filter((pl.col(column) >= low) & (pl.col(column) < high))
        if inside.is_empty():
            continue
        with_bias = inside.with_columns(bias=pl.col("value") - pl.col("achieved"))
        bias = _over_episodes(with_bias, "bias")
        rows.append(
            {
                "low": float(low),
                "high": float(high),
                "value": _over_episodes(inside, "value").mean,
                "achieved": _over_episodes(inside, "achieved").mean,
                "bias": bias.mean,
                "error": bias.error,
                "episodes": inside.select("policy", "episode").n_unique(),
            }
        )
    return pl.DataFrame(rows)


def check_table(task: Task, values: QValues | np.ndarray, *, discount: float) -> pl.DataFrame:
    """Action values of a tabular task against the exact solution.

    Args:
        task: what the values are of.
        values: an array [S, A], or any callable from the number of a state to a value per action.
        discount: that the values state, in (0, 1].

    Returns:
        A row per state that an episode can act in and action: state, action, value, exact.

    Raises:
        RequestError: if the task has no table of transitions, values are wrong or the exact ones do
            not exist.
    """
    exact = solve(task, discount).table
    states = np.flatnonzero(reachable_states(cast(TabularTask, task)))
    called = as_values(values, use_at(task))
    claimed = np.stack([check_width(called(int(s)), task.actions, f"in state {s}") for s in states])
    return pl.DataFrame(
        {
            "state": np.repeat(states, task.actions),
            "action": np.tile(np.arange(task.actions), len(states)),
            "value": claimed.ravel(),
            "exact": exact[states].ravel(),
        }
    )
