"""What is exported: for the analysis, and as a data set that passes an independent check."""

import csv
import json
import os
import subprocess

import pytest

import qbumpers
from qbumpers.experiments.steps import load_steps
from qbumpers.study.outcomes.export import DATASET, export_study
from tests.study.outcomes.psych_ds_rules import violations


@pytest.fixture
def exported(engine, study, setups, tmp_path):
    folder = tmp_path / "exported"
    export_study(engine, study, setups, folder)
    return folder


def rows_of(exported, name):
    path = exported / DATASET / "data" / f"study-smallstudy_description-{name}_data.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_people_are_in_the_place_of_trials(exported, rehearsed, participants):
    complete = rehearsed[1].outcomes["complete"]
    results = qbumpers.load(exported)
    assert results.experiment.of_participants
    assert results.episodes.height == complete * (3 + 2)
    retained = results.episodes.filter("retention")
    assert retained.height == complete * 2
    finished = [each for each in participants if each.now.outcome == "complete"]
    training = sorted(
        (first.total, second.total, first.overrides)
        for each in finished
        for first, second in zip(each.blocks[1].episodes[::2], each.blocks[1].episodes[1::2],
                                 strict=True)
    )  # fmt: skip
    columns = ("assisted_return", "unassisted_return", "overrides")
    assert (
        sorted(results.episodes.filter(~results.episodes["retention"]).select(columns).rows())
        == training
    )
    conditions = {each.condition for each in results.conditions}
    assert conditions == {
        "none/condition=alone+no", "none/condition=alone+yes",
        "random-override/condition=helped+no", "random-override/condition=helped+yes",
    }  # fmt: skip


def test_steps_are_there_for_fitting(exported, participants):
    steps = load_steps(exported / "steps.parquet")
    played = {each.name: each for each in participants if each.blocks}
    assert steps.keys() == played.keys()
    for name, table in steps.items():
        log = [s for block in played[name].blocks for episode in block.steps for s in episode]
        assert table.proposed.tolist() == [step.proposed for step in log]
        assert table.state.tolist() == [step.state for step in log]


def test_tables_have_a_row_for_each_thing(exported, participants):
    people = {row["participant"]: row for row in rows_of(exported, "participants")}
    assert people.keys() == {each.name for each in participants}
    episodes, steps = rows_of(exported, "episodes"), rows_of(exported, "steps")
    assert len(episodes) == sum(len(b.episodes) for p in participants for b in p.blocks)
    assert len(steps) == sum(e.length for p in participants for b in p.blocks for e in b.episodes)
    for each in participants:
        scores = [
            float(row["score"])
            for row in episodes
            if row["participant"] == each.name and row["phase"] == "posttest"
        ]
        if scores:
            assert float(people[each.name]["mean_posttest"]) == sum(scores) / 2
            assert people[each.name]["level_seen"] in ("no", "yes")
    answers = rows_of(exported, "questionnaires")
    whole = [row for row in answers if row["nasa-tlx_score"]]
    for row in whole:
        scales = [float(row[f"nasa-tlx_{name}"]) for name in (
            "mental", "physical", "temporal", "performance", "effort", "frustration")]  # fmt: skip
        assert float(row["nasa-tlx_score"]) == pytest.approx(sum(scales) / 6)
    assert {row["own_why"] for row in whole} == {"by trying"}
    assert {row["was"] for row in rows_of(exported, "attributions")} <= {"me", "assistant"}


def test_no_identity_is_exported(exported):
    for path in exported.rglob("*"):
        if path.is_file():
            assert b"simulated-" not in path.read_bytes(), path


def test_the_data_set_follows_psych_ds(exported):
    assert violations(exported / DATASET) == []
    validator = os.environ.get("PSYCHDS_VALIDATOR")
    if validator:
        done = subprocess.run(
            [*validator.split(), str(exported / DATASET)],
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stdout + done.stderr


def rewrite(folder, change):
    path = folder / "dataset_description.json"
    description = json.loads(path.read_text(encoding="utf-8"))
    change(description)
    path.write_text(json.dumps(description), encoding="utf-8")


def first_file(folder):
    return min((folder / "data").glob("*.csv"))


BREAKS = {
    "no description": lambda f: (f / "dataset_description.json").unlink(),
    "broken description": lambda f: (f / "dataset_description.json").write_text("{"),
    "no name": lambda f: rewrite(f, lambda d: d.pop("name")),
    "another type": lambda f: rewrite(f, lambda d: d.update({"@type": "Thing"})),
    "no context": lambda f: rewrite(f, lambda d: d.pop("@context")),
    "a column too few": lambda f: rewrite(f, lambda d: d["variableMeasured"].pop()),
    "a variable too many": lambda f: rewrite(f, lambda d: d["variableMeasured"].append("more")),
    "a variable twice": lambda f: rewrite(
        f, lambda d: d["variableMeasured"].append(d["variableMeasured"][0])
    ),
    "a wrong name": lambda f: first_file(f).rename(f / "data" / "episodes.csv"),
    "not UTF-8": lambda f: first_file(f).write_bytes(b"participant\n\xff\n"),
    "a row too long": lambda f: first_file(f).write_text(first_file(f).read_text() + "1,2\n"),
    "a column twice": lambda f: first_file(f).write_text("episode,episode\n1,2\n"),
    "no data": lambda f: [path.unlink() for path in (f / "data").glob("*.csv")],
}


@pytest.mark.parametrize("how", BREAKS)
def test_a_broken_data_set_is_rejected(exported, how):
    BREAKS[how](exported / DATASET)
    assert violations(exported / DATASET)


@pytest.mark.slow
def test_a_report_is_drawn_with_intervals(exported):
    from qbumpers.analysis.report import write_report

    findings = write_report(exported)
    assert findings.summary.height == 4
    assert {"assisted_low", "unassisted_high", "retention_mean"} <= set(findings.summary.columns)
    assert (exported / "report.html").stat().st_size > 10_000
