"""Three minutes of `make soak`, and that it would notice."""

import pytest

from qbumpers.play.game import Choice, Game
from qbumpers.play.tables import Moment
from tests.play.serving import AROUND
from tests.play.soak import STORES, Page, held, soak


@pytest.mark.slow
@pytest.mark.parametrize("kind", STORES)
def test_nothing_is_lost_or_doubled_whatever_fails(kind):
    line, found = soak(kind, 1.5)
    assert found == [], line


@pytest.fixture
def log(cliff):
    """A page that pressed its way around the cliff, and what is recorded of it."""
    page, game = Page([], 0), Game(cliff, 0)
    game.begin(Choice("none", {}))
    steps = [game.propose(action) for action in AROUND]
    for number, step in enumerate(steps):
        page.sent[number] = {float(number): step.proposed}
        page.seen[number] = (step.proposed, step.executed, step.overridden, step.reward)
    return (
        page,
        steps,
        [Moment("keyboard", 0.0, float(number), 0.0, 0.0) for number in range(len(steps))],
    )


def test_a_log_that_agrees_is_no_problem(log):
    assert list(held(*log)) == []


def test_a_step_that_was_shown_and_is_not_there_is_noticed(log):
    page, steps, times = log
    assert list(held(page, steps[:-1], times[:-1])) == ["step 12 was shown, and is lost"]


def test_a_press_that_is_there_twice_is_noticed(log):
    page, steps, times = log
    found = list(held(page, [*steps, steps[-1]], [*times, times[-1]]))
    assert found == [
        "press 12.0 is recorded 2 times",
        "step 13: press 12.0 was not sent for it",
    ]


def test_a_step_that_was_shown_as_another_is_noticed(log):
    page, steps, times = log
    changed = [*steps[:3], steps[3]._replace(reward=7.0), *steps[4:]]
    [found] = held(page, changed, times)
    assert found == (
        "step 3 was shown as (1, 1, False, -1.0), and is recorded as (1, 1, False, 7.0)"
    )
