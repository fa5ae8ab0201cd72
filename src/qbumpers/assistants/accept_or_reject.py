"""Accept or reject (Fitzsimons, Kalinowska, Dewald and Murphey 2020).

Their assistant lets a person's control pass if it helps the task, and otherwise passes nothing on:
it never puts a better control in its place. In continuous time the test is the mode insertion
gradient, the derivative of the cost with respect to inserting the person's control into a nominal
one. With numbered actions, inserting one action before the optimal policy goes on changes the
return by Q*(s, a^h) - Q*(s, no_op), so

    a = a^h  if Q*(s, a^h) >= Q*(s, no_op) - tolerance,  else  no_op.
"""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.assistants.registry import register_assistant, unchanged
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Model, Noise, Situation


class AcceptOrRejectOptions(NamedTuple):
    """Options of accepting or rejecting.

    Attributes:
        tolerance: how much worse than doing nothing an action may be, in reward units.
    """

    tolerance: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0


@compiled
def doing_nothing(options: AcceptOrRejectOptions, model: Model) -> int:
    """The action that does nothing."""
    return model.no_op


@register_assistant(
    "accept-or-reject", AcceptOrRejectOptions, start=doing_nothing, observe=unchanged,
    needs=("no_op",),
)  # fmt: skip
@compiled
def accept_or_reject(
    situation: Situation, noise: Noise, options: AcceptOrRejectOptions, memory: int
) -> Decision:
    """Replace a proposal that is worse than doing nothing by doing nothing, not by a better action.

    If an override is due, `stochastic-q-bumpers` executes the best action, this rule the one that
    does nothing, and what there is to do is left to the learner.
    """
    values, proposed = situation.values, situation.proposed
    if values[proposed] >= values[memory] - options.tolerance:
        return Decision(proposed, 0.0)
    return Decision(memory, 1.0)
