"""Every assistant has settings, as many as the others, that its options allow."""

import numpy as np
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.assistants.registry import assistants, registered
from qbumpers.comparison.methods import (
    ANCHORS,
    BASELINE,
    METHODS,
    SETTINGS,
    check_names,
    unsuited,
)
from qbumpers.comparison.scales import Scales
from qbumpers.errors import RequestError
from qbumpers.simulation import make_condition
from qbumpers.tasks import TabularTask, make_task
from tests.narrowing import of_kind

TASKS = ("cliff-walking", "frozen-lake", "random-mdp", "taxi", "inventory", "hidden-goal")


@pytest.fixture(scope="module")
def scales():
    return {name: Scales(of_kind(TabularTask, make_task(name)), 100) for name in TASKS}


def test_every_assistant_of_the_package_is_compared():
    built_in = {name for name, rule in assistants().items() if rule.built_in}
    assert set(METHODS) == built_in - set(ANCHORS)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_has_as_many_settings_as_the_others_on_some_task(name, scales):
    counts = [
        len(METHODS[name].settings(each)) for each in scales.values() if not unsuited(name, each)
    ]
    has_options = registered(name).options_type._fields
    assert max(counts) == (SETTINGS if has_options else 1)
    assert min(counts) >= 1


@pytest.mark.parametrize("name", METHODS)
def test_settings_are_allowed_and_no_two_are_equal(name, scales):
    carried = [each for each in scales.values() if not unsuited(name, each)]
    assert carried
    for each in carried:
        made = [make_assistant(name, **options) for options in METHODS[name].settings(each)]
        for assistant in made:
            make_condition(each.task, assistant)
        assert len({repr(assistant.options) for assistant in made}) == len(made)


@pytest.mark.parametrize(
    ("name", "task", "reason"),
    [
        ("accept-or-reject", "cliff-walking", "no_op"),
        ("closest-acceptable", "cliff-walking", "distance"),
        ("shield", "taxi", "announces no crash"),
        ("risk-and-novelty", "inventory", "announces no success"),
        ("trajectory-bumpers", "taxi", "300 states"),
        ("trajectory-bumpers", "hidden-goal", "what the assistant sees"),
        ("learner-aware-bumpers", "hidden-goal", "what the assistant sees"),
        ("better-for-all-goals", "taxi", "sees all"),
        ("closest-acceptable-unknown-goal", "hidden-goal", ""),
        ("undo", "cliff-walking", ""),
        ("accept-or-reject", "inventory", ""),
    ],
)
def test_a_task_that_lacks_something_is_told(name, task, reason, scales):
    found = unsuited(name, scales[task])
    assert reason in found
    assert bool(found) == bool(reason)


def test_the_rooms_of_bumpers_are_multiples_of_the_spread_of_values(scales):
    options = METHODS[BASELINE].settings(scales["cliff-walking"])
    rooms = [each["alpha"] * (87 - each["v_min"]) for each in options]
    assert np.array(rooms) / 112 == pytest.approx(np.geomspace(1 / 32, 32, SETTINGS), rel=1e-5)
    # Both sides of the paper's alpha = 1 and v_min = 0, whose room is 87.
    assert min(rooms) < 87 < max(rooms)


def test_an_unknown_assistant_is_named():
    with pytest.raises(RequestError, match="unknown assistant to compare 'bumpers'"):
        check_names(["bumpers"])
