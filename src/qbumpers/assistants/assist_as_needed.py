"""Assistance as needed, with forgetting (Emken, Benitez and Reinkensmeyer 2007).

A robot's strength follows the error of each trial and decays on its own, so that no more help
remains than is needed:

    R <- f R + g e,   0 <= f < 1.

A trial is an episode here, and its error e the share of what may be lost that it lost, beyond a
dead band of variation that is natural: e = max(0, (V*(s_0) - return) / (V*(s_0) - v_min) - band).
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.random_override import overridden_with
from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.stochastic_q_bumpers import check_floor
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Account, Decision, Model, Noise, Situation, Step, begin, settle
from qbumpers.tasks.dynamics import ENDS


class AssistAsNeededOptions(NamedTuple):
    """Options of assistance as needed.

    Attributes:
        forgetting: f, share of the strength that is left after an episode without error.
        gain: g, strength for an episode that lost all that may be lost.
        dead_band: share of what may be lost below which a loss is no error.
        v_min: a lower bound on the return of an episode, below V*(s_0).
    """

    forgetting: Annotated[float, Field(ge=0, lt=1)]
    gain: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    dead_band: Annotated[float, Field(ge=0, lt=1)] = 0.0
    v_min: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class Strength(NamedTuple):
    """What assistance as needed remembers.

    Attributes:
        strength: R, in [0, 1].
        account: of the episode so far.
        discount: gamma, of the assistant's values.
    """

    strength: float
    account: Account
    discount: float


@compiled
def no_strength(options: AssistAsNeededOptions, model: Model) -> Strength:
    """The memory before the first episode, which is unassisted: no error has been seen."""
    return Strength(0.0, Account(0.0, 1.0, 0.0, -1, 0), model.discount)


@compiled
def adapted(memory: Strength, step: Step, options: AssistAsNeededOptions) -> Strength:
    """The memory after a step; the strength changes if the episode ended with it."""
    account = memory.account
    if step.episode != account.episode:
        account = begin(step.values, step.episode)
    account = settle(account, step.reward, memory.discount)
    strength = memory.strength
    if step.events & ENDS:
        lost = (account.start_value - account.earned) / (account.start_value - options.v_min)
        error = max(0.0, lost - options.dead_band)
        strength = min(1.0, options.forgetting * strength + options.gain * error)
    return Strength(strength, account, memory.discount)


@register_assistant(
    "assist-as-needed", AssistAsNeededOptions, start=no_strength, observe=adapted,
    check_start=check_floor,
)  # fmt: skip
@compiled
def assist_as_needed(
    situation: Situation, noise: Noise, options: AssistAsNeededOptions, memory: Strength
) -> Decision:
    """Override worse proposals with a probability that follows past errors and decays.

    After a good episode even a fall is not stopped, after bad ones trifles are mended;
    `stochastic-q-bumpers` begins every episode as if there had been none before.
    """
    return overridden_with(situation, noise, best_value(situation.values), memory.strength)
