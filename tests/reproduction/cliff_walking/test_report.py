"""The report of the paper's experiment: complete, self-contained, and true to its tables."""

import io
import math
import platform
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from PIL import Image

import qbumpers
from qbumpers.analysis.figures.style import readable
from qbumpers.analysis.formatting import decimals_of
from qbumpers.experiments.store import load
from qbumpers.reproduction.report import find
from tests.analysis.pages import Page, content, interval, number

FIGURES = [
    "frontier", "tradeoffs", "differences-from-none", "learning-curves", "sensitivity",
    "override-course", "distribution", "heatmaps", "q-values", "threshold-maps", "threshold-shares",
]  # fmt: skip
SECTIONS = [
    "outcome", "frontier", "methods", "published", "control", "curves", "sensitivity",
    "overrides", "dependence", "distribution", "heatmaps", "thresholds", "conditions", "measures",
    "again",
]  # fmt: skip
TABLES = ["summary", "published", "regret", "methods", "advantages", "differences"]


@pytest.fixture(scope="module")
def found(reproduced):
    text = (reproduced / "report.html").read_text(encoding="utf-8")
    tables = {name: pl.read_csv(reproduced / f"{name}.csv").to_dicts() for name in TABLES}
    return SimpleNamespace(folder=reproduced, text=text, page=Page(text), **tables)


def test_a_report_comes_with_its_tables_and_figures(reproduced):
    names = {path.name for path in reproduced.iterdir()}
    assert names - {".lock"} == {
        "cells", "conditions.json", "episodes.parquet", "experiment.toml", "figures", "report.html",
        "states.parquet", "trials.parquet", "values.npz", *(f"{name}.csv" for name in TABLES),
    }  # fmt: skip
    drawn = {path.name for path in (reproduced / "figures").iterdir()}
    assert drawn == {f"{name}.{ending}" for name in FIGURES for ending in ("png", "svg", "csv")}


def test_a_page_needs_nothing_from_elsewhere(found):
    for reference in found.page.references:
        local = reference.startswith(("data:", "#")) or (found.folder / reference).is_file()
        assert local, reference[:60]
    for address in ("http:", "https:", "@import", "url(", "<script "):
        assert address not in found.text
    assert found.text.count("<script>") == 1


def test_pictures_are_embedded_and_are_the_figures(found):
    assert len(found.page.pictures) == len(FIGURES)
    for (caption, source), name in zip(found.page.pictures, FIGURES, strict=True):
        assert len(caption) > 10
        kind, image = content(source)
        assert kind == "data:image/png;base64"
        assert image == (found.folder / "figures" / f"{name}.png").read_bytes()
        Image.open(io.BytesIO(image)).verify()


def test_the_numbers_behind_every_figure_and_table_are_in_the_page(found):
    for name in FIGURES:
        numbers = (found.folder / "figures" / f"{name}.csv").read_bytes()
        assert found.page.files.pop(f"{name}.csv") == numbers
        assert pl.read_csv(numbers).height > 1
    for name in TABLES:
        assert found.page.files.pop(f"{name}.csv") == (found.folder / f"{name}.csv").read_bytes()
    settings = (found.folder / "experiment.toml").read_bytes()
    assert found.page.files == {"experiment.toml": settings}


def test_all_sections_are_there_and_the_menu_leads_to_each(found):
    assert found.page.sections == SECTIONS
    assert found.page.nav == [f"#{section}" for section in SECTIONS]


def test_pictures_are_linked_as_files_too(found):
    expected = {f"figures/{name}.{ending}" for name in FIGURES for ending in ("png", "svg")}
    assert set(found.page.links) == expected


def test_the_table_of_conditions_holds_the_numbers_of_the_summary(found):
    rows = found.page.rows("conditions")
    assert len(rows) == len(found.summary) == 26
    for cells, row in zip(rows, found.summary, strict=True):
        assert cells[:5] == [
            row["condition"],
            interval(row, "assisted"),
            interval(row, "unassisted"),
            number(row["overrides_mean"], 2),
            f"{100 * row['override_rate_mean']:.0f}%",
        ]


def test_a_row_of_trials_is_what_its_episodes_say(found):
    trials = pl.read_parquet(found.folder / "trials.parquet")
    assert trials.height == 26 * 5
    episodes = pl.read_parquet(found.folder / "episodes.parquet")
    row = trials.row(77, named=True)
    own = episodes.filter(condition=row["condition"], trial=row["trial"])
    assert row["assisted"] == pytest.approx(own["assisted_return"].to_numpy().mean())


def test_the_summary_is_a_mean_over_trials_of_means_over_episodes(found):
    episodes = pl.read_parquet(found.folder / "episodes.parquet")
    for row in found.summary[::5]:
        totals = {}
        for trial, total in (
            episodes.filter(condition=row["condition"])
            .select("trial", "unassisted_return")
            .iter_rows()
        ):
            totals.setdefault(trial, []).append(total)
        means = [sum(values) / len(values) for values in totals.values()]
        assert (len(means), {len(values) for values in totals.values()}) == (5, {100})
        assert row["unassisted_mean"] == pytest.approx(sum(means) / 5)
        spread = math.sqrt(sum((mean - sum(means) / 5) ** 2 for mean in means) / 4 / 5)
        # Student's t of 4 degrees of freedom at 97.5%: 2.77645.
        assert row["unassisted_high"] - row["unassisted_mean"] == pytest.approx(
            2.77645 * spread, rel=1e-5
        )


def test_every_printed_number_stands_beside_the_measured_one(found):
    rows = found.page.rows("published")
    assert len(rows) == len(found.published) == 13
    by_condition = {row["condition"]: row for row in found.summary}
    for cells, row in zip(rows, found.published, strict=True):
        digits = 2 if "regret" in row["what"] else 1
        assert cells[:3] == [
            row["what"],
            row["printed"].replace("-", "\N{MINUS SIGN}"),
            interval(row, "measured", digits),
        ]
        assert cells[3] == {True: "yes", False: "no", None: "–"}[row["agrees"]]
        if digits == 1:
            condition, measure = row["what"].split(", ")
            assert row["measured_mean"] == by_condition[condition][f"{measure}_mean"]


def test_methods_are_compared_two_by_two_by_what_they_cover(found):
    methods = pl.read_csv(found.folder / "methods.csv").rows_by_key("assistant", named=True)
    advantages = pl.read_csv(found.folder / "advantages.csv").rows(named=True)
    pairs = {frozenset((row["assistant"], row["other"])) for row in advantages}
    assert len(pairs) == len(advantages) == len(methods) * (len(methods) - 1) / 2
    digits = decimals_of(row["advantage_mean"] for row in advantages)
    for cells, row in zip(found.page.rows("methods", 1), advantages, strict=True):
        ours, theirs = (methods[row[who]][0]["hypervolume_mean"] for who in ("assistant", "other"))
        assert row["advantage_mean"] == pytest.approx(ours - theirs)
        assert row["advantage_low"] <= row["advantage_mean"] <= row["advantage_high"]
        assert cells == [
            readable(row["assistant"]),
            readable(row["other"]),
            interval(row, "advantage", digits),
            f"{100 * row['probability']:.0f}%",
        ]


def test_regret_is_told_with_its_interval(found):
    rows = found.page.rows("methods", 2)
    assert [row["matched"] for row in found.regret] == ["performance", "learning"]
    for cells, row in zip(rows, found.regret, strict=True):
        assert [cells[0], *cells[2:]] == [
            row["matched"],
            readable(row["baseline_condition"]),
            number(row["level"]),
            number(row["baseline"]),
            interval(row, "method"),
            number(row["best"]),
            interval(row, "gap"),
        ]
        if row["gap_low"] <= row["gap_mean"] / 4:  # a share of what may be nothing
            assert cells[1] == "–"
            assert row["reduction_mean"] is None
            continue
        shares = [f"{100 * row[f'reduction_{part}']:.0f}%" for part in ("mean", "low", "high")]
        assert cells[1] == "{} [{}, {}]".format(*shares)
        gap = row["best"] - row["baseline"]
        reduction = 1 - (row["best"] - row["method_mean"]) / gap
        assert row["reduction_mean"] == pytest.approx(reduction)
        assert row["baseline_condition"].startswith("local-q-thresholding/")
    assert "The baseline, Local Q-Thresholding," in found.page.text


def test_the_best_possible_is_the_best_of_all_conditions(found):
    for row, measure in zip(found.regret, ("unassisted", "assisted"), strict=True):
        assert row["best"] == pytest.approx(max(r[f"{measure}_mean"] for r in found.summary))
        mine = [r for r in found.summary if r["condition"] == row["baseline_condition"]]
        assert row["baseline"] == pytest.approx(mine[0][f"{measure}_mean"])


def test_section_4_1_is_told_with_the_papers_numbers(found):
    rows = found.page.rows("thresholds")
    assert rows == [
        ["(1, 6)", "up", "91", "93", "1.0000"],
        ["(1, 6)", "left", "91", "93", "1.0000"],
        ["(2, 6)", "up", "92", "94", "0.0187"],
        ["(2, 6)", "down", "\N{MINUS SIGN}13", "94", "1.0000"],
        ["(2, 6)", "left", "92", "94", "0.0187"],
    ]
    assert "the 14 thresholds compared here give only 2 different behaviours" in found.page.text
    assert "With best-action overrides they would give 13." in found.page.text


def test_the_settings_of_the_run_are_in_the_page(found):
    settings = (found.folder / "experiment.toml").read_text(encoding="utf-8")
    assert " ".join(settings.split()) in found.page.text
    assert "26 conditions, 5 trials of 100 episodes each, task cliff-walking" in found.page.text


def test_the_page_says_what_to_type_and_which_versions_were_used(found):
    command = "qbumpers reproduce cliff-walking --profile figures --trials 5 --seed 1"
    assert command in found.page.text
    versions = dict(found.page.rows("again"))
    assert versions["Python"] == platform.python_version()
    assert versions["numpy"] == np.__version__
    assert versions["qbumpers"] == qbumpers.__version__


def test_intervals_of_regret_are_the_same_whenever_they_are_computed(found):
    again = find(load(found.folder))
    assert again.methods == ("stochastic-q-bumpers", "local-q-thresholding")
    for row in [row for row in found.regret if row["reduction_mean"] is not None]:
        assert again.regrets[row["matched"]].reduction == pytest.approx(
            [row[f"reduction_{part}"] for part in ("mean", "low", "high")]
        )


def test_what_came_out_is_told_first_with_the_numbers_of_the_tables(found):
    again = find(load(found.folder))
    [(heading, headlines)] = again.headlines
    assert heading == ""
    for sentence in (*headlines, *again.suggestions, *again.cautions):
        assert sentence in found.page.text
    best = max(
        (row for row in found.summary if row["assistant"] == "stochastic-q-bumpers"),
        key=lambda row: row["unassisted_mean"],
    )
    start = f"Stochastic Q Bumpers teaches best at α = {best['alpha']:g}: "
    assert any(sentence.startswith(start) for sentence in headlines)
    assert any("only 5 trials" in sentence for sentence in again.cautions)


def test_methods_are_told_with_what_they_cover(found):
    rows = found.page.rows("methods")
    digits = decimals_of(row["hypervolume_mean"] for row in found.methods)
    for cells, row in zip(rows, found.methods, strict=True):
        assert cells[1] == str(row["conditions"])
        assert cells[2] == interval(row, "assisted_macro")
        assert cells[4] == f"{100 * row['share']:.0f}%"
        assert cells[5] == interval(row, "hypervolume", digits)
    sweeps = [row for row in found.methods if row["assistant"] == "stochastic-q-bumpers"]
    means = [r["assisted_mean"] for r in found.summary if r["assistant"] == "stochastic-q-bumpers"]
    assert sweeps[0]["assisted_macro_mean"] == pytest.approx(sum(means) / len(means))


def test_every_condition_is_compared_with_no_assistance(found):
    rows = found.page.rows("control")
    assert len(rows) == 25
    none = next(row for row in found.summary if row["condition"] == "none")
    by_name = {readable(row["condition"]): row for row in found.summary}
    for cells in rows:
        for place, measure in ((1, "assisted"), (4, "unassisted")):
            apart = by_name[cells[0]][f"{measure}_mean"] - none[f"{measure}_mean"]
            shown = cells[place].partition(" ")[0].replace("\N{MINUS SIGN}", "-").replace(",", "")
            assert float(shown) == pytest.approx(apart, abs=0.051)


def test_pareto_optimal_conditions_are_told_with_their_probability(found):
    points = [(r["assisted_mean"], r["unassisted_mean"]) for r in found.summary]
    optimal = {
        readable(row["condition"])
        for row, (x, y) in zip(found.summary, points, strict=True)
        if not any(a >= x and b >= y and (a, b) != (x, y) for a, b in points)
    }
    rows = found.page.rows("frontier")
    assert {cells[0] for cells in rows if "(beaten here)" not in cells[0]} == optimal
    assert all(cells[3].endswith("%") for cells in rows)
