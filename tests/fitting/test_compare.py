"""Which learner wins, and what is said of it."""

import math

import numpy as np
import polars as pl
import pytest

from qbumpers import RequestError, make_assistant
from qbumpers.fitting import compare, fit
from qbumpers.learners import Perception
from tests.fitting.records import bandit, part, walked

TWO = ["q-learning", "softmax-q-learning"]


@pytest.fixture(scope="module")
def fitted():
    """Two learners of Q-learning and two with a softmax, explained by both."""
    people = {f"{name} {trial}": walked(name, trial=trial) for name in TWO for trial in range(2)}
    return fit(people, learners=TWO, perceptions=["transition"], intervals=False), people


def test_each_is_explained_best_by_what_it_is(fitted):
    found, _ = fitted
    best = found.scores.sort("held_out", descending=True).group_by("participant").first()
    for participant, learner in best.select("participant", "learner").iter_rows():
        assert participant.startswith(learner)


def test_scores_are_those_of_every_model_and_of_chance(fitted):
    found, people = fitted
    assert found.scores.height == 3 * len(people)
    for row in found.scores.filter(pl.col("model") == "chance").iter_rows(named=True):
        steps = len(people[row["participant"]].episode)
        assert row["held_out"] == row["log_likelihood"] == pytest.approx(-steps * math.log(4))
        assert (row["steps"], row["free"]) == (steps, 0)
    others = found.scores.filter(pl.col("model") != "chance")
    for row in others.iter_rows(named=True):
        bic = row["free"] * math.log(row["steps"]) - 2 * row["log_likelihood"]
        assert row["bic"] == pytest.approx(bic)
        assert row["held_out"] < row["log_likelihood"]
    assert found.parameters.height == 2 * (4 * 4) + 4
    assert found.parameters["low"].null_count() == found.parameters.height


def table(**held_out):
    rows = [
        (str(number), model, model, "", 10, 1, value, 0.0, 0, 2.0, value)
        for model, values in held_out.items()
        for number, value in enumerate(values)
    ]
    columns = ["participant", "model", "learner", "perception", "steps", "free", "log_likelihood",
               "error", "impossible", "bic", "held_out"]  # fmt: skip
    return pl.DataFrame(rows, columns, orient="row")


def test_models_are_compared_over_participants():
    found = compare(
        table(
            good=[-5.0, -6.0, -7.0, -6.0, -6.0],
            bad=[-8.0, -5.5, -9.0, -7.0, -7.0],
            no=[-np.inf, -9, -9, -9, -9],
        )
    )
    good, bad, impossible = found.iter_rows(named=True)
    assert [good["model"], bad["model"], impossible["model"]] == ["good", "bad", "no"]
    assert (good["best_for"], bad["best_for"], impossible["best_for"]) == (4, 1, 0)
    assert (good["behind"], good["low"], good["high"]) == (0.0, 0.0, 0.0)
    assert bad["behind"] == pytest.approx((-3 + 0.5 - 2 - 1 - 1) / 5)
    assert -3 <= bad["low"] < bad["behind"] < bad["high"] <= 0.5
    assert good["probability"] == pytest.approx(math.exp(-30 / 50))
    assert (impossible["behind"], impossible["low"]) == (-math.inf, None)


def test_few_participants_give_no_interval():
    found = compare(table(good=[-5.0] * 4, bad=[-8.0, -9.0, -8.0, -8.0]))
    assert found["low"].to_list() == [None, None]


def test_perceptions_that_suit_are_compared_if_any_step_was_overridden():
    steps = {"1": part(walked("q-learning"), 150)}
    found = fit(steps, learners=["imitator"], intervals=False)
    assert set(found.models["perception"]) == {"", "observant"}
    alone = {"1": part(walked("q-learning", assistant=make_assistant("none")), 300)}
    assert not alone["1"].overridden.any()
    found = fit(alone, learners=["imitator", "q-learning"], intervals=False)
    assert set(found.models["perception"]) == {"", "observant", "transition"}


def test_intervals_are_of_the_best_model():
    steps = {"1": walked("q-learning")}
    found = fit(steps, learners=["q-learning"], perceptions=["transition"], free=["epsilon"],
                fixed={"learning_rate": 0.3, "discount": 1.0})  # fmt: skip
    assert found.best == "q-learning, transition"
    (row,) = found.parameters.iter_rows(named=True)
    assert row["parameter"] == "epsilon"
    assert row["low"] < row["estimate"] < row["high"]


def test_progress_counts_searches():
    reports = []
    people = {str(trial): bandit([0, 1, 0, 0]) for trial in range(2)}
    fit(people, learners=["q-learning"], intervals=False, report=reports.append)
    assert [tuple(each) for each in reports] == [(1, 2), (2, 2)]


def test_a_stated_perception_has_a_name():
    people = {"1": part(walked("q-learning"), 150)}
    found = fit(people, learners=["imitator"], perceptions=[Perception(1.0, "executed", 3.0)],
                intervals=False)  # fmt: skip
    assert "imitator, notices=1 credits=executed penalty=3" in found.models["model"].to_list()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"learners": ["q-learnin"]}, "unknown learner 'q-learnin'"),
        ({"learners": ["double-dqn"]}, "'double-dqn'; it observes vectors"),
        ({"perceptions": ["blind"]}, "unknown perception 'blind'"),
        ({"learners": ["imitator"], "perceptions": ["transition"]}, "learner imitator"),
        ({"free": ["curiosity"]}, "parameter curiosity: none of the learners"),
        ({"folds": 1}, "folds = 1; at least 2 is needed"),
        ({"folds": 9}, "folds = 9; participant 1 has 3 episodes"),
        ({"training": 0}, "training = 0; at least 1 is needed"),
        ({"particles": 0.5}, "particles = 0.5; a whole number"),
    ],
)
def test_wrong_requests_are_refused_before_any_search(arguments, message):
    reports = []
    with pytest.raises(RequestError, match=message):
        fit({"1": bandit([0, 1, 0])}, report=reports.append, **arguments)
    assert not reports


def test_nobody_is_refused_and_so_are_different_numbers_of_actions():
    with pytest.raises(RequestError, match="at least one is needed"):
        fit({})
    with pytest.raises(RequestError, match=r"\[2, 4\] actions"):
        fit({"1": bandit([0, 1]), "2": walked("q-learning")})
