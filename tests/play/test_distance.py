"""Play over a slow connection, and over one that is lost and comes back, in a real browser."""

import numpy as np
import pytest

from qbumpers.play.game import Choice
from qbumpers.play.replaying import replay_file
from tests.play.distance import KEYS, PILOT, begin, far_served, holds_felt, landings, steps_felt

pytestmark = pytest.mark.study

NONE = Choice("none", {})
ROUND_TRIPS = [0.1, 0.2]
EASE = 250.0
"""Milliseconds that a busy machine may add."""


@pytest.fixture
def records(tmp_path):
    return tmp_path / "play.sqlite"


def medians(felt):
    return [float(np.median([each[what] for each in felt])) for what in ("echo", "seen")]


@pytest.mark.parametrize("round_trip", ROUND_TRIPS)
def test_a_key_is_echoed_at_once_and_its_step_is_seen_after_the_round_trip(
    cliff, records, opened, round_trip
):
    with far_served(cliff, NONE, records, round_trip) as far:
        page = opened(far.address, before=PILOT)
        echo, seen = medians(steps_felt(page))
        assert echo < 50 + EASE
        assert 1000 * round_trip < seen < 1000 * round_trip + 50 + EASE
        page.wait_for_selector("#go:visible")
        assert page.inner_text("#return") == "87"


@pytest.mark.parametrize("round_trip", ROUND_TRIPS)
def test_a_key_that_is_held_is_echoed_at_once_and_felt_after_the_round_trip(
    lander, records, opened, round_trip
):
    with far_served(lander, NONE, records, round_trip) as far:
        page = opened(far.address, before=PILOT)
        echo, seen = medians(holds_felt(page, 1))
        assert echo < 50 + EASE
        assert 1000 * round_trip < seen < 1000 * round_trip + 100 + EASE


@pytest.mark.parametrize("round_trip", ROUND_TRIPS)
def test_the_lander_lands_over_a_slow_connection(lander, records, opened, round_trip):
    with far_served(lander, NONE, records, round_trip) as far:
        page = opened(far.address, before=PILOT)
        tries = (landings(page, round_trip, 1)[0]["success"] for _ in range(5))
        assert any(tries)


@pytest.mark.parametrize("round_trip", ROUND_TRIPS)
def test_presses_ahead_of_a_slow_connection_are_not_lost(cliff, records, opened, round_trip):
    with far_served(cliff, NONE, records, round_trip) as far:
        page = opened(far.address)
        begin(page)
        for key in KEYS[:3]:  # faster than answers come
            page.keyboard.press(key)
        reached(page, 3)
        for step, key in enumerate(KEYS[3:], 4):
            page.keyboard.press(key)
            reached(page, step)
        page.wait_for_selector("#go:visible")
        assert page.inner_text("#return") == "87"


def reached(page, step):
    page.wait_for_function(
        "step => Number(document.getElementById('step').textContent) >= step", arg=step
    )


def test_a_network_that_is_lost_and_back_loses_nothing(lander, records, opened):
    with far_served(lander, NONE, records, 0.05) as far:
        page = opened(far.address)
        begin(page)
        page.keyboard.down("ArrowUp")
        reached(page, 20)
        far.cut()
        page.wait_for_selector("#overlay:visible")
        assert page.inner_text("#headline") == "Connection lost"
        assert "trying again" in page.inner_text("#link")
        stopped = int(page.inner_text("#step"))
        page.wait_for_timeout(1000)
        assert int(page.inner_text("#step")) == stopped
        page.keyboard.up("ArrowUp")
        far.mend()
        page.wait_for_selector("#overlay", state="hidden", timeout=20_000)
        reached(page, stopped + 20)
        page.keyboard.press("ArrowDown")
        page.context.close()
    [found] = replay_file(records)
    assert (found.episodes, found.difference) == (1, "")
    assert found.steps > stopped + 20


def test_a_network_that_is_lost_between_turns_goes_on_where_it_was(cliff, records, opened):
    with far_served(cliff, NONE, records, 0.0) as far:
        page = opened(far.address)
        begin(page)
        for step, key in enumerate(KEYS, 1):
            if step == 5:
                far.cut()
                page.wait_for_selector("#overlay:visible")
                page.keyboard.press(key)  # goes nowhere, and is not sent later
                far.mend()
                page.wait_for_selector("#overlay", state="hidden", timeout=20_000)
            page.keyboard.press(key)
            reached(page, step)
        page.wait_for_selector("#go:visible")
        assert page.inner_text("#return") == "87"
        page.context.close()
    assert [found.steps for found in replay_file(records)] == [13]
