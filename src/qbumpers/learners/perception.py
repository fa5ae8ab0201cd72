"""What a learner believes happened when the assistant executed another action than its own.

(Ho, Littman and Austerweil 2017 discuss interruption, transition and disruption.)
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.compilation import compiled, inlined
from qbumpers.errors import unknown_name
from qbumpers.learners.interface import Transition
from qbumpers.random_streams import draw

EXECUTED, PROPOSED, NOTHING = range(3)
"""What is credited, in the order of `Perception.credits`."""


class Perception(NamedTuple):
    """How a learner reads an overridden step. Steps without an override are read as they are.

    An override that it does not notice is taken for its own doing: it credits its own action with
    what happened, and if the step was undone it believes that the action led back.

    Attributes:
        notices: probability of noticing an override.
        credits: what it credits if it notices: the "executed" action with where it led, its
            "proposed" one, or "nothing": then it learns nothing from the step.
        penalty: what a noticed override feels like, in reward units.
    """

    notices: Annotated[float, Field(ge=0, le=1)] = 1.0
    credits: Literal["executed", "proposed", "nothing"] = "executed"
    penalty: Annotated[float, Field(allow_inf_nan=False)] = 0.0


PERCEPTIONS: Mapping[str, Perception] = MappingProxyType(
    {
        "transition": Perception(0.0, "proposed", 0.0),
        "observant": Perception(1.0, "executed", 0.0),
        "interruption": Perception(1.0, "nothing", 0.0),
        "disruption": Perception(1.0, "executed", 1.0),
        "transition-disruption": Perception(1.0, "proposed", 1.0),
    }
)
"""Perceptions by name; `transition` is the paper's (Section 2.3).

There cannot be others: stored results state the name alone."""


def perception(name: str) -> Perception:
    """The perception of that name.

    Raises:
        RequestError: if there is none.
    """
    if str(name) not in PERCEPTIONS:
        raise unknown_name("perception", name, PERCEPTIONS)
    return PERCEPTIONS[name]


class Experience(NamedTuple):
    """What a learner takes from one step.

    Attributes:
        action: the action that it credits; -1 if it learns nothing.
        reward: what it believes it received, in reward units.
        led_back: whether it believes that the action led back to where the step began.
    """

    action: int
    reward: float
    led_back: bool


@compiled
def perceive(
    perception: Perception, proposed: int, executed: int, undone: bool, reward: float, coin: float
) -> Experience:
    """What a learner takes from a step.

    Args:
        perception: how it reads overridden steps; `credits` is `EXECUTED`, `PROPOSED` or `NOTHING`.
        proposed: its own action.
        executed: the action that the environment received.
        undone: whether the state was taken back.
        reward: what the environment gave.
        coin: in [0, 1), whether an override is noticed.

    Returns:
        What it credits and believes in.
    """
    if proposed == executed and not undone:
        return Experience(proposed, reward, False)
    if coin >= perception.notices:
        return Experience(proposed, reward, undone)
    felt = reward - perception.penalty
    if perception.credits == NOTHING:
        return Experience(-1, felt, undone)
    if perception.credits == PROPOSED:
        return Experience(proposed, felt, undone)
    return Experience(executed, felt, False)


@inlined
def noticing(perception: Perception, overridden: bool, stream: np.ndarray) -> float:
    """The coin of `perceive`, drawn only if it decides anything."""
    if overridden and 0 < perception.notices < 1:
        return draw(stream)
    return 0.0


@inlined
def believed(experience: Experience, state: Any, next_state: Any, terminated: bool) -> Transition:
    """The transition that a learner learns from.

    Args:
        experience: from `perceive`.
        state: where the step began.
        next_state: where the action led.
        terminated: whether the episode would end there for good.
    """
    if experience.led_back:
        return Transition(state, experience.action, experience.reward, state, False, -1)
    return Transition(state, experience.action, experience.reward, next_state, terminated, -1)
