"""What another setting of the same rule would have come to, from the propensities of the log.

Off-policy evaluation by importance weighting (Precup, Sutton and Singh 2000).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit  # pyright: ignore[reportMissingTypeStubs]

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.decisions import Noise, Step
from qbumpers.errors import RequestError, counted, unknown_name
from qbumpers.play.setup import Setup
from qbumpers.study.design.conditions import Condition
from qbumpers.study.design.models import Study
from qbumpers.study.flow.standing import training_of
from qbumpers.study.outcomes.reading import Participant

FEWEST_EFFECTIVE = 10.0
"""Effective episodes below which an estimate is refused."""

_SURE = 1e-12


class Weighted(NamedTuple):
    """An importance-weighted estimate.

    Attributes:
        mean: of the return of an assisted episode under the other setting, if it alone had been
            assisted so: proposals, and what was learned before, are as they were.
        low: lower end of a 95% interval, over participants; Student's.
        high: upper end.
        effective: effective sample size (Kish 1965), in episodes.
        episodes: that were weighted.
        participants: whose they are.
    """

    mean: float
    low: float
    high: float
    effective: float
    episodes: int
    participants: int


class Compared(NamedTuple):
    """A block of training under two settings of a rule.

    Attributes:
        block: its id.
        logged: the setting under which it was played, all of its weights equal.
        other: the other setting.
    """

    block: str
    logged: Weighted
    other: Weighted


def compare_settings(
    study: Study,
    setups: Mapping[str, Setup],
    participants: Sequence[Participant],
    condition: str,
    changes: Mapping[str, Any],
) -> list[Compared]:
    """The mean return of assisted episodes of a condition, as it was and under another setting.

    Args:
        study: what was gone through.
        setups: what is played in each block, by its id.
        participants: what is recorded of them; whoever has finished a block counts in it.
        condition: name of the condition.
        changes: options of its assistant that are to be others.

    Returns:
        Of each block of training that somebody in the condition has finished.

    Raises:
        RequestError: if there is no such condition, it is yoked, nothing is changed or nobody has
            finished; else as `weighted_return`.
    """
    found = _condition(study, condition)
    if not changes:
        raise RequestError(
            f"condition {condition}: nothing is changed; give an option of its assistant, "
            f"{found.assistant}"
        )
    options = {**found.options, **changes}
    compared: list[Compared] = []
    for block in training_of(study):
        episodes = _assisted(participants, condition, block.id)
        if episodes:
            compared.append(Compared(
                block.id, _as_played(episodes),
                weighted_return(setups[block.id], found.assistant, options, episodes),
            ))  # fmt: skip
    if not compared:
        raise RequestError(f"condition {condition}: nobody has finished its training yet")
    return compared


def _condition(study: Study, name: str) -> Condition:
    conditions = {condition.name: condition for condition in study.all_conditions()}
    if name not in conditions:
        raise unknown_name("condition", name, conditions)
    found = conditions[name]
    if found.yoked_to:
        raise RequestError(
            f"condition {name}: it is yoked to {found.yoked_to}, and has no rule with settings"
        )
    return found


def _assisted(
    participants: Sequence[Participant], condition: str, block: str
) -> list[list[Sequence[Step]]]:
    """Steps of each assisted episode of a block, of each participant who has finished it."""
    return [
        [
            steps
            for episode, steps in zip(played.episodes, played.steps, strict=True)
            if episode.choice.assisted
        ]
        for each in participants
        if each.now.condition == condition
        for played in each.blocks
        if played.block == block
    ]


def _as_played(participants: Sequence[Sequence[Sequence[Step]]]) -> Weighted:
    returns, owners = _returns(participants)
    return self_normalised(np.zeros(len(returns)), returns, owners)


def _returns(participants: Sequence[Sequence[Sequence[Step]]]) -> tuple[np.ndarray, np.ndarray]:
    """The return of each episode, and the number of its participant."""
    pairs = [
        (sum(float(step.reward) for step in steps), number)
        for number, episodes in enumerate(participants)
        for steps in episodes
    ]
    returns, owners = np.array(pairs).reshape(-1, 2).T
    return returns, owners.astype(int)


def weighted_return(
    setup: Setup,
    name: str,
    options: Mapping[str, Any],
    participants: Sequence[Sequence[Sequence[Step]]],
) -> Weighted:
    """The mean return of assisted episodes under another setting of the rule that assisted.

    Each episode has the weight of its overrides: the product over its steps of the probability of
    what happened under the other setting, divided by that of the log. The estimate is
    self-normalised.

    Args:
        setup: what was played.
        name: of the rule.
        options: of the other setting.
        participants: steps of each assisted episode of each, with the propensities of the log.

    Raises:
        RequestError: if the rule remembers or undoes; if the other setting may do something that
            the log's never did (no overlap); or if too few episodes or participants count.
    """
    assistant = make_assistant(name, **options)
    if any(rule.start is not None for rule in assistant.chain):
        raise RequestError(f"assistant {name}: it remembers, so that episodes are not independent")
    logs = [_log_weight(setup, assistant, steps) for each in participants for steps in each]
    without = sum(missing for _, missing in logs)
    if without:
        raise RequestError(
            f"assistant {name}: at {counted(without, 'step')} it could do what the log's setting "
            "never did; there is no overlap, and nothing can be said of it"
        )
    return self_normalised(np.array([log for log, _ in logs]), *_returns(participants))


def self_normalised(logs: np.ndarray, returns: np.ndarray, owners: np.ndarray) -> Weighted:
    """The self-normalised estimate; its variance is that of sums over participants.

    Args:
        logs: float64 [N], logarithms of the weights.
        returns: float64 [N].
        owners: int [N], numbers of the participants.

    Raises:
        RequestError: if fewer than `FEWEST_EFFECTIVE` episodes count, or they are of one
            participant.
    """
    sample = len(np.unique(owners))
    if sample < 2:
        raise RequestError(
            f"weights: assisted episodes of {counted(sample, 'participant')}; at least 2 are needed"
        )
    weights = np.exp(logs - logs.max())
    shares = weights / weights.sum()
    effective = float(1 / np.sum(shares**2))
    if effective < FEWEST_EFFECTIVE:
        raise RequestError(
            f"weights: of {len(logs)} episodes, {effective:.1f} count; fewer than "
            f"{FEWEST_EFFECTIVE:.0f}, so that nothing can be said"
        )
    mean = float(shares @ returns)
    sums = np.bincount(owners, shares * (returns - mean))
    error = float(np.sqrt(sample / (sample - 1) * np.sum(sums**2)))
    margin = float(stdtrit(sample - 1, 0.975)) * error
    return Weighted(mean, mean - margin, mean + margin, effective, len(logs), sample)


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
