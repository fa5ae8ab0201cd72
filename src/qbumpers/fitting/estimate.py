"""Maximum likelihood: the parameters under which a learner explains proposals best.

Likelihoods of learners that choose a best action jump where another action becomes the best, so the
search uses no gradient: Nelder and Mead's simplex, from the defaults of the learner and from the
best of many points that are drawn from the whole range. Intervals are profile likelihood: a value
belongs to the interval if the best likelihood with it lies less than half a quantile of chi-squared
with one degree of freedom below the maximum. That is right for many choices and parameters that the
likelihood depends on smoothly; at a bound, and of a learning rate whose likelihood jumps, it is
approximate, and the interval spans the gaps between the values that belong to it.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import scipy.optimize
import scipy.special
import scipy.stats

from qbumpers.fitting.candidates import Likelihood
from qbumpers.fitting.parameters import Parameter, parameters_of, values_of, with_values
from qbumpers.random_streams import content_words

_DRAWN_POINTS, _BEST_POINTS = 32, 3  # per parameter; from how many the search begins
_EVALUATIONS, _PROFILE_EVALUATIONS = 150, 50  # per parameter, of one descent
_REPEATS = 8  # of a particle filter, for its error
_IMPOSSIBLE = 1e6  # by which a search is led away from each proposal that could not be
_POINTS_OUT, _NEAREST, _HALVINGS = 40, 2.0**-13, 6
_HOPELESS = 20.0  # so far below what is compatible that nothing beyond is looked at


class Estimate(NamedTuple):
    """The best parameters of one learner for one participant.

    Attributes:
        parameters: estimates by name.
        log_likelihood: of all proposals that were counted, in natural logarithms; -inf if the
            learner would never have made one of them, whatever its parameters.
        error: standard error of `log_likelihood` by the particle filter; 0 if nothing was hidden.
        impossible: how many proposals could not be.
        steps: how many proposals were counted.
    """

    parameters: dict[str, float]
    log_likelihood: float
    error: float
    impossible: int
    steps: int

    @property
    def bic(self) -> float:
        """Bayesian information criterion: k ln N - 2 ln L, the lower the better."""
        return len(self.parameters) * math.log(self.steps) - 2 * self.log_likelihood


class Interval(NamedTuple):
    """What values of a parameter the choices are compatible with.

    Attributes:
        low: least such value, or the parameter's bound.
        high: largest such value, or the bound.
    """

    low: float
    high: float


def estimate(likelihood: Likelihood, counted: np.ndarray | None = None, seed: int = 0) -> Estimate:
    """The parameters that make the proposals most likely.

    Args:
        likelihood: of a candidate and a participant.
        counted: bool [N], the proposals that decide; all if None. The learner lives through all.
        seed: of the points from which the search begins.

    Returns:
        The estimate.
    """
    which = np.ones(likelihood.steps, np.bool_) if counted is None else counted
    stack = likelihood.candidate.stack
    names = likelihood.candidate.free
    parameters = [parameters_of(stack)[name] for name in names]
    loss = _loss(likelihood, which, parameters)
    words = content_words({"starts": likelihood.candidate.name, "free": [*names]})
    default = [
        p.coordinate(v) for p, v in zip(parameters, values_of(stack, names).values(), strict=True)
    ]
    found = _least(loss, parameters, default, np.random.default_rng([seed, *words]))
    values = _named(parameters, found)
    return _measured(likelihood, values, which)


def _loss(
    likelihood: Likelihood, counted: np.ndarray, parameters: Sequence[Parameter]
) -> Callable[[np.ndarray], float]:
    """Minus the log-likelihood by coordinates, large but finite if something could not be."""
    stack = likelihood.candidate.stack

    def loss(coordinates: np.ndarray) -> float:
        values = _named(parameters, coordinates)
        found = likelihood.log_probabilities(with_values(stack, values))[counted]
        possible = found > -np.inf
        return _IMPOSSIBLE * float((~possible).sum()) - float(found[possible].sum())

    return loss


def _named(
    parameters: Sequence[Parameter], coordinates: Sequence[float] | np.ndarray
) -> dict[str, float]:
    return {p.name: p.value(float(c)) for p, c in zip(parameters, coordinates, strict=True)}


def _least(
    loss: Callable[[np.ndarray], float],
    parameters: Sequence[Parameter],
    default: Sequence[float],
    generator: np.random.Generator,
) -> np.ndarray:
    """Coordinates of the least loss that was found."""
    if not parameters:
        return np.zeros(0)
    low, high = np.transpose([parameter.ends() for parameter in parameters])
    starts, tied = [np.asarray(default)], _tied(parameters)
    if (tied != np.arange(len(tied))).any():
        own, places = np.unique(tied, return_inverse=True)
        fewer = [parameters[place] for place in own]
        found = _least(
            lambda point: loss(point[places]), fewer, [default[p] for p in own], generator
        )
        starts.append(found[places])
    drawn = generator.uniform(low, high, (_DRAWN_POINTS * len(parameters), len(parameters)))
    order = np.argsort([loss(point) for point in drawn], kind="stable")
    starts += [*drawn[order[:_BEST_POINTS]]]
    ends = [_descended(loss, start, low, high, _EVALUATIONS) for start in starts]
    return min(ends, key=loss)


def _tied(parameters: Sequence[Parameter]) -> np.ndarray:
    """Places of parameters, of ends of schedules those of their starts: int64 [K].

    Schedules that do not change lie on a ridge that a search in all directions does not find.
    """
    names = [parameter.name for parameter in parameters]
    starts = [name.removesuffix(".end") + ".start" for name in names]
    return np.array([
        names.index(start if name.endswith(".end") and start in names else name)
        for name, start in zip(names, starts, strict=True)
    ])  # fmt: skip


def _descended(
    loss: Callable[[np.ndarray], float], start: np.ndarray, low: np.ndarray, high: np.ndarray,
    evaluations: int,
) -> np.ndarray:  # fmt: skip
    """Where the simplex of Nelder and Mead ends that begins at `start`."""
    size = np.where(start + 0.1 * (high - low) <= high, 0.1, -0.1) * (high - low)
    simplex = np.vstack([start, start + np.diag(size)])
    return scipy.optimize.minimize(
        loss,
        start,
        method="Nelder-Mead",
        bounds=[*zip(low, high, strict=True)],
        options={"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-3,
                 "maxfev": evaluations * len(start)},
    ).x  # fmt: skip


def _measured(likelihood: Likelihood, values: Mapping[str, float], counted: np.ndarray) -> Estimate:
    log_likelihood, error, impossible = total_log_likelihood(likelihood, values, counted)
    return Estimate(dict(values), log_likelihood, error, impossible, int(counted.sum()))


def total_log_likelihood(
    likelihood: Likelihood, values: Mapping[str, float], counted: np.ndarray
) -> tuple[float, float, int]:
    """Log-likelihood of some of the proposals, its standard error, and how many could not be.

    Args:
        likelihood: of a candidate and a participant.
        values: of its free parameters.
        counted: bool [N], the proposals that are asked for.
    """
    stack = with_values(likelihood.candidate.stack, values)
    first = likelihood.log_probabilities(stack)[counted]
    impossible = int(np.isinf(first).sum())
    if impossible or not likelihood.hidden:
        return float(first.sum()), 0.0, impossible
    totals = np.array([
        likelihood.log_probabilities(stack, repeat)[counted].sum()
        for repeat in range(1, _REPEATS + 1)
    ])  # fmt: skip
    mean = float(scipy.special.logsumexp(totals) - math.log(_REPEATS))
    return mean, float(np.std(totals, ddof=1) / math.sqrt(_REPEATS)), 0


def interval(
    likelihood: Likelihood, found: Estimate, name: str, confidence: float = 0.95
) -> Interval:
    """Profile-likelihood interval of one parameter.

    Args:
        likelihood: of a candidate and a participant.
        found: its estimate from all proposals.
        name: of the parameter, one of the free ones.
        confidence: that the interval is to have, in (0, 1).

    Returns:
        The interval; its ends are those of the parameter if the choices do not exclude them.
    """
    parameters = [parameters_of(likelihood.candidate.stack)[each] for each in found.parameters]
    loss = _loss(likelihood, np.ones(likelihood.steps, np.bool_), parameters)
    place = [*found.parameters].index(name)
    best = np.array([
        p.coordinate(v) for p, v in zip(parameters, found.parameters.values(), strict=True)
    ])  # fmt: skip
    most = loss(best) + float(scipy.stats.chi2.ppf(confidence, 1)) / 2
    ends = [
        _profile_end(_Profile(loss, parameters, best, place), float(best[place]), limit, most)
        for limit in parameters[place].ends()
    ]
    return Interval(*(parameters[place].value(end) for end in ends))


class _Profile:
    """The least loss at a coordinate of one parameter, over all others."""

    def __init__(
        self, loss: Callable[[np.ndarray], float], parameters: Sequence[Parameter],
        best: np.ndarray, place: int,
    ) -> None:  # fmt: skip
        low, high = np.transpose([parameter.ends() for parameter in parameters])
        others = np.arange(len(best)) != place
        self._loss, self._place = loss, place
        self._low, self._high, self._start = low[others], high[others], best[others]

    def reaches(self, coordinate: float, most: float) -> float:
        """A loss at a coordinate, the least one if that is needed to be at most `most`.

        The others are then looked for from where they were when that was reached the last time.
        """

        def at(others: np.ndarray) -> float:
            return self._loss(np.insert(others, self._place, coordinate))

        found = at(self._start)
        if found <= most or not len(self._start):
            return found
        moved = _descended(at, self._start, self._low, self._high, _PROFILE_EVALUATIONS)
        found = at(moved)
        if found <= most:
            self._start = moved
        return found


def _profile_end(profile: _Profile, best: float, limit: float, most: float) -> float:
    """The coordinate at one end of an interval.

    The likelihood may jump, and there are gaps between values that are compatible with the choices:
    so what lies beyond the first gap is looked at too, in growing steps, and the last gap is
    narrowed by halving.
    """
    inside, outside = best, limit
    for share in np.geomspace(_NEAREST, 1.0, _POINTS_OUT):
        point = best + float(share) * (limit - best)
        reached = profile.reaches(point, most)
        if reached <= most:
            inside, outside = point, limit
        elif outside == limit:
            outside = point
        if reached > most + _HOPELESS:
            break
    for _ in range(_HALVINGS if inside != limit else 0):
        middle = (inside + outside) / 2
        if profile.reaches(middle, most) <= most:
            inside = middle
        else:
            outside = middle
    return inside
