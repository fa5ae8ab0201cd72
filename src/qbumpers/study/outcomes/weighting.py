"""What another setting of the same rule would have come to, from the propensities of the log."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.decisions import Noise, Step
from qbumpers.errors import RequestError
from qbumpers.play.setup import Setup

FEWEST_EFFECTIVE = 10.0
"""Effective episodes below which an estimate is refused."""

_SURE = 1e-12


class Weighted(NamedTuple):
    """An importance-weighted estimate.

    Attributes:
        mean: of the return of an assisted episode under the other setting, if it alone had been
            assisted so: proposals, and what was learned before, are as they were.
        low: lower end of a 95% interval, over episodes; normal.
        high: upper end.
        effective: effective sample size (Kish 1965), in episodes.
        episodes: that were weighted.
    """

    mean: float
    low: float
    high: float
    effective: float
    episodes: int


def weighted_return(
    setup: Setup,
    name: str,
    options: Mapping[str, Any],
    episodes: Sequence[Sequence[Step]],
) -> Weighted:
    """The mean return of assisted episodes under another setting of the rule that assisted.

    Each episode has the weight of its overrides: the product over its steps of the probability of
    what happened under the other setting, divided by that of the log. The estimate is
    self-normalised.

    Args:
        setup: what was played.
        name: of the rule.
        options: of the other setting.
        episodes: steps of each assisted episode, with the propensities of the log.

    Raises:
        RequestError: if the rule remembers or undoes; if the other setting may do something that
            the log's never did (no overlap); or if too few episodes count.
    """
    assistant = make_assistant(name, **options)
    if any(rule.start is not None for rule in assistant.chain):
        raise RequestError(f"assistant {name}: it remembers, so that episodes are not independent")
    logs = [_log_weight(setup, assistant, steps) for steps in episodes]
    without = sum(missing for _, missing in logs)
    if without:
        raise RequestError(
            f"assistant {name}: at {without} steps it could do what the log's setting never did; "
            "there is no overlap, and nothing can be said of it"
        )
    returns = np.array([sum(float(step.reward) for step in steps) for steps in episodes])
    return self_normalised(np.array([log for log, _ in logs]), returns)


def self_normalised(logs: np.ndarray, returns: np.ndarray) -> Weighted:
    """The self-normalised estimate.

    Args:
        logs: float64 [N], logarithms of the weights.
        returns: float64 [N].

    Raises:
        RequestError: if fewer than `FEWEST_EFFECTIVE` count.
    """
    if not len(logs):
        raise RequestError("weights: there are no assisted episodes")
    weights = np.exp(logs - logs.max())
    shares = weights / weights.sum()
    effective = float(1 / np.sum(shares**2))
    if effective < FEWEST_EFFECTIVE:
        raise RequestError(
            f"weights: of {len(logs)} episodes, {effective:.1f} count; fewer than "
            f"{FEWEST_EFFECTIVE:.0f}, so that nothing can be said"
        )
    mean = float(shares @ returns)
    error = float(np.sqrt(np.sum((shares * (returns - mean)) ** 2)))
    return Weighted(mean, mean - 1.96 * error, mean + 1.96 * error, effective, len(logs))


def _log_weight(setup: Setup, assistant: Assistant, steps: Sequence[Step]) -> tuple[float, int]:
    """Logarithm of the weight of an episode, and at how many steps there is no overlap."""
    session = setup.session(assistant)
    session.begin(steps[0].state)
    log, missing = 0.0, 0
    for step in steps:
        if step.undone:
            raise RequestError("weights: a step was undone; only overrides can be weighted")
        theirs = float(step.probability)
        ours = float(session.override_probabilities()[int(step.proposed)])
        missing += (ours > _SURE and theirs <= _SURE) or (ours < 1 - _SURE and theirs >= 1 - _SURE)
        happened = (ours, theirs) if step.overridden else (1 - ours, 1 - theirs)
        log += float(np.log(max(happened[0], 1e-300)) - np.log(max(happened[1], 1e-300)))
        _force(session, step)
    return log, missing


def _force(session: Any, step: Step) -> None:
    """Take the session where the log went, whatever it would have decided itself."""
    decision = session.decide(int(step.proposed), Noise(step.coin, step.tie))
    session.decision = decision._replace(action=int(step.executed))
    session.record(float(step.reward), step.next_state, int(step.events))
