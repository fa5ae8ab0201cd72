"""What Section 4.3 of the paper claims of Lunar Lander, judged from the trials."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np
import polars as pl

from qbumpers.analysis.comparisons import RETURNS
from qbumpers.analysis.frontier import beaten_share, lead
from qbumpers.analysis.hypervolume import compare_hypervolumes
from qbumpers.analysis.measures import trial_samples
from qbumpers.analysis.resampling import function_interval, resampled_means
from qbumpers.analysis.statistics import bonferroni, difference
from qbumpers.experiments.design import Experiment
from qbumpers.reproduction.claims import Claim, Evidence

LANDING = 200.0
"""Points between landing (+100) and crashing (-100) in Lunar Lander: the unit of its limits."""

DESTROYED, NEAR, JUST_BELOW = 0.5, 0.25, 0.9
"""Losses of learning, as shares of `LANDING` or of a success rate, and alpha "just below 1"."""

BUMPERS, THRESHOLDING = "stochastic-q-bumpers", "local-q-thresholding"


def judge_claims(
    trials: pl.DataFrame, generator: np.random.Generator, paired: bool = False
) -> list[Claim]:
    """The claims of Section 4.3, each with its evidence.

    Args:
        trials: of all conditions, from `trial_measures`.
        generator: draws resamples of the trials.
        paired: whether trials of equal number belong together (common random numbers).

    Returns:
        The claims whose settings were run; none if there are several learners.
    """
    if trials["learner"].n_unique() > 1:
        return []
    found = [_destroys(trials, paired), _keeps(trials, paired), _covers(trials, generator, paired)]
    return [claim for claim in found if claim.evidence]


def experiment_claims(trials: pl.DataFrame, experiment: Experiment) -> list[Claim]:
    """The claims of Section 4.3, judged alike whenever the trials of an experiment are read.

    Args:
        trials: of all its conditions, from `trial_measures`.
        experiment: as run; its seed draws the resamples.
    """
    generator = np.random.default_rng([experiment.seed, trials["learner"].n_unique(), 7])
    return judge_claims(trials, generator, experiment.common_random_numbers)


def decisive_conditions(trials: pl.DataFrame) -> list[str]:
    """The conditions whose learning curves say most about the claims.

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
    """The claim about thresholding just below alpha = 1."""
    settings = _overriding(trials, THRESHOLDING).filter(
        pl.col("alpha") >= JUST_BELOW, pl.col("alpha") < 1
    )
    return Claim(
        "Local Q-Thresholding just below α = 1 destroys learning",
        f"It holds if, at every setting with {JUST_BELOW:g} ≤ α < 1, the unassisted return is "
        f"significantly over {DESTROYED * LANDING:g} points below that of learners without "
        "assistance, and the unassisted success rate significantly below half of theirs. It does "
        "not hold if, at some setting, the opposite of either is significant. Intervals hold for "
        "all settings at once.",
        True,
        [
            *_against_none(trials, settings, "unassisted", -DESTROYED * LANDING, "below", paired),
            *_against_none(trials, settings, "unassisted_success", 0, "below", paired, DESTROYED),
        ],
    )


def _keeps(trials: pl.DataFrame, paired: bool) -> Claim:
    """The claim about bumpers at some alpha."""
    settings = _overriding(trials, BUMPERS)
    return Claim(
        "Stochastic Q Bumpers keeps learning near the unassisted learner's while performance rises",
        "It holds if, at some setting, the assisted return is significantly larger than the return "
        "of learners without assistance in training, and the unassisted one is significantly less "
        f"than {NEAR * LANDING:g} points below theirs. It does not hold if, at every setting, the "
        "opposite of either is significant. Intervals hold for all settings at once.",
        False,
        [
            *_against_none(trials, settings, "assisted", 0, "above", paired),
            *_against_none(trials, settings, "unassisted", -NEAR * LANDING, "above", paired),
        ],
    )


_AGAINST = {
    "assisted": "assisted return, minus no assistance's",
    "unassisted": "unassisted return, minus no assistance's",
    "unassisted_success": "unassisted success rate, minus half of no assistance's",
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
    """A measure of each setting, minus a share of what learners without assistance have."""
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
    """The claim about whole methods against each other."""
    ours, theirs = (
        _overriding(trials, name)["condition"].to_list() for name in (BUMPERS, THRESHOLDING)
    )
    known = trial_samples(trials, *RETURNS)
    return Claim(
        "Stochastic Q Bumpers lies above and to the right of Local Q-Thresholding",
        "It holds if, of the settings that override, bumpers significantly beat more than half of "
        "thresholding's in both returns; if, on average over the settings of thresholding that "
        "they reach, their unassisted return is significantly larger at equal assisted return, and "
        "their assisted one at equal unassisted return; and if their hypervolume is significantly "
        "larger. It does not hold if the opposite of any of these is significant.",
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
    ours: Mapping[str, np.ndarray],
    theirs: Mapping[str, np.ndarray],
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
        "unassisted return at equal assisted return, bumpers' lead": (partial(lead, axis=0), 0.0),
        "assisted return at equal unassisted return, bumpers' lead": (partial(lead, axis=1), 0.0),
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
