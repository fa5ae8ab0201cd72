"""What the paper adds to a report of Cliff Walking: printed numbers and Section 4.1."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import polars as pl
from markupsafe import Markup

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings
from qbumpers.analysis.formatting import format_number
from qbumpers.analysis.page.elements import Column, Drawing, Section, Table
from qbumpers.experiments.store import Results
from qbumpers.reproduction.cliff_walking import threshold_figures
from qbumpers.reproduction.cliff_walking.thresholds import (
    KINDS,
    ThresholdSummary,
    overridden,
    positions,
    suboptimal_moves,
    summarise_thresholds,
)
from qbumpers.reproduction.printed import (
    PUBLISHED,
    compare,
    comparisons_frame,
    comparisons_section,
    disagreements,
    no_verdict,
    printed_marks,
    printed_numbers,
)
from qbumpers.tasks.cliff_walking import ACTION_NAMES, state_of
from qbumpers.values import TabularValues

SHOWN_THRESHOLDS = (0.5, 0.499, 0.0195, 0.018)
"""Before and after each change of behaviour."""


def additions(results: Results, findings: Findings, why: str) -> Additions:
    """Comparisons with printed numbers, and why no threshold serves.

    Args:
        results: what the run's output folder holds.
        findings: what the tables say about these results.
        why: the results cannot be held against the paper's; empty if they can.
    """
    numbers = printed_numbers("cliff-walking")
    comparisons = compare(numbers, findings.summary, findings.regrets)
    if why:
        comparisons = [each._replace(agrees=None) for each in comparisons]
    section = [comparisons_section(comparisons, why)] if comparisons else []
    return Additions(
        cautions=[no_verdict(why)] if why and comparisons else disagreements(comparisons),
        tables={PUBLISHED: comparisons_frame(comparisons)} if comparisons else {},
        sections=[*section, *_threshold_sections(results, findings)],
        marks=printed_marks(numbers),
    )


def _threshold_sections(results: Results, findings: Findings) -> list[Section]:
    """Section 4.1 and a note on the cluster of thresholds, if the run compares any."""
    thresholding = findings.summary.filter(assistant="local-q-thresholding")
    values = results.values
    on_the_grid = results.experiment.task.name == "cliff-walking"
    if not (on_the_grid and thresholding.height and isinstance(values, TabularValues)):
        return []
    alphas = thresholding["alpha"].unique(maintain_order=True).to_list()
    summary = summarise_thresholds(values.table, alphas)
    note = [_cluster_note(summary)] if summary.behaviours_second == 2 else []
    return [*note, thresholds_section(values.table, summary)]


def _cluster_note(summary: ThresholdSummary) -> Section:
    text = Markup(
        "<p><strong>The thresholding cluster is one assistant.</strong> With second-best "
        "overrides, the {} thresholds compared here give only {} different behaviours: none at all "
        "at α = 1, and one and the same below. What distinguishes its points is sampling. With "
        "best-action overrides they would give {}.</p>"
    ).format(len(summary.alphas), summary.behaviours_second, summary.behaviours_best)
    return Section("", "", "frontier", [text])


def thresholds_section(table: np.ndarray, summary: ThresholdSummary) -> Section:
    """Section 4.1 in pictures and numbers.

    Args:
        table: Q* of Cliff Walking, float64 [48, 4].
        summary: the numbers of Section 4.1, worked out from Q*.
    """
    introduction = Markup(
        "<p>Local Q-Thresholding overrides a move if its value falls short of the best by more "
        "than a share α of the range of values <em>in that state</em>. Beside the cliff the range "
        "is large, so going backwards looks harmless; one row up it is small, so every detour "
        "looks terrible.</p>"
    )
    thresholds = ", ".join(format_number(value, 4) for value in summary.thresholds)
    end = Markup("<p>The behaviour changes at these thresholds only: {}.</p>").format(thresholds)
    values, *maps = _drawings(table)
    content = [introduction, values, examples_table(summary), *maps, end]
    return Section("thresholds", "Why no threshold serves", "heatmaps", content)


def examples_table(summary: ThresholdSummary) -> Table:
    """The moves that Section 4.1 discusses."""
    columns = [
        Column("position", text=True),
        Column("move", text=True),
        Column("Q*"),
        Column("best Q* there"),
        Column("overridden if α is below"),
    ]
    rows = [
        [
            f"({row},\N{NO-BREAK SPACE}{column})",
            action,
            format_number(value, 0),
            format_number(best, 0),
            format_number(critical, 4),
        ]
        for row, column, action, value, best, critical in summary.examples
    ]
    return Table(columns, rows)


def _drawings(table: np.ndarray) -> Iterator[Drawing]:
    """Section 4.1 in pictures, from Q* [48, 4]."""
    moves = suboptimal_moves(table)
    yield Drawing(
        "q-values",
        "",
        "Q* of every move.",
        _by_move([table], "value"),
        partial(threshold_figures.values_figure, table),
    )
    overrides = [overridden(table, alpha) for alpha in SHOWN_THRESHOLDS]
    yield Drawing(
        "threshold-maps",
        "",
        "What four thresholds override, with best-action overrides.",
        _by_move(overrides, "overridden"),
        partial(threshold_figures.overrides_figure, table, SHOWN_THRESHOLDS),
    )
    yield Drawing(
        "threshold-shares",
        "",
        "To keep the walker from going backwards beside the cliff, α must be so "
        "small that away from it nothing suboptimal is left to try.",
        pl.DataFrame(
            [
                {**move._asdict(), "action": ACTION_NAMES[move.action], "kind": KINDS[move.kind]}
                for move in moves
            ]
        ),
        partial(threshold_figures.shares_figure, moves),
    )


def _by_move(tables: Sequence[np.ndarray], name: str) -> pl.DataFrame:
    """A row per move and position; of several tables [48, 4], those of `SHOWN_THRESHOLDS`."""
    found = [
        {
            "alpha": alpha,
            "row": row,
            "column": column,
            "action": action,
            name: table[state_of(row, column), index].item(),
        }
        for alpha, table in zip(SHOWN_THRESHOLDS, tables, strict=False)
        for row, column in positions()
        for index, action in enumerate(ACTION_NAMES)
    ]
    return pl.DataFrame(found) if len(tables) > 1 else pl.DataFrame(found).drop("alpha")
