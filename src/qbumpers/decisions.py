"""One decision of an assistant, its record, and the account of an episode.

Every host (the Gymnasium wrapper, the simulators, a session with a person) builds the same
`Situation`, draws the same `Noise`, calls the same rule, keeps the same `Step` and counts returns
by the same functions: `begin`, `situate`, `execution_of`, `step_of`, `settle`.
"""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.choice import best_value
from qbumpers.compilation import compiled, inlined
from qbumpers.errors import RequestError


class Situation(NamedTuple):
    """What the assistant knows at one decision. Read its fields by name: there may be more one day.

    Attributes:
        state: number of the state; the observation, float32 [D], if states are not numbered; None
            if the host can give neither.
        values: float64 [A], Q*(s, .), the assistant's action values. A rule may not change them.
        others: float64 [K, A], the further rows of values that the rule named when it was
            registered; [0, A] if it named none.
        proposed: the action that the learner or participant proposes, in [0, A).
        earned: discounted rewards of this episode so far, sum over i < t of discount**i * r_i.
        discount: the discount of this step, gamma**t.
        start_value: V*(s_0) of this episode, in reward units.
        episode: episodes of this learner or participant before this one.
        step: t, steps of this episode before this one.
    """

    state: Any
    values: np.ndarray
    others: np.ndarray
    proposed: int
    earned: float
    discount: float
    start_value: float
    episode: int
    step: int


class Noise(NamedTuple):
    """What chance contributes to one decision; drawn by the host and recorded for replay.

    Attributes:
        coin: in [0, 1): override or not.
        tie: in [0, 1): which of equally good actions.
    """

    coin: float
    tie: float


class Decision(NamedTuple):
    """What the assistant does.

    Attributes:
        action: the action to execute, in [0, A).
        probability: of overriding the proposed action, before the coin was tossed.
        undo: whether the state is taken back after the action. The action happens, its reward and
            its step count, but no end of the episode does. A compiled rule that undoes gives all
            three fields in every return.
    """

    action: int
    probability: float
    undo: bool = False


def checked_decision(found: Any, assistant: str) -> Decision:
    """What a rule returned, if it is a decision.

    Args:
        found: by a rule that runs as plain Python.
        assistant: its name, for the message.

    Raises:
        RequestError: if it is something else, or not made of numbers.
    """
    numbers, given = (int, float, np.number), found
    if not (
        isinstance(found, Decision)
        and isinstance(given.action, numbers)
        and isinstance(given.probability, numbers)
    ):
        raise RequestError(
            f"assistant {assistant}: its rule returns {found!r}; a Decision is needed, of an "
            "action and a probability"
        )
    return found


class Step(NamedTuple):
    """The record of one assisted step, the same from every host; or, with arrays [N], a table.

    Attributes:
        episode: episodes of this learner or participant before this one.
        state: where the step began, as in `Situation`; of a table of vectors [N, D].
        proposed: the action that the learner or participant proposed.
        executed: the action that the environment received.
        undone: whether the state was taken back to `state` after the action.
        credited: the action that the learner credits with the outcome; -1 if it learns nothing.
        overridden: whether `executed` differs from `proposed`, or the step was undone.
        probability: that the rule gave an override before the coin was tossed, in [0, 1].
        coin: the noise that decided whether to override.
        tie: the noise that chose among equally good actions.
        values: float64 [A], the assistant's action values in `state`; of a table [N, A].
        projected_return: G(s_t, proposed), see `projected_return`.
        reward: what the environment gave for the executed action.
        next_state: where the action led, also if the step was undone.
        events: bits of `qbumpers.tasks.dynamics`; they tell every end of an episode, the step limit
            included.
    """

    episode: Any
    state: Any
    proposed: Any
    executed: Any
    undone: Any
    credited: Any
    overridden: Any
    probability: Any
    coin: Any
    tie: Any
    values: np.ndarray
    projected_return: Any
    reward: Any
    next_state: Any
    events: Any


class Model(NamedTuple):
    """What a rule with memory may know of the task; given once, to its `start`.

    Attributes:
        states: S, numbered states; 0 if observations are vectors.
        observation_size: D, numbers of an observation; 0 if states are numbered.
        actions: A.
        no_op: the action that does nothing; -1 if there is none.
        discount: with which the assistant's values and the account discount, in (0, 1].
        dynamics: transitions of a task with a table, `qbumpers.tasks.dynamics.Dynamics`; else None.
        distance: float64 [A, A] between actions; 0 on the diagonal and 1 elsewhere if the task
            states none.
    """

    states: int
    observation_size: int
    actions: int
    no_op: int
    discount: float
    dynamics: Any
    distance: np.ndarray


class Account(NamedTuple):
    """What an episode has brought so far.

    Attributes:
        earned: as in `Situation`.
        discount: as in `Situation`.
        start_value: as in `Situation`.
        episode: as in `Situation`.
        step: as in `Situation`.
    """

    earned: float
    discount: float
    start_value: float
    episode: int
    step: int


@compiled
def projected_return(earned: float, discount: float, value: float) -> float:
    """Return of the whole episode if the assistant's own policy went on from here.

    G = sum_{i<t} gamma**i r_i + gamma**t Q*(s_t, a), Section 3 of the paper with the discount
    exponents made consistent.

    Args:
        earned: discounted rewards so far, as in `Situation`.
        discount: gamma**t, as in `Situation`.
        value: Q*(s_t, a) of the action in question.

    Returns:
        The projected return, in reward units discounted to the start of the episode.
    """
    return earned + discount * value


@inlined
def begin(values: np.ndarray, episode: int) -> Account:
    """The account of a new episode.

    Args:
        values: float64 [A], Q*(s_0, .).
        episode: episodes of this learner or participant before this one.
    """
    return Account(0.0, 1.0, np.float64(best_value(values)), episode, 0)


@inlined
def situate(
    account: Account, state: Any, values: np.ndarray, others: np.ndarray, proposed: int
) -> Situation:
    """The situation of a decision; `Situation` says what the arguments are."""
    return Situation(
        state, values, others, proposed, account.earned, account.discount, account.start_value,
        account.episode, account.step,
    )  # fmt: skip


@inlined
def settle(account: Account, reward: float, discount: float) -> Account:
    """The account after a step.

    Args:
        account: before it.
        reward: what the environment gave on the step.
        discount: gamma, of the assistant's values.
    """
    return Account(
        account.earned + account.discount * reward,
        account.discount * discount,
        account.start_value,
        account.episode,
        account.step + 1,
    )


class Execution(NamedTuple):
    """What was decided and done on one step; the part of a `Step` that no environment tells.

    Attributes:
        executed: as in `Step`.
        undone: as in `Step`.
        probability: as in `Step`.
    """

    executed: int
    undone: bool
    probability: float


@inlined
def is_action(action: float, actions: int) -> bool:
    """Whether a number is an action: whole, and in [0, `actions`)."""
    return 0 <= action < actions and int(action) == action


@inlined
def proposal_of(action: float, actions: int) -> int:
    """What a learner proposes, if there is such an action.

    Raises:
        RequestError: if it is not a whole number in [0, `actions`).
    """
    if not is_action(action, actions):
        raise RequestError("the learner's action is not a whole number in [0, actions)")
    return int(action)


@inlined
def execution_of(decision: Decision, undone: bool, actions: int) -> Execution:
    """What a decision asks for, if it can be done.

    Args:
        decision: of a rule; its `undo` is not looked at, since compiled code may lack it.
        undone: whether the state is to be taken back.
        actions: A.

    Raises:
        RequestError: if its action is not a whole number in [0, A), or its probability not a number
            in [0, 1].
    """
    if not is_action(decision.action, actions):
        raise RequestError("the rule's action is not a whole number in [0, number of actions)")
    if not 0 <= decision.probability <= 1:
        raise RequestError("the rule's probability of an override does not lie in [0, 1]")
    return Execution(int(decision.action), undone, float(decision.probability))


@inlined
def step_of(
    situation: Situation,
    noise: Noise,
    execution: Execution,
    credited: int,
    reward: float,
    next_state: Any,
    events: int,
) -> Step:
    """The record of a step; `Step` says what the arguments are."""
    overridden = execution.executed != situation.proposed or execution.undone
    return Step(
        situation.episode, situation.state, situation.proposed, execution.executed,
        execution.undone, credited, overridden, execution.probability, noise.coin, noise.tie,
        situation.values,
        projected_return(
            situation.earned, situation.discount, float(situation.values[situation.proposed])
        ),
        reward, next_state, events,
    )  # fmt: skip
