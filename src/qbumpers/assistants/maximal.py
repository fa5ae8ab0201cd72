"""Maximal assistance: every action that is not optimal is replaced by an optimal one."""

from typing import NamedTuple

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class MaximalOptions(NamedTuple):
    """Maximal assistance has no options."""


@register_assistant("maximal", MaximalOptions)
@compiled
def maximal(situation: Situation, noise: Noise, options: MaximalOptions) -> Decision:
    """Override every suboptimal action with a best one: the baseline for performance."""
    best = best_value(situation.values)
    if situation.values[situation.proposed] >= best:
        return Decision(situation.proposed, 0.0)
    return Decision(pick(situation.values, best, noise.tie), 1.0)
