"""Taking over in novel and in risky states (ThriftyDAgger, Hoque et al. 2021).

Their robot hands over to a supervisor if a state is novel or its own action is risky, and takes
control back only past a second threshold, so that control does not flicker. Here the learner is the
robot. A state is novel to it in its first visits; the risk of an action is

    R(s, a) = 1 - P(success after a under the best policy), the row "success" of the values.

Worse proposals are overridden in novel states, and if R(s, a^h) > risk. From an override on, they
are overridden if R(s, a^h) > release, until a proposal is not overridden or the episode ends.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from qbumpers.assistants.registry import register_assistant
from qbumpers.choice import best_value, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation, Step


class RiskAndNoveltyOptions(NamedTuple):
    """Options of taking over.

    Attributes:
        visits: below so many, a state is novel.
        risk: above it, the assistant takes over.
        release: at or below it, at most `risk`, the assistant gives control back.
    """

    visits: Annotated[int, Field(ge=0)]
    risk: Annotated[float, Field(ge=0, le=1)]
    release: Annotated[float, Field(ge=0, le=1)]


class Control(NamedTuple):
    """What the assistant remembers.

    Attributes:
        visits: int64 [S].
        held: whether it has control, in `episode`.
        episode: that of the last step.
    """

    visits: np.ndarray
    held: bool
    episode: int


def check_release(options: RiskAndNoveltyOptions, start_value: float) -> None:
    """Raise ValueError if control would be given back before it is taken."""
    if options.release > options.risk:
        raise ValueError(
            f"release = {options.release:g} must not be above risk = {options.risk:g}, at which "
            "the assistant takes over"
        )


@compiled
def no_visits(options: RiskAndNoveltyOptions, model: Model) -> Control:
    """The memory before the first episode."""
    return Control(np.zeros(model.states, np.int64), False, 0)


@compiled
def after_visit(memory: Control, step: Step, options: RiskAndNoveltyOptions) -> Control:
    """The memory after a step; the assistant has control from an override on."""
    memory.visits[step.state] += 1
    return Control(memory.visits, bool(step.overridden), step.episode)


@register_assistant(
    "risk-and-novelty", RiskAndNoveltyOptions, start=no_visits, observe=after_visit,
    check_start=check_release, needs=("states",), values=("success",),
)  # fmt: skip
@compiled
def risk_and_novelty(
    situation: Situation, noise: Noise, options: RiskAndNoveltyOptions, memory: Control
) -> Decision:
    """Take over in states that are new to the learner and from risky actions, for a while.

    A trifle in a state that was never visited is mended, and waste in states that are known goes on
    for ever if it risks nothing; `stochastic-q-bumpers` looks at the return and knows no visits.
    """
    values, proposed = situation.values, situation.proposed
    best = best_value(values)
    if values[proposed] >= best:
        return Decision(proposed, 0.0)
    held = memory.held and memory.episode == situation.episode
    limit = options.release if held else options.risk
    novel = memory.visits[situation.state] < options.visits
    if novel or 1 - situation.others[0][proposed] > limit:
        return Decision(pick(values, best, noise.tie), 1.0)
    return Decision(proposed, 0.0)
