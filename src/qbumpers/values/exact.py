"""Exact Q* of a tabular task by dynamic programming."""

# SciPy has no types.
# pyright: basic

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from qbumpers.errors import RequestError, unknown_name
from qbumpers.tasks import TabularTask, Task
from qbumpers.tasks.task import check_task
from qbumpers.values.events import EVENT_ROWS, event_values
from qbumpers.values.hidden import averaged, for_each_goal, learned_with_proposals
from qbumpers.values.others import PER_PROPOSAL, numbered
from qbumpers.values.tabular import DECIMALS, TabularValues


def solve(
    task: Task, discount: float | None = None, *, others: Sequence[str] = ()
) -> TabularValues:
    """Q* of a task, exact up to rounding to nine decimals.

    Policy iteration, each policy evaluated by a linear solve. Undiscounted, it starts from a
    proper policy, one that ends the episode with probability 1, after a check that every state
    that an episode can reach has one; the values are those of the best proper policy. Truncation
    by the step limit plays no part.

    Args:
        task: what is to be solved.
        discount: of the values, in (0, 1]; the task's if None.
        others: further rows that rules ask for: "safety" or "success", see
            `qbumpers.values.events`, which are not discounted; "goals" or "proposals", see
            `qbumpers.values.hidden`.

    Returns:
        The values, with the further ones in `others`. If states look alike to the assistant, these
        are of what it sees, the means over such states: best if the goal were to be known from the
        next step on (Littman, Cassandra and Kaelbling 1995, QMDP). Undiscounted, unreachable states
        without a proper policy have value 0.

    Raises:
        RequestError: if the task has no table of transitions, the discount is out of range, or
            is 1 and a reachable state has no proper policy, values grow without bound, or there are
            no such further rows or none of this task.
    """
    check_task(task)
    if "exact" not in task.value_sources:
        raise RequestError(
            f"task {task.name} has no table of transitions to be solved: its values are learned, "
            "see train_expert"
        )
    for name in others:
        if name not in SOLVED_ROWS:
            raise unknown_name("further values", name, SOLVED_ROWS)
    tabular = cast(TabularTask, task)
    discount = task.discount if discount is None else discount
    if not 0 < discount <= 1:
        raise RequestError(f"discount = {discount!r}; it must lie in (0, 1]")
    further: dict[str, TabularValues] = {}
    for name in others:
        further |= solved_rows(tabular, name, discount)
    return TabularValues(
        table=averaged(tabular, _solved(tabular, discount)),
        discount=discount,
        task=task.name,
        method=f"exact dynamic programming{_of_estimate(tabular)}{_of_states_alike(tabular)}",
        made_for=tabular.identity(),
        others=further,
    )


SOLVED_ROWS = (*EVENT_ROWS, "goals", PER_PROPOSAL)
"""What `solve` can give beside Q*, by the name that a rule asks for."""


def solved_rows(task: TabularTask, name: str, discount: float) -> dict[str, TabularValues]:
    """Further values beside Q*, by the names of their rows.

    Args:
        task: which is solved.
        name: one of `SOLVED_ROWS`.
        discount: of values that are returns, in (0, 1].

    Raises:
        RequestError: if the task announces no such events, or its values do not exist.
    """
    if name in EVENT_ROWS:
        return {name: event_values(task, name)}
    table = _solved(task, discount)
    if name == PER_PROPOSAL:
        rows, how = learned_with_proposals(task, table, discount), "Q-learning with a pilot"
    else:
        rows, how = for_each_goal(task, table), "exact dynamic programming"
    return {
        row: TabularValues(each, discount, task.name, how)
        for row, each in zip(numbered(name, len(rows)), rows, strict=True)
    }


def _solved(task: TabularTask, discount: float) -> np.ndarray:
    """Q* of every state, float64 [S, A]."""
    table = (
        _policy_iteration(task, np.zeros(task.states, np.int64), discount)
        if discount < 1
        else _undiscounted(task)
    )
    return np.round(table, DECIMALS) + 0.0  # + 0.0 turns -0.0 into 0.0


def _of_states_alike(task: TabularTask) -> str:
    return "" if task.seen is None else ", averaged over states that look alike"


def _of_estimate(task: TabularTask) -> str:
    return f" of a table that was {task.estimate.words()}" if task.estimate else ""


def backup(task: TabularTask, state_values: np.ndarray, discount: float) -> np.ndarray:
    """Bellman backup: Q(s, a) = sum_k p_k (r_k + discount (1 - terminated_k) V(s'_k)).

    Args:
        task: whose transitions and rewards are used.
        state_values: V, float64 [S].
        discount: in (0, 1].

    Returns:
        float64 [S, A].
    """
    future = np.where(task.terminated, 0.0, state_values[task.next_state])
    return (task.probability * (task.reward + discount * future)).sum(axis=2)


def _policy_iteration(task: TabularTask, policy: np.ndarray, discount: float) -> np.ndarray:
    states = np.arange(task.states)
    while True:
        table = backup(task, _evaluate(task, policy, discount), discount)
        best = table.max(axis=1)
        kept = table[states, policy] >= best - 1e-12 * np.maximum(1, np.abs(best))
        if kept.all():
            return table
        policy = np.where(kept, policy, table.argmax(axis=1))
        # Improving a proper policy makes one that never ends only if a cycle pays.
        if discount == 1 and not _reaching_the_end(task, _one_hot(policy, task.actions))[0].all():
            raise RequestError(
                f"task {task.name}: reward can be collected for ever, so its undiscounted values "
                "do not exist; give a discount below 1"
            )


def _evaluate(task: TabularTask, policy: np.ndarray, discount: float) -> np.ndarray:
    """V of a policy [S]: (I - discount P) V = r, float64 [S]."""
    import scipy.sparse.linalg  # 4 MB that learners of vector tasks do without
    from scipy import sparse

    states = np.arange(task.states)
    probability = task.probability[states, policy]
    reward = (probability * task.reward[states, policy]).sum(axis=1)
    going_on = np.where(task.terminated[states, policy], 0.0, probability)
    transition = sparse.csr_matrix(
        (
            going_on.ravel(),
            (np.repeat(states, going_on.shape[1]), task.next_state[states, policy].ravel()),
        ),
        shape=(task.states, task.states),
    )
    system = sparse.eye(task.states, format="csc") - discount * transition.tocsc()
    return np.asarray(scipy.sparse.linalg.spsolve(system, reward))


def _undiscounted(task: TabularTask) -> np.ndarray:
    proper = proper_states(task)
    stranded = np.flatnonzero(reachable_states(task) & ~proper)
    if len(stranded):
        raise RequestError(
            f"task {task.name}: from state {stranded[0]} no policy ends the episode with "
            "probability 1, so its undiscounted values do not exist; give a discount below 1"
        )
    # No episode gets to the other states: worth 0, as if they ended it.
    ended = task.terminated | ~proper[task.next_state] | ~proper[:, None, None]
    closed = replace(task, terminated=ended)
    allowed = np.ones((task.states, task.actions), np.bool_)
    policy = _reaching_the_end(closed, allowed)[1]
    return np.where(proper[:, None], _policy_iteration(closed, policy, 1.0), 0.0)


def _reaching_the_end(task: TabularTask, allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States that can reach the end by allowed actions [S, A], and for each an action nearer it."""
    possible = (task.probability > 0) & allowed[:, :, None]
    ends = np.zeros(task.states, np.bool_)
    policy = np.zeros(task.states, np.int64)
    while True:
        leads = np.any(possible & (task.terminated | ends[task.next_state]), axis=2)
        fresh = np.any(leads, axis=1) & ~ends
        if not fresh.any():
            return ends, policy
        policy[fresh] = leads.argmax(axis=1)[fresh]
        ends |= fresh


def _one_hot(policy: np.ndarray, actions: int) -> np.ndarray:
    return policy[:, None] == np.arange(actions)


def reachable_states(task: TabularTask) -> np.ndarray:
    """States that an episode can act in, bool [S]."""
    possible = (task.probability > 0) & ~task.terminated
    reached = np.asarray(task.start) > 0
    while True:
        fresh = reached.copy()
        fresh[task.next_state[possible & reached[:, None, None]]] = True
        if (fresh == reached).all():
            return reached
        reached = fresh


def proper_states(task: TabularTask) -> np.ndarray:
    """States from which some policy ends the episode with probability 1, bool [S].

    The greatest set within which every state can be kept while the end stays possible (the
    almost-sure reachability of de Alfaro 1999).
    """
    possible = task.probability > 0
    inside = np.ones(task.states, np.bool_)
    while True:
        # Actions that cannot leave the set, then the states that reach the end through them.
        stays = (task.terminated | inside[task.next_state] | ~possible).all(axis=2)
        ends = np.zeros(task.states, np.bool_)
        while True:
            leads = possible & (task.terminated | ends[task.next_state])
            fresh = np.any(stays & leads.any(axis=2), axis=1) & inside
            if (fresh == ends).all():
                break
            ends = fresh
        if (ends == inside).all():
            return inside
        inside = ends
