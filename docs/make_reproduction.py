"""Write the page on the reproduction, and its figures: `python docs/make_reproduction.py`."""

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from make_pictures import keep, shrink
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from writing import DOCS, measure, template

import qbumpers
from qbumpers import QLearner, Schedule, make_assistant, simulate
from qbumpers.analysis.figures.curves import curves_figure, learning_curves
from qbumpers.analysis.figures.style import NAMES, assistant_of, figure, looks, readable
from qbumpers.analysis.findings import Findings
from qbumpers.analysis.frontier import Regret, matched_regret
from qbumpers.analysis.measures import trial_measures, trial_samples
from qbumpers.analysis.statistics import IntervalEstimate, mean_interval
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.store import Results, load
from qbumpers.reproduction.cliff_walking.thresholds import summarise_thresholds
from qbumpers.reproduction.experiments import profiles, reproduction
from qbumpers.reproduction.printed import Comparison, compare, printed_numbers
from qbumpers.reproduction.report import write_report
from qbumpers.tasks import cliff_walking
from qbumpers.values import TabularValues

FIGURES = {
    "figures": (
        "frontier", "learning-curves", "heatmaps", "q-values", "threshold-maps",
        "threshold-shares",
    ),
    "text": ("learning-curves",),
}  # fmt: skip
NONE = "local-q-thresholding/alpha=1"
THRESHOLDING = "local-q-thresholding/alpha=0.0195"
LEARNING, PERFORMANCE = "stochastic-q-bumpers/alpha=0.7", "stochastic-q-bumpers/alpha=0.2"
"""Points that the paper compares: no assistance, a baseline, a method matched in each measure."""


class Outcome(NamedTuple):
    """What running one profile left.

    Attributes:
        findings: the tables of its report.
        comparisons: printed numbers beside the measured ones.
        results: its files.
        means: unassisted and assisted means by condition, float64 [2].
    """

    findings: Findings
    comparisons: list[Comparison]
    results: Results
    means: dict[str, np.ndarray]


def make(folder: Path) -> None:
    """Run both profiles and write `reproduction.md` and its images into `folder`."""
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    outcomes = {profile: _run(profile, images) for profile in profiles("cliff-walking")}
    figures = outcomes["figures"]
    keep(tradeoff_figure(figures.findings.summary), images, "figure2")
    summaries = {profile: outcome.findings.summary for profile, outcome in outcomes.items()}
    keep(profiles_figure(summaries), images, "reproduction-profiles")
    shown = ["none", "maximal", LEARNING]
    curves = learning_curves(figures.results.episodes, shown)
    keep(curves_figure(curves, looks(NAMES)), images, "learning")
    page = template("reproduction.md.j2", label)
    values = figures.results.values
    assert isinstance(values, TabularValues)
    thresholds = figures.findings.summary.filter(pl.col("assistant") == "local-q-thresholding")
    text = page.render(
        version=qbumpers.__version__,
        experiment=figures.results.experiment,
        outcomes=outcomes,
        printed={axis: regret_of_points(printed_points(), axis) for axis in (0, 1)},
        own_points={axis: regret_of_points(figures.means, axis) for axis in (0, 1)},
        pooled={axis: pooled_regret(figures, axis) for axis in (0, 1)},
        thresholds=summarise_thresholds(values.table, thresholds["alpha"].to_list()),
        changes=list(changes()),
        measure=measure,
    )
    (folder / "reproduction.md").write_text(text, encoding="utf-8")


def _run(profile: str, images: Path) -> Outcome:
    with TemporaryDirectory() as folder:
        run_experiment(make_plan(reproduction("cliff-walking", profile)), folder)
        findings = write_report(folder)
        for name in FIGURES[profile]:
            suffix = "" if profile == "figures" else f"{profile}-"
            copy = images / f"reproduction-{suffix}{name}.png"
            copy.write_bytes((Path(folder) / "figures" / f"{name}.png").read_bytes())
            shrink(copy)
        results = load(folder)
    samples = trial_samples(trial_measures(results.episodes), "assisted", "unassisted")
    comparisons = compare(printed_numbers("cliff-walking"), findings.summary, findings.regrets)
    return Outcome(
        findings, comparisons, results, {name: s.mean(axis=0) for name, s in samples.items()}
    )


def regret_of_points(means: dict[str, np.ndarray], axis: int) -> float:
    """Less regret in the paper's way, from three points: 1 - (best - method) / (best - baseline).

    Args:
        means: assisted and unassisted mean by condition.
        axis: 0 if performance is matched and learning compared, 1 the reverse.

    Returns:
        The share of the baseline's regret that the method avoids.
    """
    best, method, baseline = (
        (NONE, LEARNING, THRESHOLDING)
        if axis == 0
        else ("maximal", PERFORMANCE, "local-q-thresholding/alpha=0.0191")
    )
    top, reached, reference = (means[name][1 - axis] for name in (best, method, baseline))
    return float(1 - (top - reached) / (top - reference))


def printed_points() -> dict[str, np.ndarray]:
    """Assisted and unassisted mean by condition, as printed; NaN if the paper prints none."""
    means: dict[str, np.ndarray] = {}
    for row in printed_numbers("cliff-walking")["number"]:
        point = means.setdefault(row["condition"], np.full(2, np.nan))
        point[("assisted", "unassisted").index(row["measure"])] = row["value"]
    return means


def pooled_regret(outcome: Outcome, axis: int) -> Regret:
    """Regret against all thresholds below 1 taken as the one assistant that they are."""
    samples = trial_samples(trial_measures(outcome.results.episodes), "assisted", "unassisted")
    bumpers = [name for name in samples if name.startswith("stochastic-q-bumpers")]
    below = [name for name in samples if name.startswith("local-q-thresholding") and name != NONE]
    one = "thresholds below 1"
    samples[one] = np.concatenate([samples[name] for name in below])
    generator = np.random.default_rng([outcome.results.experiment.seed, axis])
    return matched_regret(samples, bumpers, [one], axis, generator)


class Change(NamedTuple):
    """The reading of the numbers with one thing changed: assisted and unassisted returns.

    Attributes:
        what: in words.
        none: without assistance.
        thresholding: with Local Q-Thresholding, alpha = 0.0195.
        bumpers: with Stochastic Q Bumpers, alpha = 0.7.
    """

    what: str
    none: tuple[IntervalEstimate, IntervalEstimate]
    thresholding: tuple[IntervalEstimate, IntervalEstimate]
    bumpers: tuple[IntervalEstimate, IntervalEstimate]


def changes() -> Iterator[Change]:
    """What each departure from the text does by itself."""
    literal = {"escalate": False, "clip": False}
    for what, fraction, second, options in (
        ("nothing: profile `figures`", 0.9, True, {}),
        ("row 1: decay over 10% of the episodes", 0.1, True, {}),
        ("row 2: no escalation", 0.9, True, {"escalate": False}),
        ("row 3: no clipping", 0.9, True, {"clip": False}),
        ("rows 1 to 3: profile `text`", 0.1, True, literal),
        ("best overrides in place of second-best", 0.9, False, {}),
    ):
        schedule = Schedule(fraction=fraction)
        learner = QLearner(epsilon=schedule, learning_rate=schedule)
        yield Change(
            what,
            returns(learner, "none"),
            returns(learner, "local-q-thresholding", alpha=0.0195, second=second),
            returns(learner, "stochastic-q-bumpers", alpha=0.7, second=second, **options),
        )


def returns(
    learner: QLearner, name: str, **options: Any
) -> tuple[IntervalEstimate, IntervalEstimate]:
    """Assisted and unassisted return of 100 learners of Cliff Walking with an assistant."""
    outcomes = simulate(cliff_walking(), make_assistant(name, **options), learner=learner).outcomes
    return (
        mean_interval(outcomes.assisted_return.mean(axis=1)),
        mean_interval(outcomes.unassisted_return.mean(axis=1)),
    )


def tradeoff_figure(summary: pl.DataFrame) -> Figure:
    """Every condition at a glance: learning upwards, performance to the right."""
    with figure(8.6, 4.6) as drawing:
        left, right = drawing.subplots(1, 2, sharey=True, width_ratios=(1, 4))
        for axes in (left, right):
            for part in summary.partition_by("assistant", maintain_order=True):
                _draw_means(axes, part)
        left.set(xlim=(-390, -310), xticks=[-350], ylabel="mean unassisted return")
        right.set(xlim=(42, 91), xlabel="mean assisted return")
        right.spines["left"].set_visible(False)
        right.tick_params(axis="y", length=0)
        left.set_yscale("symlog", linthresh=100)
        ticks = (0, -100, -300, -1000, -3000)
        left.set_yticks(ticks, [f"{tick:,}".replace("-", "\N{MINUS SIGN}") for tick in ticks])
        left.set_ylim(-5000, 40)
        left.minorticks_off()
        for alpha, place in ((0.1, (8, -3)), (0.2, (8, 3)), (0.7, (0, 10)), (1.0, (-4, 10))):
            row = summary.filter(pl.col("condition") == f"stochastic-q-bumpers/alpha={alpha:g}")
            right.annotate(
                f"α = {alpha:g}", (row["assisted_mean"][0], row["unassisted_mean"][0]),
                xytext=place, textcoords="offset points", fontsize=9,
                color=looks(NAMES)["stochastic-q-bumpers"].colour,
            )  # fmt: skip
        right.legend(loc="lower left")
        right.annotate(
            "better", (0.99, 0.97), xytext=(0.9, 0.83), xycoords="axes fraction",
            textcoords="axes fraction", color="#555555", ha="right",
            arrowprops={"arrowstyle": "->", "color": "#555555"},
        )  # fmt: skip
    return drawing


def profiles_figure(summaries: dict[str, pl.DataFrame]) -> Figure:
    """Assistants that override, a panel per profile, with the paper's points."""
    with figure(9.4, 4.4) as drawing:
        panels = drawing.subplots(1, len(summaries), sharex=True, sharey=True)
        for axes, (profile, summary) in zip(panels, summaries.items(), strict=True):
            overriding = summary.filter(pl.col("overrides_mean") > 0, pl.col("alpha").is_not_null())
            for part in overriding.partition_by("assistant", maintain_order=True):
                _draw_means(axes, part)
            for name, point in printed_points().items():
                axes.plot(
                    *point, "*", markersize=15, fillstyle="none", markeredgewidth=1.6,
                    color=looks(NAMES)[assistant_of(name)].colour,
                )  # fmt: skip
            axes.set(title=f"profile {profile}", xlabel="mean assisted return")
        panels[0].plot([], [], "*", ms=12, mfc="none", color="#555555", label="in the paper")
        panels[0].set_ylabel("mean unassisted return")
        panels[0].legend(loc="lower left")
    return drawing


def _draw_means(axes: Axes, part: pl.DataFrame) -> None:
    name = str(part["assistant"][0])
    look = looks(NAMES)[name]
    axes.plot(
        part["assisted_mean"], part["unassisted_mean"], linestyle="none", markersize=8,
        marker=look.marker, color=look.colour, label=NAMES.get(name, name),
    )  # fmt: skip


def label(row: Comparison) -> str:
    """A printed number in words, with what kind of number it is if that is doubtful."""
    if row.note:
        return f"{row.what}, {row.note.replace(':', ';').partition(';')[0]}"
    condition, _, measure = row.what.rpartition(", ")
    return f"{readable(condition)}, {measure}"


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS)
