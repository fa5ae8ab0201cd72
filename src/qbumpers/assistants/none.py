"""No assistance: the proposed action is always executed."""

from typing import NamedTuple

from qbumpers.assistants.registry import register_assistant
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class NoneOptions(NamedTuple):
    """No assistance has no options."""


@register_assistant("none", NoneOptions)
@compiled
def none(situation: Situation, noise: Noise, options: NoneOptions) -> Decision:
    """Never override: the baseline for learning."""
    return Decision(situation.proposed, 0.0)
