"""Override what is worse for every goal that the learner may have (McMahan et al. 2024).

Their intervention assistance does not know the goal g. It lets a copilot act only if its action is
better than the pilot's across all possible goals. Here the copilot has a table for each goal, the
rows "goals" of the values; with a^h the proposal,

    B = {a : Q(s, a | g) > Q(s, a^h | g) for every g},

and if B is not empty, the best of it by the mean over goals is executed. There is nothing to set.
"""

from typing import NamedTuple

from qbumpers.assistants.registry import register_assistant
from qbumpers.borrowing import scratch
from qbumpers.choice import best_value, keep_only, pick
from qbumpers.compilation import compiled
from qbumpers.decisions import Decision, Noise, Situation


class BetterForAllGoalsOptions(NamedTuple):
    """There are no options."""


@register_assistant("better-for-all-goals", BetterForAllGoalsOptions, values=("goals",))
@compiled
def better_for_all_goals(
    situation: Situation, noise: Noise, options: BetterForAllGoalsOptions
) -> Decision:
    """Replace an action by one that is better whichever goal the learner may have.

    A detour that would be right for another goal passes, however much it costs;
    `stochastic-q-bumpers` takes over once the mean over goals is too low.
    """
    goals, proposed = situation.others, situation.proposed
    better, found = scratch(len(situation.values), True), False
    for action in range(len(better)):
        for goal in range(len(goals)):
            if goals[goal, action] <= goals[goal, proposed]:
                better[action] = False
        found = found or better[action]
    if not found:
        return Decision(proposed, 0.0)
    allowed = scratch(len(better), 0.0)
    keep_only(situation.values, better, allowed)
    return Decision(pick(allowed, best_value(allowed), noise.tie), 1.0)
