"""Which settings of each assistant are compared: as many of each, scaled by the task.

A method is an assistant with one dial. Its settings go from much help to little.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from qbumpers.assistants import make_assistant
from qbumpers.assistants.assistant import NEEDED_THINGS
from qbumpers.assistants.registry import registered
from qbumpers.comparison.scales import Scales, thresholds
from qbumpers.errors import unknown_name
from qbumpers.simulation.condition import had_by

SETTINGS = 8
"""Settings of every method; fewer only if there are not as many that differ in what they do."""

ANCHORS = ("none", "maximal")
"""Assistants without a dial, between which the others lie."""

BASELINE = "stochastic-q-bumpers"
"""The method that the others are compared with."""

WIDEST = 32
"""The largest room of bumpers, in spreads of Q*."""

STRONG = 1 / 8
"""Room of the bumpers that a budget or fading is over, in spreads of Q*."""

Settings = list[dict[str, Any]]


class Method(NamedTuple):
    """How settings of an assistant are chosen.

    Attributes:
        dial: the option that changes, or what several of them amount to.
        formula: its values, in words.
        settings: options of each setting, from the scales of a task, from much help to little.
        unsuited: why a task does not suit although it has what the rule needs; empty if it does.
    """

    dial: str
    formula: str
    settings: Callable[[Scales], Settings]
    unsuited: Callable[[Scales], str] = lambda scales: ""


def spaced(low: float, high: float) -> list[float]:
    """As many numbers as there are settings, each the same factor above the one before."""
    return [_short(value) for value in np.geomspace(low, high, SETTINGS)]


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _floor(scales: Scales) -> float:
    return _short(scales.lowest_start - WIDEST * scales.spread)


def _bumpers(scales: Scales, room: float) -> dict[str, Any]:
    """Bumpers with a room in spreads of Q*: v_min far below, alpha its share."""
    return {"alpha": _short(room / WIDEST), "v_min": _floor(scales)}


def _rooms(scales: Scales) -> Settings:
    return [_bumpers(scales, room) for room in spaced(1 / 32, WIDEST)]


def _aware(scales: Scales) -> Settings:
    floor = _short(scales.lowest_start - scales.spread)
    return [{"alpha": room, "v_min": floor} for room in spaced(1 / 32, WIDEST)]


def _over_bumpers(scales: Scales, room: float = STRONG) -> dict[str, Any]:
    return {"name": BASELINE, **_bumpers(scales, room)}


def _limits(option: str, quantity: str) -> Callable[[Scales], Settings]:
    """Settings of a rule that overrides if a quantity of the action is above an option."""

    def settings(scales: Scales) -> Settings:
        limits = thresholds(getattr(scales, quantity), SETTINGS)
        return [{option: limit} for limit in sorted({_short(limit) for limit in limits})]

    return settings


def _shield(scales: Scales) -> Settings:
    return [{"threshold": _short(1 - limit)} for limit in thresholds(scales.risks, SETTINGS)]


def _risk_and_novelty(scales: Scales) -> Settings:
    failures = scales.failures
    risk = _short(float(np.median(failures))) if len(failures) else 1.0
    visits = [round(number) for number in spaced(1, 256)]
    return [{"visits": number, "risk": risk, "release": risk} for number in visits[::-1]]


def _half_lives(scales: Scales) -> list[float]:
    return [_short(scales.episodes * share) for share in spaced(0.002, 10)[::-1]]


def _mixing(scales: Scales) -> Settings:
    return [{"decay": _short(2 ** (-1 / half_life))} for half_life in _half_lives(scales)]


def _advice(scales: Scales) -> Settings:
    steps = scales.episodes * scales.task.episode_limit
    budgets = {max(1, round(steps * share)) for share in spaced(1e-3, 1)}
    return [{"when": "mistakes", "budget": budget} for budget in sorted(budgets, reverse=True)]


def _needed(scales: Scales) -> Settings:
    common = {"forgetting": 0.9, "v_min": _floor(scales)}
    return [{"gain": gain, **common} for gain in spaced(0.02, 50)[::-1]]


def _targets(scales: Scales) -> Settings:
    rate = _short(scales.spread / 100)
    return [{"target": target, "rate": rate} for target in spaced(0.005, 0.64)[::-1]]


def _path(scales: Scales) -> Settings:
    return [{"path": scales.path, "reach": reach} for reach in range(SETTINGS)]


def _all_seen(scales: Scales) -> str:
    return "the assistant sees all, the goal too" if scales.task.seen is None else ""


def _partly_seen(scales: Scales) -> str:
    if scales.task.seen is None:
        return ""
    return "what the assistant sees of a state does not tell where a step leads"


def _no_path(scales: Scales) -> str:
    if scales.task.seen is not None:
        return _partly_seen(scales)
    starts = int((scales.task.start > 0).sum())
    return (
        "" if starts == 1 else f"an episode may start in {starts} states, so there is no one path"
    )


_AWARE = (
    "1/32 to 32, each 2.7 times the one before; v_min lies one spread of Q* below the lowest "
    "V*(s_0)"
)
_OPTION = "halfway between neighbours among the distinct values of"

METHODS: Mapping[str, Method] = MappingProxyType(
    {
        BASELINE: Method(
            "room = alpha (V*(s_0) - v_min)",
            "1/32 to 32 spreads of Q*, each 2.7 times the one before; v_min lies 32 spreads below "
            "the lowest V*(s_0)",
            _rooms,
        ),
        "learner-aware-bumpers": Method("alpha", _AWARE, _aware, _partly_seen),
        "model-free-learner-aware-bumpers": Method("alpha", _AWARE, _aware, _partly_seen),
        "hard-bumpers": Method("room = alpha (V*(s_0) - v_min)", "as of the bumpers", _rooms),
        "local-q-thresholding": Method(
            "alpha",
            f"0, and {_OPTION} (V* - Q*) / (V* - min Q*)",
            _limits("alpha", "relative_gaps"),
        ),
        "closest-acceptable": Method(
            "alpha",
            f"0, and {_OPTION} (V* - Q*) / (V* - min Q*)",
            _limits("alpha", "relative_gaps"),
        ),
        "closest-acceptable-unknown-goal": Method(
            "alpha",
            f"0, and {_OPTION} (V* - Q*) / (V* - min Q*) of a proposal, in its own row",
            _limits("alpha", "gaps_by_proposal"),
            _all_seen,
        ),
        "better-for-all-goals": Method("none", "it has no options", lambda scales: [{}], _all_seen),
        "accept-or-reject": Method(
            "tolerance",
            f"0, and {_OPTION} Q*(s, no_op) - Q*(s, a)",
            _limits("tolerance", "losses_to_no_op"),
        ),
        "correct": Method(
            "tolerance", f"0, and {_OPTION} V*(s) - Q*(s, a)", _limits("tolerance", "gaps")
        ),
        "undo": Method(
            "tolerance", f"0, and {_OPTION} V*(s) - Q*(s, a)", _limits("tolerance", "gaps")
        ),
        "shield": Method(
            "threshold", f"1, and 1 minus what lies {_OPTION} the probability of a crash", _shield
        ),
        "trajectory-bumpers": Method(
            "reach",
            "0 to 7 steps from the way of best actions and their best outcomes",
            _path,
            _no_path,
        ),
        "random-override": Method(
            "probability",
            "0.01 to 1, each 1.9 times the one before",
            lambda scales: [{"probability": share} for share in spaced(0.01, 1)[::-1]],
        ),
        "expert-mixing": Method(
            "decay", "a half-life of 0.002 to 10 times the episodes; share = 1", _mixing
        ),
        "assist-as-needed": Method(
            "gain", "0.02 to 50; forgetting = 0.9, v_min as of the bumpers", _needed
        ),
        "penalised-interventions": Method(
            "target", "0.005 to 0.64; rate = 0.01 spreads of Q*", _targets
        ),
        "advice-on-a-budget": Method(
            "budget",
            'episodes x step limit x 0.001 to 1; when = "mistakes", threshold = 0',
            _advice,
        ),
        "risk-and-novelty": Method(
            "visits",
            "1 to 256; risk = release = the median of the distinct risks of no success",
            _risk_and_novelty,
        ),
        "budget": Method(
            "share",
            "0.005 to 0.64, over bumpers with a room of 1/8 spread of Q*",
            lambda scales: [
                {"of": _over_bumpers(scales), "share": share} for share in spaced(0.005, 0.64)[::-1]
            ],
        ),
        "fading": Method(
            "half_life",
            "0.002 to 10 times the episodes, over bumpers with a room of 1/8 spread of Q*",
            lambda scales: [
                {"of": _over_bumpers(scales), "half_life": each} for each in _half_lives(scales)
            ],
        ),
        "hysteresis": Method(
            "room of the bumpers that it is over",
            "as of the bumpers; calm = 3",
            lambda scales: [
                {"of": _over_bumpers(scales, room), "calm": 3} for room in spaced(1 / 32, WIDEST)
            ],
        ),
    }
)
"""The methods of a comparison by the name of their assistant."""


_ROWS = {"safety": "crash", "success": "success"}  # what is announced if a row can be solved


def unsuited(name: str, scales: Scales) -> str:
    """Why a task cannot carry a method; empty if it can.

    Args:
        name: one of `METHODS`.
        scales: what the task's settings are measured in.

    Returns:
        A reason in words.
    """
    for row in registered(name).values:
        if row in _ROWS and _ROWS[row] not in scales.task.events:
            return f"the task announces no {_ROWS[row]}"
    reason = METHODS[name].unsuited(scales)
    if reason:
        return reason
    made = make_assistant(name, **METHODS[name].settings(scales)[0])
    lacking = [need for need in sorted(made.needs) if not had_by(scales.task)[need]]
    if lacking:
        return f"the task has no {NEEDED_THINGS[lacking[0]]}"
    return ""


def check_names(names: Sequence[str]) -> None:
    """Check that there is a method of each name.

    Raises:
        RequestError: if there is none.
    """
    for name in names:
        if name not in METHODS:
            raise unknown_name("assistant to compare", name, METHODS)
