"""Which condition is chosen, what is said of it, and what is refused."""

import sys
import tomllib

import numpy as np
import optuna
import polars as pl
import pytest
import scipy.stats

from qbumpers.errors import RequestError
from qbumpers.experiments.sources import make_experiment
from qbumpers.tuning import tune
from tests.experiments.examples import settings
from tests.narrowing import present
from tests.tuning.made_up import planned, tuned, verdicts


@pytest.mark.parametrize("seed", range(8))
def test_the_best_teacher_above_the_floor_is_chosen(tmp_path, seed):
    means = [(-3, 9), (3, 2), (3, 5), (3, 4), (9, 1)]
    found, _ = tuned(tmp_path, means, trials=60, seed=seed)
    assert verdicts(found) == [
        "below the floor", "teaches worse", "chosen", found.contenders[3].verdict, "teaches worse",
    ]  # fmt: skip
    assert found.contenders[3].verdict in {"teaches worse", "kept to the end"}
    assert found.choice is found.contenders[2]
    choice = present(found.choice)
    assert choice.condition == "stochastic-q-bumpers/alpha=0.3"
    assert choice.assistant.options.alpha == 0.3


@pytest.mark.parametrize("seed", range(4))
def test_of_several_that_are_kept_the_largest_mean_wins(tmp_path, seed):
    found, made = tuned(tmp_path, [(3, 5)] * 3, trials=10, seed=seed)
    assert set(verdicts(found)) == {"chosen", "kept to the end"}
    means = [made.returns(place, range(10))[:, 1].mean() for place in range(3)]
    assert verdicts(found).index("chosen") == np.argmax(means)


def test_what_is_said_of_the_choice_rests_on_fresh_trials_alone(tmp_path):
    found, made = tuned(tmp_path, [(3, 0), (3, 2)], trials=30, confidence=0.9)
    samples = made.returns(1, range(30, 60))
    for estimate, values in zip(found.contenders[1][3:5], samples.T, strict=True):
        interval = scipy.stats.t.interval(0.9, 29, values.mean(), scipy.stats.sem(values))
        np.testing.assert_allclose(estimate, [values.mean(), *interval])
    assert present(found.choice).confidence == 0.9


def test_what_is_said_of_the_others_rests_on_their_trials_of_the_race(tmp_path):
    found, made = tuned(tmp_path, [(3, 0), (3, 2)], trials=30)
    other = found.contenders[0]
    assert other.trials < 30
    np.testing.assert_allclose(
        [other.assisted.mean, other.unassisted.mean],
        made.returns(0, range(other.trials)).mean(axis=0),
    )


def test_a_winner_that_fresh_trials_do_not_confirm_leaves_the_race_to_the_others(tmp_path):
    means, later = [(3, 1), (3, 5), (3, 4), (3, 2)], [(3, 1), (-3, 5), (-3, 4), (3, 2)]
    found, _ = tuned(tmp_path, means, later=later, change=40, trials=40)
    assert verdicts(found) == ["teaches worse", "not confirmed", "not confirmed", "chosen"]
    assert [each.confidence for each in found.contenders] == [0.95, 0.95, 0.975, 0.9875]
    assert [each.trials for each in found.contenders[1:]] == [80, 80, 80]


def test_a_condition_that_the_race_cannot_tell_from_the_floor_is_not_chosen(tmp_path):
    found, _ = tuned(tmp_path, [(0.0, 9), (3, 1)], trials=30)
    assert verdicts(found) == ["not significantly above the floor", "chosen"]


def test_a_floor_out_of_reach_leaves_no_choice_and_names_the_nearest(tmp_path):
    found, _ = tuned(tmp_path, [(1, 9), (3, 1), (2, 5)], floor=20)
    assert found.choice is None
    assert verdicts(found) == ["below the floor"] * 3
    assert found.nearest is found.contenders[1]
    assert "choice" not in tomllib.loads((tmp_path / "tuning.toml").read_text())
    assert pl.read_csv(tmp_path / "tuning.csv").height == 3


def test_the_files_say_what_was_found(tmp_path):
    found, _ = tuned(tmp_path, [(-3, 9), (3, 1), (3, 5)], trials=30)
    table = pl.read_csv(tmp_path / "tuning.csv")
    for row, each in zip(table.iter_rows(named=True), found.contenders, strict=True):
        assert (row["condition"], row["verdict"]) == (each.condition, each.verdict)
        assert (row["trials"], row["confidence"]) == (each.trials, each.confidence)
        for measure in ("assisted", "unassisted"):
            for part, value in getattr(each, measure)._asdict().items():
                assert row[f"{measure}_{part}"] == pytest.approx(value, rel=1e-12)
    described = tomllib.loads((tmp_path / "tuning.toml").read_text())
    assert (described["floor"], described["confidence"]) == (0.0, 0.95)
    assert (described["trials"], described["grid_trials"]) == (found.trials, 90)
    choice = present(found.choice)
    assert described["choice"] == choice.condition
    again = make_experiment(settings(assistants=described["assistants"]))
    assert again.conditions()[0].assistant.options == choice.assistant.options


@pytest.mark.parametrize(
    ("plan", "options", "message"),
    [
        (
            {"learners": [{"perception": ["transition", "observant"]}]},
            {},
            "learners: there are 2; an assistant is chosen for one learner, keep one",
        ),
        ({"trials": 1}, {}, "trials = 1; at least 2 are needed to tell how sure a choice is"),
        ({}, {"floor": float("nan")}, "floor = nan; a finite return is needed"),
        (
            {},
            {"confidence": 1.0},
            "confidence = 1.0; at least 0.5 and below 1 is needed",
        ),
    ],
)
def test_a_request_that_cannot_be_met_is_refused(tmp_path, plan, options, message):
    with pytest.raises(RequestError) as refused:
        tune(planned(2, **plan), tmp_path / "out", **{"floor": 0.0, **options})
    assert str(refused.value) == message
    assert not (tmp_path / "out").exists()


def test_without_optuna_the_message_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(RequestError, match=r"pip install 'qbumpers\[tune\]'"):
        tuned(tmp_path / "out", [(3, 1)])
    assert not (tmp_path / "out").exists()


def test_the_log_level_of_optuna_is_left_as_it_was(tmp_path):
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        tuned(tmp_path, [(3, 1), (3, 2)])
        assert optuna.logging.get_verbosity() == optuna.logging.ERROR
    finally:
        optuna.logging.set_verbosity(before)
