"""Recipes from a few settings; `tests/cli/test_expert.py` trains by them, and stops and goes on."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.experts.choosing import best
from qbumpers.experts.selecting import make_recipe, train_best
from qbumpers.experts.training import GENERAL, Recipe
from qbumpers.tasks import make_task
from qbumpers.values import load_values

POLE = make_task("CartPole-v1", discount=0.9)
SMALL = {
    "steps": 1500,
    "hidden": [8],
    "activation": "relu",
    "learning_rate": 1e-3,
    "random_start": 0,
}


def test_a_recipe_has_the_discount_of_the_task_and_what_was_asked_for():
    recipe = make_recipe(POLE, **SMALL)
    assert (recipe.steps, recipe.random_start, recipe.learner.discount) == (1500, 0, 0.9)
    assert recipe.learner.learning_rate == 1e-3
    assert tuple(recipe.learner.network) == ((8,), "relu", 0)


def test_the_lander_is_learned_by_the_papers_recipe_and_others_by_a_general_one():
    assert make_recipe(make_task("lunar-lander")) == Recipe()
    pole = make_recipe(POLE)
    assert pole.general
    assert pole.learner.discount == 0.9
    assert pole._replace(learner=GENERAL.learner) == GENERAL


def test_a_setting_out_of_range_is_refused():
    with pytest.raises(RequestError, match="learning_rate = 7"):
        make_recipe(POLE, **{**SMALL, "learning_rate": 7.0})


def test_the_best_of_the_seeds_is_kept_and_the_others_stay(tmp_path):
    steps = []
    found = train_best(
        POLE, make_recipe(POLE, **SMALL), [3, 4], tmp_path / "e.npz", lambda *s: steps.append(s)
    )
    kept = load_values(tmp_path / "e.npz")
    assert kept.digest() == found.values.digest()
    others = {load_values(path).digest() for path in found.folder.iterdir()}
    assert (len(others), kept.digest() in others) == (2, True)
    assert found.best == best(found.judgements)
    assert {seed for seed, _ in steps} == {3, 4}
    assert "the best of seeds 3, 4" in kept.method
