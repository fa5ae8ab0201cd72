"""The report of the paper's experiment: complete, self-contained, and true to its tables."""

import base64
import io
import math
from types import SimpleNamespace

import polars as pl
import pytest
from PIL import Image

from qbumpers.analysis.report import find
from qbumpers.experiments.store import load
from tests.analysis.pages import Page, interval, number

FIGURES = [
    "frontier", "learning-curves", "heatmaps", "q-values", "threshold-maps", "threshold-shares",
]  # fmt: skip
SECTIONS = [
    "frontier", "published", "regret", "curves", "heatmaps", "thresholds", "conditions", "again",
]  # fmt: skip


@pytest.fixture(scope="module")
def found(reproduced):
    text = (reproduced / "report.html").read_text(encoding="utf-8")
    tables = {
        name: pl.read_csv(reproduced / f"{name}.csv").to_dicts()
        for name in ("summary", "published", "regret")
    }
    return SimpleNamespace(folder=reproduced, text=text, page=Page(text), **tables)


def test_a_report_comes_with_its_tables_and_figures(reproduced):
    names = {path.name for path in reproduced.iterdir()}
    assert names - {".lock"} == {
        "cells", "episodes.parquet", "experiment.toml", "figures", "published.csv", "regret.csv",
        "report.html", "states.parquet", "summary.csv", "values.npz",
    }  # fmt: skip
    drawn = {path.name for path in (reproduced / "figures").iterdir()}
    assert drawn == {f"{name}.{ending}" for name in FIGURES for ending in ("png", "svg")}


def test_a_page_needs_nothing_from_elsewhere(found):
    for reference in found.page.references:
        local = reference.startswith(("data:", "#")) or (found.folder / reference).is_file()
        assert local, reference[:60]
    for address in ("http:", "https:", "@import", "url(", "<script"):
        assert address not in found.text


def test_pictures_are_embedded_and_are_the_figures(found):
    assert len(found.page.pictures) == len(FIGURES)
    for (caption, source), name in zip(found.page.pictures.items(), FIGURES, strict=True):
        assert len(caption) > 10
        kind, _, data = source.partition(",")
        assert kind == "data:image/png;base64"
        content = base64.b64decode(data, validate=True)
        assert content == (found.folder / "figures" / f"{name}.png").read_bytes()
        Image.open(io.BytesIO(content)).verify()


def test_all_sections_are_there_and_the_menu_leads_to_each(found):
    assert found.page.sections == SECTIONS
    assert found.page.nav == [f"#{section}" for section in SECTIONS]


def test_tables_and_figures_are_linked(found):
    expected = {f"figures/{name}.{ending}" for name in FIGURES for ending in ("png", "svg")}
    assert set(found.page.links) == expected | {"summary.csv", "episodes.parquet"}


def test_the_table_of_conditions_holds_the_numbers_of_the_summary(found):
    [_, *rows] = found.page.tables["conditions"]
    assert len(rows) == len(found.summary) == 26
    for cells, row in zip(rows, found.summary, strict=True):
        assert cells == [
            row["condition"],
            interval(row, "assisted"),
            interval(row, "unassisted"),
            number(row["overrides_mean"], 2),
            f"{100 * row['override_rate_mean']:.0f}%",
        ]


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
    [_, *rows] = found.page.tables["published"]
    assert len(rows) == len(found.published) == 13
    by_condition = {row["condition"]: row for row in found.summary}
    for cells, row in zip(rows, found.published, strict=True):
        digits = 2 if "regret" in row["what"] else 1
        assert cells[:3] == [
            row["what"],
            number(row["published"], digits),
            interval(row, "measured", digits),
        ]
        assert cells[3] == {True: "yes", False: "no", None: "–"}[row["agrees"]]
        if digits == 1:
            condition, measure = row["what"].split(", ")
            assert row["measured_mean"] == by_condition[condition][f"{measure}_mean"]


def test_regret_is_told_with_its_interval(found):
    [_, *rows] = found.page.tables["regret"]
    assert [row["matched"] for row in found.regret] == ["performance", "learning"]
    for cells, row in zip(rows, found.regret, strict=True):
        assert [cells[0], *cells[2:]] == [
            row["matched"],
            row["baseline_condition"],
            number(row["level"]),
            number(row["baseline"]),
            interval(row, "method"),
            number(row["best"]),
        ]
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
    [_, *rows] = found.page.tables["thresholds"]
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


def test_intervals_of_regret_are_the_same_whenever_they_are_computed(found):
    again = find(load(found.folder))
    assert again.methods == ("stochastic-q-bumpers", "local-q-thresholding")
    for row in found.regret:
        assert again.regrets[row["matched"]].reduction == pytest.approx(
            [row[f"reduction_{part}"] for part in ("mean", "low", "high")]
        )
