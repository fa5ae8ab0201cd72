"""`qbumpers fit` says which learner it is."""

import polars as pl
import pytest

from qbumpers.experiments.steps import save_steps
from tests.fitting.records import bandit, walked
from tests.texts import words


@pytest.fixture
def steps(tmp_path):
    path = tmp_path / "steps.parquet"
    save_steps(path, {str(trial): walked("q-learning", trial=trial) for trial in range(3)})
    return path


def test_the_learner_that_made_the_choices_is_found(call, steps, tmp_path):
    status, output, _ = call(
        "fit", steps, "--learners", "q-learning,softmax-q-learning", "--perceptions", "transition",
        "--participants", "2", "--free", "epsilon,learning_rate", "--fixed", "discount=1",
        "--out", tmp_path / "tables",
    )  # fmt: skip
    assert status == 0
    assert "2 participants" in output
    assert "Estimates of q-learning, transition" in words(output)
    assert "would take 5 participants" in words(output)
    scores = pl.read_csv(tmp_path / "tables" / "scores.csv")
    assert scores.height == 2 * 3
    parameters = pl.read_csv(tmp_path / "tables" / "parameters.csv")
    assert {"epsilon", "learning_rate"} <= set(parameters["parameter"])
    assert pl.read_csv(tmp_path / "tables" / "models.csv")["model"][0] == "q-learning, transition"


def test_of_one_participant_the_intervals_are_shown(call, steps, tmp_path):
    _, output, _ = call(
        "fit", steps, "--learners", "q-learning", "--perceptions", "transition", "--participants",
        "1", "--free", "epsilon,learning_rate", "--fixed", "discount=1", "--out", tmp_path,
    )  # fmt: skip
    assert "with 95% intervals" in words(output)
    found = pl.read_csv(tmp_path / "parameters.csv").filter(model="q-learning, transition")
    for row in found.iter_rows(named=True):
        assert row["low"] <= row["estimate"] <= row["high"]
        numbers = (row["parameter"], *(f"{row[n]:.3f}" for n in ("estimate", "low", "high")))
        assert " ".join(numbers) in words(output)


def test_chance_has_no_estimates(call, tmp_path):
    path = tmp_path / "steps.parquet"
    save_steps(path, {"one": bandit([0, 1, 1, 0, 1, 0, 0, 1])})
    status, output, _ = call("fit", path, "--learners", "model-based", "--perceptions", "observant")
    assert status == 0
    assert "No learner explains the choices better than chance" in words(output)
    assert "Estimates" not in output


def test_tables_cannot_replace_a_file(call, steps):
    status, output, error = call("fit", steps, "--out", steps / "tables")
    assert status == 2
    assert "is a file; a folder is needed" in words(error)
    assert "participants" not in output  # nothing was read or fitted before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--learners", "q-learnin"], "unknown learner 'q-learnin'"),
        (["--fixed", "discount"], "fixed = 'discount'; names with numbers are needed"),
        (["--free", "curiosity"], "parameter curiosity: none of the learners"),
    ],
)
def test_a_wrong_request_is_one_line(call, steps, arguments, message):
    status, _, error = call("fit", steps, *arguments)
    assert status == 2
    assert message in words(error)
    assert len(error.strip().splitlines()) == 1


def test_a_file_that_is_not_there_is_one_line(call, tmp_path):
    status, _, error = call("fit", tmp_path / "none.parquet")
    assert status == 2
    assert "there is no such file" in words(error)


def test_a_file_of_another_kind_is_one_line(call, tmp_path):
    (tmp_path / "steps.parquet").write_text("step,reward")
    status, _, error = call("fit", tmp_path / "steps.parquet")
    assert status == 2
    assert "not a readable Parquet file" in words(error)
