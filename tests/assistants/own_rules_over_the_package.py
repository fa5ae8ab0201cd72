"""A rule of a user's own that calls one of the package."""

from typing import NamedTuple

from qbumpers.assistants.stochastic_q_bumpers import stochastic_q_bumpers
from qbumpers.decisions import Decision


class Options(NamedTuple):
    pass


def rule(situation, noise, options):
    """Whatever it is, the proposed action."""
    if noise.coin > 1:
        return stochastic_q_bumpers(situation, noise, options)
    return Decision(situation.proposed, 0.0)
