"""One step of a person who sees vectors and learns by Double DQN, compiled.

The environment is Python and the rest compiled: between two of its steps there are two calls, one
that chooses and decides (`act`), one that learns (`take`). NamedTuples cost microseconds where
compiled code is entered, so they go in as plain tuples.
"""

import numpy as np

from qbumpers.assistants.dispatch import decide, observe
from qbumpers.choice import best_value
from qbumpers.compilation import compiled_apart
from qbumpers.decisions import Noise, Situation, Step, projected_return
from qbumpers.learners.double_dqn import Brain, Rates, learn, remember
from qbumpers.learners.perception import Perception, perceive
from qbumpers.learners.q_learning import choose, choose_greedily
from qbumpers.networks.network import Layout, values_of
from qbumpers.random_streams import ASSISTANT, LEARNER, draw
from qbumpers.tasks.dynamics import TERMINATED, finite

EARNED, DISCOUNT, START_VALUE = range(3)
"""Places in the account of an episode."""


@compiled_apart
def act(
    learner, expert, observation, known, streams, epsilon, helped, options, memory, account, script
):  # fmt: skip
    """The learner proposes an action and the assistant decides.

    Args:
        learner: layout, parameters and room of its network, as plain tuples and arrays.
        expert: the same of the assistant's values.
        observation: float32 [D].
        known: float64 [A], filled with the assistant's values.
        streams: uint64 [4, 4], of the trial.
        epsilon: of the learner.
        helped: whether there is an assistant in this episode.
        options: of the assistant; their type selects its rule.
        memory: of the rule.
        account: float64 [3], see `EARNED`; a start value that is NaN is filled.
        script: proposed action, coin and tie to be played again; or None.

    Returns:
        Proposed and executed action, probability, coin and tie.
    """
    values = values_of(expert, observation)
    for action in range(len(known)):
        known[action] = values[action]
    if np.isnan(account[START_VALUE]):
        account[START_VALUE] = best_value(known)
    if script is not None:
        proposed, noise = script[0], Noise(script[1], script[2])
    else:
        proposed = choose(
            values_of(learner, observation), epsilon, draw(streams[LEARNER]), draw(streams[LEARNER])
        )
        noise = Noise(draw(streams[ASSISTANT]), draw(streams[ASSISTANT]))
    if not helped:
        return proposed, proposed, 0.0, noise.coin, noise.tie
    situation = Situation(known, proposed, account[EARNED], account[DISCOUNT], account[START_VALUE])
    decision = decide(situation, noise, options, memory)
    return proposed, int(decision.action), float(decision.probability), noise.coin, noise.tie


@compiled_apart
def prefer(learner, observation, stream):
    """The learner's greedy action."""
    return choose_greedily(values_of(learner, observation), draw(stream))


@compiled_apart
def take(
    learner, brain, numbers, penalty, perception, observation, following, chosen, reward, event,
    streams, known, options, memory, account, gamma,
):  # fmt: skip
    """The learner learns from a step, and the account and the rule's memory take it in.

    Args:
        learner: as for `act`.
        brain: `Brain`, as a plain tuple.
        numbers: `Rates` of the learner, as a plain tuple.
        penalty: that it feels, in reward units.
        perception: `Perception`, as a plain tuple.
        observation: float32 [D], where the step began.
        following: float32 [D], where it led.
        chosen: what `act` returned.
        reward: of the step.
        event: bits of `qbumpers.tasks.dynamics`.
        streams: uint64 [4, 4], of the trial.
        known: float64 [A], as `act` left it.
        options: of the assistant where it helped, else None.
        memory: of the rule.
        account: float64 [3], see `EARNED`.
        gamma: discount of the assistant's values.

    Returns:
        The action that the learner credits (-1 for none), the projected return of its own, the
        rule's memory, and whether reward and observation are finite; where they are not, nothing
        was learned.
    """
    proposed, executed, probability, coin, tie = chosen
    sound = finite(reward, following)
    projected = projected_return(account[EARNED], account[DISCOUNT], known[proposed])
    experience = perceive(Perception(*perception), proposed, executed, reward, penalty)
    if not sound:
        return experience.action, projected, memory, False
    if options is not None:
        step = Step(
            proposed, executed, experience.action, executed != proposed, probability, coin, tie,
            known, projected, reward,
        )  # fmt: skip
        memory = observe(memory, step, options)
    if experience.action >= 0:
        remember(
            Brain(*brain), observation, experience.action, experience.reward, following,
            event & TERMINATED != 0,
        )  # fmt: skip
        learn(Layout(*learner[0]), Brain(*brain), Rates(*numbers), streams[LEARNER])
    account[EARNED] += account[DISCOUNT] * reward
    account[DISCOUNT] *= gamma
    return experience.action, projected, memory, True
