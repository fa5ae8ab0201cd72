"""Undoing mistakes (Ho, Littman and Austerweil 2017).

A mistake, V*(s) - Q*(s, a^h) > tolerance, happens, and then the learner is put back into the state
before it. The people of their experiment who teach by intervention prefer this.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class UndoOptions(NamedTuple):
    """Options of undoing.

    Attributes:
        tolerance: how much worse than the best an action may be, in reward units.
    """

    tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


@compiled
def is_mistake(situation: Situation, tolerance: float) -> bool:
    """Whether the proposal is worse than the best action by more than a tolerance."""
    values = situation.values
    return values[situation.proposed] < best_value(values) - tolerance


@register_assistant("undo", UndoOptions, needs=("undo",))
@compiled
def undo(situation: Situation, noise: Noise, options: UndoOptions) -> Decision:
    """Let a mistake happen, with its reward, and take the state back.

    The learner sees where its own action leads; `stochastic-q-bumpers` executes another action in
    its place, which a transition learner takes for its own.
    """
    if is_mistake(situation, options.tolerance):
        return Decision(situation.proposed, 1.0, True)
    return Decision(situation.proposed, 0.0, False)
