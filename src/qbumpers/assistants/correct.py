"""Correcting mistakes (Ho, Littman and Austerweil 2017).

At a mistake, V*(s) - Q*(s, a^h) > tolerance, the learner is put where the right action leads: a
best action is executed. At tolerance 0 this is `maximal`.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.assistants.undo import is_mistake
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class CorrectOptions(NamedTuple):
    """Options of correcting.

    Attributes:
        tolerance: how much worse than the best an action may be, in reward units.
    """

    tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


@register_assistant("correct", CorrectOptions)
@compiled
def correct(situation: Situation, noise: Noise, options: CorrectOptions) -> Decision:
    """Put the learner where the right action leads at every mistake, however little it costs.

    A step backwards at the start, which costs 2 of 87, is corrected surely;
    `stochastic-q-bumpers` lets nearly every one of them pass.
    """
    if is_mistake(situation, options.tolerance):
        return Decision(pick(situation.values, best_value(situation.values), noise.tie), 1.0)
    return Decision(situation.proposed, 0.0)
