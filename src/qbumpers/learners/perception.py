"""What a learner believes happened when the assistant executed another action than its own.

(Ho, Littman and Austerweil 2017 discuss interruption, transition and disruption.)
"""

from typing import NamedTuple

from qbumpers.compilation import compiled
from qbumpers.errors import unknown_name


class Perception(NamedTuple):
    """How a learner reads an overridden step. Steps without an override are read as they are.

    Attributes:
        credits_proposed: credit its own action with what happened, instead of the executed one.
        learns_when_overridden: learn from overridden steps at all.
        penalised: feel an override as a penalty on the reward.
    """

    credits_proposed: bool
    learns_when_overridden: bool
    penalised: bool


class Experience(NamedTuple):
    """What a learner takes from one step.

    Attributes:
        action: the action it credits; -1 where it learns nothing.
        reward: the reward it believes it received.
    """

    action: int
    reward: float


PERCEPTIONS = {
    "transition": Perception(True, True, False),
    "observant": Perception(False, True, False),
    "interruption": Perception(False, False, False),
    "disruption": Perception(False, True, True),
    "transition-disruption": Perception(True, True, True),
}
"""Learner models by name; `transition` is the paper's (Section 2.3)."""


def perception(name: str) -> Perception:
    """The perception of that name.

    Raises:
        RequestError: where there is none.
    """
    if name not in PERCEPTIONS:
        raise unknown_name("perception", name, PERCEPTIONS)
    return PERCEPTIONS[name]


@compiled
def perceive(
    perception: Perception, proposed: int, executed: int, reward: float, penalty: float
) -> Experience:
    """What a learner takes from a step.

    Args:
        perception: how it reads overridden steps.
        proposed: its own action.
        executed: the action that happened.
        reward: what the environment gave.
        penalty: size of the penalty of an override, in reward units, where it feels one.

    Returns:
        The action it credits and the reward it believes in.
    """
    if proposed == executed:
        return Experience(proposed, reward)
    if not perception.learns_when_overridden:
        return Experience(-1, reward)
    action = proposed if perception.credits_proposed else executed
    return Experience(action, reward - penalty if perception.penalised else reward)
