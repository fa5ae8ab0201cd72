"""One step of a learner that observes vectors, compiled.

The environment is Python and the rest compiled: between two of its steps there are two calls, one
that proposes and decides (`act`), one that learns (`take`).
"""

from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants.dispatch import decide, observe, undoes
from qbumpers.borrowing import read_only
from qbumpers.choice import best_value
from qbumpers.compilation import compiled_apart, inlined
from qbumpers.decisions import (
    Account,
    Execution,
    Noise,
    execution_of,
    projected_return,
    proposal_of,
    settle,
    situate,
    step_of,
)
from qbumpers.learners.dispatch import choose, learn, prefer
from qbumpers.learners.motor import move
from qbumpers.learners.perception import believed, noticing, perceive
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import ASSISTANT, EVALUATION, LEARNER, draw
from qbumpers.tasks.dynamics import TERMINATED, finite

EARNED, DISCOUNT, START_VALUE, EPISODE, STEP = range(5)
"""Places in the numbers of an `Account`."""

NOT_FINITE = -1
"""What `preferred` gives after an observation or a reward that is not finite."""


class NetworkAssistance(NamedTuple):
    """The assistant of a learner that observes vectors.

    Attributes:
        layout: sizes of the network of its values.
        parameters: float32 [1 + K, P], of Q* and of the further rows that its rule named.
        workspace: float32, what the network needs for one observation.
        row: float64 [A], filled with Q*(s, .).
        other_rows: float64 [K, A], filled with the further rows.
        discount: gamma of the values, in (0, 1].
    """

    layout: Layout
    parameters: np.ndarray
    workspace: np.ndarray
    row: np.ndarray
    other_rows: np.ndarray
    discount: float


class Pieces(NamedTuple):
    """What the steps of a learner have in common.

    Attributes:
        settings: how the learner learns, as numbers; their type selects the learner.
        memory: what the learner knows, changed in place.
        rates: the learner's exploration and step size in this episode.
        motor: how the learner's hand errs, a `Motor` as numbers; or None.
        perception: as numbers.
        assistance: its rows are filled by `act`.
        numbers: float64 [5], the account of the episode; its start value is filled on the first
            step.
        streams: uint64 [4, 4], of the trial.
    """

    settings: Any
    memory: Any
    rates: Any
    motor: Any
    perception: Any
    assistance: NetworkAssistance
    numbers: np.ndarray
    streams: np.ndarray


class Common(NamedTuple):
    """What `act`, `take` and `preferred` are given if they run as plain Python.

    Attributes:
        content: what compiled code is given held, see `qbumpers.compilation.hold`.
    """

    content: Pieces


class Chosen(NamedTuple):
    """What a learner proposed and what became of it.

    Attributes:
        proposed: as in `Step`, like the rest.
        executed: checked by the host.
        undone: whether the state is to be taken back.
        probability: that the rule gave an override, in [0, 1].
        coin: the noise that decided whether to override.
        tie: the noise that chose among equally good actions.
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
        reward: what the environment gave.
        events: bits of `qbumpers.tasks.dynamics`, as the environment gave them.
        happened: the same for the record: of an undone step without its end, of the last step that
            is allowed with `LIMIT`.
    """

    next_observation: np.ndarray
    reward: float
    events: int
    happened: int


@inlined
def _account(numbers: np.ndarray) -> Account:
    return Account(
        numbers[EARNED], numbers[DISCOUNT], numbers[START_VALUE], int(numbers[EPISODE]),
        int(numbers[STEP]),
    )  # fmt: skip


# Every function that one of these calls in compiled code is linked and optimised once more with it,
# which takes seconds: so they are long, and call few.


@compiled_apart
def act(
    common: Any, options: Any, rule_memory: Any, observation: np.ndarray, last: int, script: Any
) -> tuple[int, int, bool, float, float, float]:
    """The learner proposes an action and the assistant decides.

    Args:
        common: holds `Pieces`.
        options: of the assistant's rule, as numbers; their type selects it. None if no assistant is
            there. (By itself: compilation leaves out what is not there only for arguments.)
        rule_memory: what the assistant's rule remembers; 0 if that is nothing.
        observation: float32 [D].
        last: what the learner proposed on the step before; -1 on the first.
        script: proposed action, coin and tie to be played again; or None.

    Returns:
        The fields of `Chosen`.
    """
    settings, memory, rates, motor, _, assistance, numbers, streams = common.content
    row, other_rows = assistance.row, assistance.other_rows
    observation = read_only(observation)
    actions, others = len(row), len(other_rows)
    for place in range(others + 1):  # in one loop, so that the network is compiled in once
        parameters = assistance.parameters[place]
        values = values_of(assistance.layout, parameters, assistance.workspace, observation)
        for action in range(actions):
            if place == 0:
                row[action] = values[action]
            else:
                other_rows[place - 1, action] = values[action]
    if numbers[STEP] == 0:
        numbers[START_VALUE] = best_value(row)
    if script is None:
        meant = choose(settings, memory, observation, rates, streams[LEARNER])
        done = move(motor, meant, last, actions, streams[LEARNER])
        proposed = proposal_of(done, actions)
        noise = Noise(draw(streams[ASSISTANT]), draw(streams[ASSISTANT]))
    else:
        proposed, noise = script[0], Noise(script[1], script[2])
    if options is None:
        return proposed, proposed, False, 0.0, noise.coin, noise.tie
    situation = situate(
        _account(numbers), observation, read_only(row), read_only(other_rows), proposed
    )
    decision = decide(situation, noise, options, rule_memory)
    executed, undone, probability = execution_of(decision, undoes(decision), actions)
    return proposed, executed, undone, probability, noise.coin, noise.tie


@compiled_apart
def take(
    common: Any, options: Any, rule_memory: Any, observation: np.ndarray, chosen: Any, outcome: Any
) -> tuple[int, float, Any, bool]:
    """The learner learns from a step, and the account and the rule's memory take it in.

    Args:
        common: holds `Pieces`, as `act` left them.
        options: as for `act`.
        rule_memory: what the assistant's rule remembers; 0 if that is nothing.
        observation: float32 [D], where the step began.
        chosen: what `act` returned.
        outcome: what the environment answered, the fields of `Outcome`.

    Returns:
        The action that the learner credits (-1 for none), the projected return of its proposal, the
        rule's memory, and whether reward and observation are finite; if they are not, nothing was
        learned.
    """
    settings, memory, rates, _, perception, assistance, numbers, streams = common.content
    proposed, executed, undone, probability, coin, tie = chosen
    next_observation, reward, events, happened = outcome
    observation, next_observation = read_only(observation), read_only(next_observation)
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
    if options is not None:
        step = step_of(
            situate(
                account, observation, read_only(assistance.row), read_only(assistance.other_rows),
                proposed,
            ),
            Noise(coin, tie), Execution(executed, undone, probability), experience.action, reward,
            next_observation, happened,
        )  # fmt: skip
        rule_memory = observe(rule_memory, step, options)
    if experience.action >= 0:
        transition = believed(experience, observation, next_observation, events & TERMINATED != 0)
        learn(settings, memory, transition, rates, streams[LEARNER])
    account = settle(account, reward, assistance.discount)
    numbers[EARNED] = account.earned
    numbers[DISCOUNT] = account.discount
    numbers[STEP] = account.step
    return experience.action, projected, rule_memory, True


@compiled_apart
def preferred(common: Any, observation: np.ndarray, reward: float, last: int, over: bool) -> int:
    """The learner's greedy action in an unassisted probe.

    Args:
        common: holds `Pieces`.
        observation: float32 [D].
        reward: what came with the observation.
        last: the action before it; -1 at the beginning.
        over: whether the episode has ended; then the action means nothing.

    Returns:
        The action; `NOT_FINITE` if the observation or the reward is not finite.
    """
    settings, memory, _, motor, _, assistance, _, streams = common.content
    if not finite(reward, observation):
        return NOT_FINITE
    if over:
        return 0
    stream = streams[EVALUATION]
    meant = prefer(settings, memory, read_only(observation), draw(stream))
    actions = len(assistance.row)
    return proposal_of(move(motor, meant, last, actions, stream), actions)
