"""The time left of a run: as expected at first, then as its trials have taken."""

import contextlib

import pytest

from qbumpers.cli.progress import Before, TrialProgress, rate, time_left
from qbumpers.experiments.run import RunProgress


def test_before_the_first_trial_it_is_the_expected_time():
    assert time_left(Before(0, 600.0), 0, 10, 30.0) == 600.0
    assert time_left(Before(4, 600.0), 4, 10, 0.0) == 600.0


def test_finished_trials_correct_what_was_expected():
    """Ten times as slow as expected: more and more of it shows."""
    left = [time_left(Before(0, 100.0), n, 100, 10.0 * n) for n in (1, 4, 96)]
    assert left[0] == pytest.approx((0.8 * 1 + 0.2 * 10) * 99)
    assert left[1] == pytest.approx((0.5 * 1 + 0.5 * 10) * 96)
    assert left[2] == pytest.approx((0.04 * 1 + 0.96 * 10) * 4)


def test_trials_that_were_there_before_tell_nothing_about_the_speed():
    fresh = time_left(Before(0, 100.0), 10, 50, 20.0)
    assert time_left(Before(40, 100.0), 50, 90, 20.0) == fresh


def test_at_the_end_nothing_is_left():
    assert time_left(Before(2, 5.0), 10, 10, 50.0) == 0
    assert time_left(Before(10, 0.0), 10, 10, 0.0) == 0


def test_a_race_tells_the_time_from_its_first_trials_on():
    assert time_left(Before(0, None), 0, 10, 5.0) is None
    assert time_left(Before(0, None), 2, 10, 5.0) == 20.0


@pytest.mark.parametrize(
    ("steps", "text"),
    [(0, ""), (30_000, "3,000 steps per second"), (41_000_000, "4.1 million steps per second")],
)
def test_a_rate_is_told_in_the_unit_that_suits_it(steps, text):
    assert rate(steps, 10.0) == text


def test_the_bar_of_a_race_that_ends_early_ends_at_its_end(capsys):
    with TrialProgress("racing", lambda progress: None) as bar:
        first = RunProgress(trials=0, of=40, steps=0, expected=1.0, damaged=[], changed=[])
        bar.show(first)
        bar.show(first._replace(trials=9, steps=100))
    assert "9 of 9 trials" in capsys.readouterr().out


def test_a_bar_that_is_stopped_stays_where_it_is(capsys):
    first = RunProgress(trials=1, of=40, steps=0, expected=1.0, damaged=[], changed=[])
    with contextlib.suppress(EOFError), TrialProgress("racing", lambda progress: None) as bar:
        bar.show(first)
        raise EOFError
    assert "1 of 40 trials" in capsys.readouterr().out


def test_the_bar_shows_trials_the_rate_and_the_time_left(capsys):
    announced = []
    first = RunProgress(trials=0, of=4, steps=0, expected=7200.0, damaged=[], changed=[])
    with contextlib.suppress(EOFError), TrialProgress("simulating", announced.append) as bar:
        bar.show(first)
        bar.show(first._replace(trials=1, steps=500_000))
        raise EOFError  # or the bar would go on to its end
    assert announced == [first]
    shown = capsys.readouterr().out
    assert "1 of 4 trials" in shown
    assert "left" in shown
