"""What can be played, with whom."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Game
from qbumpers.play.offers import offers
from qbumpers.play.setup import Setup, setup_of
from qbumpers.play.views import floor_of, state_view, task_view
from qbumpers.tasks.registry import task_names


@pytest.mark.parametrize("name", sorted(set(task_names()) - {"remapped"}))
def test_every_task_of_the_package_can_be_played(name):
    setup = Setup(name)
    game = Game(setup, 3)
    game.begin(Choice("none", {}))
    view, state = task_view(setup), state_view(game)
    assert set(view["keys"].values()) <= set(range(setup.task.actions))
    assert len(view["actions"]) == setup.task.actions
    assert state["words"]
    assert len(state["view"]["values"]) == setup.task.actions
    assert setup_of(setup.description).difference(setup.description) == ""


@pytest.mark.parametrize("name", ["cliff-walking", "lunar-lander", "hidden-goal", "inventory"])
def test_every_assistant_that_is_offered_plays_as_the_form_begins(name):
    setup = Setup(name)
    found = offers(setup)
    assert {"maximal", "stochastic-q-bumpers", "fading"} <= {offer["name"] for offer in found}
    assert "none" not in {offer["name"] for offer in found}
    for offer in found:
        given = {f["name"]: f["default"] for f in offer["options"] if f["default"] is not None}
        game = Game(setup, 3)
        game.begin(Choice(offer["name"], given))
        for _ in range(3):
            game.propose(0)


def test_a_form_knows_the_bounds_of_options():
    [offer] = [each for each in offers(Setup("cliff-walking")) if each["name"] == "hard-bumpers"]
    by_name = {field["name"]: field for field in offer["options"]}
    assert by_name["alpha"] == {
        "name": "alpha", "needed": True, "kind": "number", "whole": False, "least": 0, "most": 1,
        "default": 0.5,
    }  # fmt: skip
    assert by_name["second"]["kind"] == "flag"
    assert by_name["v_min"]["least"] is None


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("cliff-waking", {}, r"did you mean 'cliff-walking'\?"),
        ("CartPole-v1", {"discount": 0.99}, "no expert ships for task 'CartPole-v1'.*--values"),
        ("Acrobot-v1", {"discount": 0.99}, "Acrobot-v1: it does not say how it is shown"),
        ("cliff-walking", {"values": "absent.npz"}, "absent.npz"),
    ],
)
def test_what_cannot_be_played_is_refused_in_one_line(name, arguments, message):
    with pytest.raises(RequestError, match=message) as refused:
        Setup(name, **arguments)
    assert "\n" not in str(refused.value)


def test_the_floor_is_that_of_the_rule_below(cliff):
    game = Game(cliff, 0)
    options = {"half_life": 5, "of": {"name": "stochastic-q-bumpers", "alpha": 0.25, "v_min": 7}}
    game.begin(Choice("fading", options))
    assert game.session is not None
    assert floor_of(game.session.assistant, 87.0) == 87 - 0.25 * (87 - 7)
    game = Game(cliff, 0)
    game.begin(Choice("maximal", {}))
    assert game.session is not None
    assert floor_of(game.session.assistant, 87.0) is None


def test_values_of_another_kind_change_what_a_record_hangs_on(cliff):
    other = {**cliff.description, "values digest": "0" * 64}
    assert "another values digest of task cliff-walking" in cliff.difference(other)
