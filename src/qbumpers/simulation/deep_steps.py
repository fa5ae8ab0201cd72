"""One step of a learner that observes vectors, compiled.

The environment is Python and the rest compiled: between two of its steps there are two calls, one
that proposes and decides (`act`), one that learns (`take`).
"""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants.dispatch import decide, observe, undoes
from qbumpers.choice import best_value
from qbumpers.compilation import compiled_apart, inlined
from qbumpers.decisions import (
    Account,
    Execution,
    Noise,
    Step,
    projected_return,
    settle,
    situate,
    step_of,
)
from qbumpers.learners.dispatch import choose, learn, prefer
from qbumpers.learners.motor import move
from qbumpers.learners.perception import believed, noticing, perceive
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import ASSISTANT, LEARNER, draw
from qbumpers.tasks.dynamics import TERMINATED, finite

EARNED, DISCOUNT, START_VALUE, EPISODE, STEP = range(5)
"""Places in the numbers of an `Account`."""

NOT_FINITE = -1
"""What `preferred` gives after an observation or a reward that is not finite."""


class NetworkAssistance(NamedTuple):
    """The assistant of a learner that observes vectors.

    Attributes:
        layout: of the network of its values.
        parameters: float32 [P], of Q*.
        others: float32 [K, P], of the further rows that its rule named.
        workspace: float32, of the network.
        row: float64 [A], filled with Q*(s, .).
        other_rows: float64 [K, A], filled with the further rows.
        discount: of the values.
        options: of its rule, as numbers; their type selects it. None if it is not there.
    """

    layout: Layout
    parameters: np.ndarray
    others: np.ndarray
    workspace: np.ndarray
    row: np.ndarray
    other_rows: np.ndarray
    discount: float
    options: Any


class Chosen(NamedTuple):
    """What a learner proposed and what became of it.

    Attributes:
        proposed: as in `Step`, like the rest.
        executed: checked by the host.
        undone: whether the state is to be taken back.
        probability: of an override.
        coin: of the noise.
        tie: of the noise.
    """

    proposed: int
    executed: int
    undone: bool
    probability: float
    coin: float
    tie: float


class Outcome(NamedTuple):
    """What the environment answered.

    Attributes:
        next_observation: float32 [D].
        reward: of the step.
        events: bits of `qbumpers.tasks.dynamics`, as the environment told them.
        happened: the same for the record: of an undone step without its end, of the last step that
            is allowed with `LIMIT`.
    """

    next_observation: np.ndarray
    reward: float
    events: int
    happened: int


@inlined
def _fill(assistance: NetworkAssistance, observation: np.ndarray) -> None:
    """Write the assistant's values of an observation into its rows."""
    layout, workspace = assistance.layout, assistance.workspace
    values = values_of(layout, assistance.parameters, workspace, observation)
    for action in range(len(assistance.row)):
        assistance.row[action] = values[action]
    for place in range(len(assistance.other_rows)):
        values = values_of(layout, assistance.others[place], workspace, observation)
        for action in range(len(assistance.row)):
            assistance.other_rows[place, action] = values[action]


@inlined
def _account(numbers: np.ndarray) -> Account:
    return Account(
        numbers[EARNED], numbers[DISCOUNT], numbers[START_VALUE], int(numbers[EPISODE]),
        int(numbers[STEP]),
    )  # fmt: skip


@inlined
def _decided(options: Any, memory: Any, situation: Any, noise: Noise) -> Chosen:
    """What the assistant decides; the proposal if it is not there."""
    if options is None:
        return Chosen(situation.proposed, situation.proposed, False, 0.0, noise.coin, noise.tie)
    decision = decide(situation, noise, options, memory)
    return Chosen(
        situation.proposed, int(decision.action), undoes(decision), float(decision.probability),
        noise.coin, noise.tie,
    )  # fmt: skip


@inlined
def _observed(options: Any, memory: Any, step: Step) -> Any:
    """The rule's memory after a step; unchanged if the assistant is not there."""
    if options is None:
        return memory
    return observe(memory, step, options)


@inlined
def _proposed(
    script: Any, settings: Any, memory: Any, rates: Any, motor: Any, observation: np.ndarray,
    last: int, actions: int, streams: np.ndarray,
) -> tuple[int, Noise]:  # fmt: skip
    """What the learner proposes, and the assistant's noise; or what a script says."""
    if script is None:
        meant = choose(settings, memory, observation, rates, streams[LEARNER])
        proposed = move(motor, meant, last, actions, streams[LEARNER])
        return proposed, Noise(draw(streams[ASSISTANT]), draw(streams[ASSISTANT]))
    return script[0], Noise(script[1], script[2])


@compiled_apart
def act(
    settings: Any, memory: Any, rates: Any, motor: Any, assistance: NetworkAssistance,
    rule_memory: Any, observation: np.ndarray, numbers: np.ndarray, last: int, streams: np.ndarray,
    script: Any,
) -> tuple[int, int, bool, float, float, float]:  # fmt: skip
    """The learner proposes an action and the assistant decides.

    Args:
        settings: of the learner, as numbers.
        memory: of the learner.
        rates: of the learner in this episode.
        motor: how the learner's hand errs; or None.
        assistance: its rows are filled.
        rule_memory: of the assistant's rule.
        observation: float32 [D].
        numbers: float64 [5], the account of the episode; its start value is filled on the first
            step.
        last: what the learner proposed on the step before; -1 on the first.
        streams: uint64 [4, 4], of the trial.
        script: proposed action, coin and tie to be played again; or None.

    Returns:
        The fields of `Chosen`.
    """
    _fill(assistance, observation)
    if numbers[STEP] == 0:
        numbers[START_VALUE] = best_value(assistance.row)
    actions = len(assistance.row)
    proposed, noise = _proposed(
        script, settings, memory, rates, motor, observation, last, actions, streams
    )
    situation = situate(
        _account(numbers), observation, assistance.row, assistance.other_rows, proposed
    )
    chosen = _decided(assistance.options, rule_memory, situation, noise)
    return (
        chosen.proposed, chosen.executed, chosen.undone, chosen.probability, chosen.coin, chosen.tie
    )  # fmt: skip


@compiled_apart
def take(
    settings: Any, memory: Any, rates: Any, perception: Any, assistance: NetworkAssistance,
    rule_memory: Any, observation: np.ndarray, chosen: Any, outcome: Any, numbers: np.ndarray,
    streams: np.ndarray,
) -> tuple[int, float, Any, bool]:  # fmt: skip
    """The learner learns from a step, and the account and the rule's memory take it in.

    Args:
        settings: of the learner, as numbers.
        memory: of the learner.
        rates: of the learner in this episode.
        perception: as numbers.
        assistance: as `act` left it.
        rule_memory: of the assistant's rule.
        observation: float32 [D], where the step began.
        chosen: what `act` returned.
        outcome: the fields of `Outcome`.
        numbers: float64 [5], the account of the episode.
        streams: uint64 [4, 4], of the trial.

    Returns:
        The action that the learner credits (-1 for none), the projected return of its proposal, the
        rule's memory, and whether reward and observation are finite; if they are not, nothing was
        learned.
    """
    proposed, executed, undone, probability, coin, tie = chosen
    next_observation, reward, events, happened = outcome
    account = _account(numbers)
    overridden = executed != proposed or undone
    experience = perceive(
        perception, proposed, executed, undone, reward,
        noticing(perception, overridden, streams[LEARNER]),
    )  # fmt: skip
    value = float(assistance.row[proposed])
    projected = projected_return(account.earned, account.discount, value)
    if not finite(reward, next_observation):
        return experience.action, projected, rule_memory, False
    step = step_of(
        situate(account, observation, assistance.row, assistance.other_rows, proposed),
        Noise(coin, tie), Execution(executed, undone, probability), experience.action, reward,
        next_observation, happened,
    )  # fmt: skip
    rule_memory = _observed(assistance.options, rule_memory, step)
    if experience.action >= 0:
        transition = believed(experience, observation, next_observation, events & TERMINATED != 0)
        learn(settings, memory, transition, rates, streams[LEARNER])
    account = settle(account, reward, assistance.discount)
    numbers[EARNED] = account.earned
    numbers[DISCOUNT] = account.discount
    numbers[STEP] = account.step
    return experience.action, projected, rule_memory, True


@compiled_apart
def preferred(
    settings: Any, memory: Any, motor: Any, observation: np.ndarray, reward: float,
    last: int, actions: int, over: bool, stream: np.ndarray,
) -> int:  # fmt: skip
    """The learner's greedy action in an unassisted probe.

    Args:
        settings: of the learner, as numbers.
        memory: of the learner.
        motor: how the learner's hand errs; or None.
        observation: float32 [D].
        reward: that came with it.
        last: the action before it; -1 at the beginning.
        actions: A.
        over: whether the episode has ended; then the action means nothing.
        stream: uint64 [4], of the evaluation.

    Returns:
        The action; `NOT_FINITE` if the observation or the reward is not finite.
    """
    if not finite(reward, observation):
        return NOT_FINITE
    if over:
        return 0
    meant = prefer(settings, memory, observation, draw(stream))
    return move(motor, meant, last, actions, stream)
