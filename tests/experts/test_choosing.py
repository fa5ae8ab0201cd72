"""Experts trained alike, judged by one rule, and not trained twice."""

import gymnasium
import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.experts import Recipe, choosing
from qbumpers.experts.checking import ExpertWarning, MeanWithError
from qbumpers.experts.choosing import (
    Judgement,
    best,
    check_claim,
    judge,
    train_several,
    with_provenance,
)
from qbumpers.learners import DoubleDQN, Schedule
from qbumpers.networks import Network
from qbumpers.tasks import make_task
from qbumpers.values import load_values
from tests.experiments.own_files import OwnFiles
from tests.values.networks import constant
from tests.values.walking import DISCOUNT, line, worth

RECIPE = Recipe(DoubleDQN(Network((4,)), discount=DISCOUNT, learning_starts=20), 60, 2)


def judged(*merits):
    nothing = MeanWithError(0.0, 0.0)
    return Judgement(tuple(MeanWithError(m, 0.1) for m in merits), nothing, nothing, nothing, None)


@pytest.mark.parametrize(
    ("merits", "chosen"),
    [
        ([(0.9, 1, 1), (1.0, 0, 0)], 1),
        ([(1, 0.5, 1), (1, 0.7, 0), (0.9, 1, 1)], 1),
        ([(1, 0.7, 0.1), (1, 0.7, 0.2), (1, 0.7, 0.15)], 1),
        ([(1, 1, 1), (1, 1, 1)], 0),
    ],
)
def test_the_best_is_judged_by_one_merit_after_the_other(merits, chosen):
    assert best([judged(*each) for each in merits]) == chosen


def test_a_judgement_counts_successes_and_compares_claims_with_returns():
    right = constant(1, 2, 2, discount=DISCOUNT)
    found = judge(line(), right, episodes=30)
    assert found.merits[0].mean == 1.0
    assert found.merits[2].mean < 0.9  # fifty random steps often fall into the pit
    assert found.greedy_return.mean == 10 - 4
    assert found.start_return.mean == pytest.approx(worth(5))
    assert found.start_value == (1.0, 0.0)
    assert found.crash_value == (0.0, 0.0)  # of the action towards the pit


def test_where_no_success_is_told_returns_judge():
    right = constant(1, 2, 2, discount=DISCOUNT)
    found = judge(line(has_success=False), right, episodes=10)
    assert 5 < found.merits[0].mean <= 6


def test_finished_seeds_are_kept_and_not_trained_again(tmp_path, monkeypatch):
    trained = []
    original = choosing.train_expert

    def counted(*arguments, seed, **fields):
        if seed == 2 and trained.count(2) == 0:
            trained.append(seed)
            raise KeyboardInterrupt
        trained.append(seed)
        return original(*arguments, seed=seed, **fields)

    monkeypatch.setattr(choosing, "train_expert", counted)
    with pytest.raises(KeyboardInterrupt):
        train_several(line(), RECIPE, range(3), tmp_path)
    steps = []
    found = train_several(
        line(), RECIPE, range(3), tmp_path, lambda seed, done: steps.append((seed, done))
    )
    assert trained == [0, 1, 2, 2]
    assert len({values.digest() for values in found}) == 3
    assert steps == [(0, 60), (1, 60), (2, 60)]
    again = [original(line(), RECIPE, seed=seed).digest() for seed in range(3)]
    assert [values.digest() for values in found] == again


def test_another_recipe_or_task_is_another_training(tmp_path):
    train_several(line(), RECIPE, [0], tmp_path)
    train_several(line(), RECIPE._replace(steps=61), [0], tmp_path)
    train_several(line(episode_limit=7), RECIPE, [0], tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


def test_other_code_of_an_own_environment_is_another_training(tmp_path, monkeypatch):
    trained = []

    def counted(task, recipe, *, seed, report):
        trained.append(seed)
        return constant(1, 1, 2, discount=DISCOUNT)

    monkeypatch.setattr(choosing, "train_expert", counted)
    (tmp_path / "own").mkdir()
    files = OwnFiles(tmp_path / "own", monkeypatch)

    def train():
        trained.clear()
        files.register_environment()
        task = make_task("own/Walk-v0", discount=DISCOUNT)
        train_several(task, RECIPE, [0], tmp_path / "kept")
        return list(trained)

    try:
        assert [train(), train()] == [[0], []]
        files.edit("own_environment", "-1.0, ended", "-2.0, ended")
        assert [train(), train()] == [[0], []]
        files.edit("own_environment", "-2.0, ended", "-1.0, ended")
        assert train() == []
    finally:
        gymnasium.registry.pop("own/Walk-v0", None)


def test_a_damaged_file_is_named(tmp_path):
    train_several(line(), RECIPE, [0], tmp_path)
    [path] = tmp_path.iterdir()
    path.write_bytes(b"half")
    with pytest.raises(RequestError, match=r"seed-0-.*not a file of Q values"):
        train_several(line(), RECIPE, [0], tmp_path)


def test_the_provenance_says_how_it_was_chosen_and_what_it_reaches(tmp_path):
    values = with_provenance(line(), constant(1, 2, 2), judged(1, 0.93, 0.5), [0, 1])
    values.save(tmp_path / "expert.npz")
    assert load_values(tmp_path / "expert.npz").method == (
        "by hand; the best of seeds 0, 1; success 1.00 at epsilon 0.02, 0.93 at epsilon 0.1, "
        "0.50 at epsilon 0.02 after 50 random actions"
    )
    assert np.array_equal(values.parameters, constant(1, 2, 2).parameters)


@pytest.mark.slow
def test_the_best_of_four_experts_balances_a_pole(tmp_path):
    """100,000 steps each; single ones come and go, as Double DQN does at this task."""
    task = make_task("CartPole-v1", discount=0.99)
    learner = DoubleDQN(
        network=Network((128,), "relu"), epsilon=Schedule(1.0, 0.02, 0.2), batch_size=128,
        target_every=1_000,
    )  # fmt: skip
    trained = train_several(task, Recipe(learner, 100_000, 0), range(4), tmp_path)
    judgements = [judge(task, values, episodes=20) for values in trained]
    assert judgements[best(judgements)].greedy_return.mean >= 400


def promising(claimed, achieved, error):
    claims, returns = MeanWithError(claimed, error), MeanWithError(achieved, error)
    return Judgement((), returns, claims, returns, None)


@pytest.mark.parametrize(
    ("claimed", "achieved", "error"), [(85.0, 100.0, 0.1), (50.0, 99.0, 12.0), (-24.0, -20.0, 0.1)]
)
def test_what_values_promise_may_be_off_by_a_fifth_or_by_chance(claimed, achieved, error):
    assert check_claim(make_task("mountain-car"), promising(claimed, achieved, error))


@pytest.mark.parametrize(("claimed", "achieved"), [(51.5, 99.3), (150.0, 99.3), (-10.0, -20.0)])
def test_values_that_promise_something_else_are_warned_of(claimed, achieved):
    said = f"predict a discounted return of {claimed} from the start, and .* achieve {achieved};"
    with pytest.warns(ExpertWarning, match=said):
        assert not check_claim(make_task("mountain-car"), promising(claimed, achieved, 0.5))
