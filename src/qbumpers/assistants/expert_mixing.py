"""A mixture of expert and learner whose share falls from episode to episode (DAgger).

Ross, Gordon and Bagnell (2011) collect the data of iteration i with the policy
pi_i = beta_i pi* + (1 - beta_i) pi_hat_i, and name beta_i = p**(i - 1) as one that falls fast
enough. Here the episodes are the iterations, beta = share * decay**episode, counted from 0.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.random_override import overridden_with
from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class ExpertMixingOptions(NamedTuple):
    """Options of mixing.

    Attributes:
        share: of the steps of the first episode that the expert decides.
        decay: factor by which the share falls with each episode; 1 keeps it.
    """

    share: Annotated[float, Field(ge=0, le=1)] = 1.0
    decay: Annotated[float, Field(ge=0, le=1)] = 0.9


@register_assistant("expert-mixing", ExpertMixingOptions)
@compiled
def expert_mixing(situation: Situation, noise: Noise, options: ExpertMixingOptions) -> Decision:
    """Let the expert act with a probability that falls from episode to episode.

    The first episodes are the expert's, trifles included, and in late ones even a fall off the
    cliff happens; `stochastic-q-bumpers` lets trifles pass and stops falls, in any episode.
    """
    beta = options.share * options.decay**situation.episode
    return overridden_with(situation, noise, best_value(situation.values), beta)
