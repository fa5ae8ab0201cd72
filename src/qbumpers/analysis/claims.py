"""What a paper claims in words, judged from the trials by rules that do not depend on them.

Each piece of evidence is an estimate with its interval beside a limit. It speaks for a claim where
the whole interval lies on the claimed side of the limit, against it where the whole interval lies
on the other side, and else for neither.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import polars as pl

from qbumpers.analysis.comparisons import RETURNS
from qbumpers.analysis.frontier import beaten_share, lead
from qbumpers.analysis.hypervolume import compare_hypervolumes
from qbumpers.analysis.measures import trial_samples
from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import Estimate, bonferroni, difference

HOLDS, FAILS, OPEN = "holds", "does not hold", "cannot be told from these trials"
"""Verdicts."""

LANDING = 200.0
"""Points between landing (+100) and crashing (-100) in Lunar Lander: the unit of its limits."""

DESTROYED, NEAR, JUST_BELOW = 0.5, 0.25, 0.9
"""Losses of learning, as shares of `LANDING` or of a success rate, and alpha "just below 1"."""

BUMPERS, THRESHOLDING = "stochastic-q-bumpers", "local-q-thresholding"


class Evidence(NamedTuple):
    """An estimate beside a limit.

    Attributes:
        condition: the setting that it is about; empty where it is about whole methods.
        what: is estimated.
        estimate: with its interval.
        limit: between speaking for the claim and against it.
        wanted: "above" or "below" the limit, where it speaks for the claim.
    """

    condition: str
    what: str
    estimate: Estimate
    limit: float
    wanted: str

    @property
    def speaks_for(self) -> bool | None:
        """Whether it speaks for the claim (True), against it (False) or neither (None)."""
        above, below = self.estimate.low > self.limit, self.estimate.high < self.limit
        if not (above or below):
            return None
        return above == (self.wanted == "above")


class Claim(NamedTuple):
    """A claim, and what the trials say about it.

    Attributes:
        title: the claim in short.
        rule: when it holds.
        every: whether it is about every setting (True) or about some setting (False).
        evidence: a row a setting and estimate.
    """

    title: str
    rule: str
    every: bool
    evidence: Sequence[Evidence]

    @property
    def settings(self) -> dict[str, bool | None]:
        """Whether each setting speaks for the claim; all of its evidence must."""
        found: dict[str, list[bool | None]] = {}
        for one in self.evidence:
            found.setdefault(one.condition, []).append(one.speaks_for)
        return {name: _together(verdicts) for name, verdicts in found.items()}

    @property
    def about_settings(self) -> bool:
        """Whether it is about single settings, not whole methods."""
        return "" not in self.settings

    @property
    def verdict(self) -> str:
        """One of `HOLDS`, `FAILS` and `OPEN`."""
        settings = list(self.settings.values())
        holds = _together(settings) if self.every else _negated(_together(map(_negated, settings)))
        return {True: HOLDS, False: FAILS, None: OPEN}[holds]


def _together(verdicts: Iterator[bool | None] | Sequence[bool | None]) -> bool | None:
    """Whether all are true; None where that is not known."""
    found = list(verdicts)
    if False in found:
        return False
    return None if None in found or not found else True


def _negated(verdict: bool | None) -> bool | None:
    return None if verdict is None else not verdict


def judged(
    name: str, trials: pl.DataFrame, generator: np.random.Generator, paired: bool = False
) -> list[Claim]:
    """The claims of a published experiment, each with its evidence.

    Args:
        name: of the experiment; those of Section 4.3 are about "lunar-lander".
        trials: of all its conditions, from `trial_measures`.
        generator: draws resamples of the trials.
        paired: whether trials of equal number belong together (common random numbers).

    Returns:
        The claims whose settings were run; none of another experiment, or of several learners.
    """
    if name != "lunar-lander" or trials["learner"].n_unique() > 1:
        return []
    found = [_destroys(trials, paired), _keeps(trials, paired), _covers(trials, generator, paired)]
    return [claim for claim in found if claim.evidence]


def telling(trials: pl.DataFrame) -> list[str]:
    """The conditions whose course tells most about the claims.

    Args:
        trials: of one learner, from `trial_measures`.

    Returns:
        Ids: the assistants that are not swept, the bumpers that teach best, and the thresholding
        that is nearest to alpha = 1; those that were run, and override at all.
    """
    keys = ("condition", "alpha")
    means = trials.group_by(*keys, maintain_order=True).agg(pl.col("unassisted").mean())
    fixed = means.filter(pl.col("alpha").is_null())["condition"].to_list()
    bumpers = means.filter(
        pl.col("condition").is_in(_overriding(trials, BUMPERS)["condition"].to_list())
    ).sort("unassisted", descending=True)
    thresholds = _overriding(trials, THRESHOLDING)
    return [*fixed, *bumpers["condition"].head(1), *thresholds["condition"].tail(1)]


def _destroys(trials: pl.DataFrame, paired: bool) -> Claim:
    """Thresholding just below alpha = 1."""
    settings = _overriding(trials, THRESHOLDING).filter(
        pl.col("alpha") >= JUST_BELOW, pl.col("alpha") < 1
    )
    return Claim(
        "Local Q-Thresholding just below α = 1 destroys learning",
        f"It holds where at every setting with {JUST_BELOW:g} ≤ α < 1 people who learned with it "
        f"surely return over {DESTROYED * LANDING:g} points less without it than people who never "
        "had assistance, and succeed less than half as often. It does not hold where at some "
        "setting either is surely not so. Intervals hold for all settings at once.",
        True,
        [
            *_against_none(trials, settings, "unassisted", -DESTROYED * LANDING, "below", paired),
            *_against_none(trials, settings, "unassisted_success", 0, "below", paired, DESTROYED),
        ],
    )


def _keeps(trials: pl.DataFrame, paired: bool) -> Claim:
    """Bumpers at every alpha."""
    settings = _overriding(trials, BUMPERS)
    return Claim(
        "Stochastic Q Bumpers keeps learning near the unassisted learner's while performance rises",
        "It holds where at some setting people surely return more with it than people without "
        f"assistance do in training, and surely less than {NEAR * LANDING:g} points less without "
        "it than they do. It does not hold where at every setting either is surely not so. "
        "Intervals hold for all settings at once.",
        False,
        [
            *_against_none(trials, settings, "assisted", 0, "above", paired),
            *_against_none(trials, settings, "unassisted", -NEAR * LANDING, "above", paired),
        ],
    )


_AGAINST = {
    "assisted": "return with it, minus no assistance's",
    "unassisted": "return without it, minus no assistance's",
    "unassisted_success": "success without it, minus half of no assistance's",
}


def _against_none(
    trials: pl.DataFrame,
    settings: pl.DataFrame,
    measure: str,
    limit: float,
    wanted: str,
    paired: bool,
    share: float = 1.0,
) -> Iterator[Evidence]:
    """A measure of each setting, minus a share of what it is without assistance."""
    samples = trial_samples(trials, measure)
    controls = trials.filter(assistant="none")["condition"].unique().to_list()
    names = settings["condition"].to_list()
    if not controls or not names:
        return
    control, confidence = samples[controls[0]][:, 0], bonferroni(len(names))
    for name in names:
        found = difference(samples[name][:, 0], share * control, paired, confidence)
        yield Evidence(name, _AGAINST[measure], found.estimate, limit, wanted)


def _overriding(trials: pl.DataFrame, assistant: str) -> pl.DataFrame:
    """The conditions of an assistant that ever override, with their alpha, which grows."""
    own = trials.filter(assistant=assistant)
    found = own.group_by("condition", "alpha").agg(pl.col("overrides").mean())
    return found.filter(pl.col("overrides") > 0).sort("alpha")


def _covers(trials: pl.DataFrame, generator: np.random.Generator, paired: bool) -> Claim:
    """Whole methods against each other."""
    ours, theirs = (
        _overriding(trials, name)["condition"].to_list() for name in (BUMPERS, THRESHOLDING)
    )
    known = trial_samples(trials, *RETURNS)
    return Claim(
        "Stochastic Q Bumpers lies above and to the right of Local Q-Thresholding",
        "It holds where, of the settings that override, bumpers surely beat more than half of "
        "thresholding's in both returns; where they surely return more without assistance at the "
        "performance of thresholding's settings, on average over those that they reach, and more "
        "with assistance at their learning; and where their hypervolume is surely larger. It does "
        "not hold where any of these is surely not so.",
        True,
        list(
            _of_methods(
                {name: known[name] for name in ours},
                {name: known[name] for name in theirs},
                generator,
                paired,
            )
        ),
    )


def _of_methods(
    ours: dict[str, np.ndarray],
    theirs: dict[str, np.ndarray],
    generator: np.random.Generator,
    paired: bool,
) -> Iterator[Evidence]:
    """Bumpers beside thresholding, from samples [T, 2] of their settings."""
    samples = {**ours, **theirs}
    if not ours or not theirs or min(map(len, samples.values())) < 2:
        return
    means = np.array([values.mean(axis=0) for values in samples.values()])
    resampled = resampled_means(list(samples.values()), generator, paired)
    number = len(ours)
    compared: dict[str, tuple[Callable[[np.ndarray, np.ndarray], np.ndarray], float]] = {
        "share of thresholding's settings that bumpers beat in both returns": (beaten_share, 0.5),
        "return without it at equal return with it, bumpers' lead": (partial(lead, axis=0), 0.0),
        "return with it at equal return without it, bumpers' lead": (partial(lead, axis=1), 0.0),
    }
    for what, (function, limit) in compared.items():
        found = function_interval(
            lambda points, function=function: function(
                points[..., :number, :], points[..., number:, :]
            ),
            means,
            resampled,
        )
        if function is beaten_share:
            found = found._replace(low=max(0.0, found.low), high=min(1.0, found.high))
        yield Evidence("", what, found, limit, "above")
    methods = {THRESHOLDING: list(theirs), BUMPERS: list(ours)}
    areas = compare_hypervolumes(samples, methods, generator, paired=paired)
    area = areas.advantages[BUMPERS, THRESHOLDING].estimate
    yield Evidence("", "hypervolume, bumpers' lead", area, 0.0, "above")
