"""What Stochastic Q Bumpers do in a situation in which another rule does what its source says."""

from qbumpers.assistants import make_assistant


def bumpers(situation, noise, alpha=0.7):
    """Their decision with alpha = 0.7 and `v_min` 0; the situation's start value is above 0."""
    return make_assistant("stochastic-q-bumpers", alpha=alpha).decide(situation, noise)
