"""Likelihoods against the same computed in plain Python, and particles against every coin."""

import itertools
import math

import numpy as np
import pytest

from qbumpers import RequestError, make_assistant
from qbumpers.fitting import Likelihood, choices_of, make_candidate
from qbumpers.fitting.parameters import with_values
from qbumpers.learners import Motor, Perception, perception
from qbumpers.learners.interface import Shape
from tests.fitting.plain import greedy_shares, log_likelihoods, rows_of, softmax_shares
from tests.fitting.records import EPSILON, RATE, bandit, part, walked

SHAPE = Shape(48, 0, (0,) * 4)
NUMBERS = {"epsilon": EPSILON, "learning_rate": RATE, "lapse": 0.0}


def likelihood_of(learner, seen, steps, fixed, particles=100):
    candidate = make_candidate(learner, seen, fixed=fixed)
    return Likelihood(candidate, choices_of(steps, "participant"), SHAPE, 10, particles)


def own(likelihood, repeat=0):
    return likelihood.log_probabilities(likelihood.candidate.stack, repeat)


@pytest.mark.parametrize("lapse", [0.0, 0.1])
@pytest.mark.parametrize("seen", ["transition", "observant", "interruption", "disruption"])
def test_proposals_of_q_learning_are_as_likely_as_plain_python_says(seen, lapse):
    steps = walked("q-learning", seen)
    assert steps.overridden.any()
    found = likelihood_of("q-learning", seen, steps, {**NUMBERS, "lapse": lapse})
    expected = log_likelihoods(
        steps, perception(seen), rate=RATE, shares=lambda v: greedy_shares(v, EPSILON), lapse=lapse
    )
    assert own(found) == pytest.approx(expected, abs=1e-9)
    assert not found.hidden


def test_proposals_of_softmax_q_learning_are_as_likely_as_plain_python_says():
    steps = walked("softmax-q-learning")
    fixed = {"learning_rate": RATE, "inverse_temperature": 1.0, "lapse": 0.0, "discount": 0.9}
    found = likelihood_of("softmax-q-learning", "transition", steps, fixed)
    expected = log_likelihoods(
        steps, perception("transition"), rate=RATE, shares=lambda v: softmax_shares(v, 1.0),
        discount=0.9,
    )  # fmt: skip
    assert own(found) == pytest.approx(expected, abs=1e-9)


def without_cut_end(steps):
    """A record up to its first episode that was cut, in which nothing of a SARSA is hidden."""
    lasts = np.flatnonzero(np.diff(steps.episode, append=-1))
    cut = [last for last in lasts if not steps.events[last] & 1]
    return part(steps, int(cut[0])) if cut else steps


def test_a_learner_of_sarsa_chose_its_next_action_before_it_learned():
    steps = without_cut_end(walked("sarsa"))
    assert (steps.state == steps.next_state).sum() > 10  # at a wall: where the order matters
    expected = log_likelihoods(
        steps, perception("transition"), rate=RATE, on_policy=True,
        shares=lambda v: greedy_shares(v, EPSILON),
    )  # fmt: skip
    found = likelihood_of("sarsa", "transition", steps, NUMBERS)
    assert own(found) == pytest.approx(expected, abs=1e-9)
    assert not found.hidden


def test_a_lapse_is_any_action_and_a_slip_another_one():
    steps = part(walked("q-learning"), 1)  # all values are equal
    for fixed in ({"lapse": 0.3}, {"lapse": 0.0, "motor.slip": 0.3}):
        found = likelihood_of("q-learning", "transition", steps, {"epsilon": 0.0, **fixed})
        assert own(found) == pytest.approx([math.log(1 / 4)])
    steps = bandit([0, 0, 1])
    found = Likelihood(
        make_candidate(
            "q-learning", "transition",
            fixed={"epsilon": 0.0, "learning_rate": 1.0, "lapse": 0.0, "motor.slip": 0.3},
        ),
        choices_of(steps, "participant"), Shape(1, 0, (0, 0)), 3,
    )  # fmt: skip
    assert own(found) == pytest.approx([math.log(0.5), math.log(0.7), math.log(0.3)])


def test_a_repeated_action_of_a_lagging_hand_is_likelier():
    steps = walked("q-learning")
    found = likelihood_of("q-learning", "transition", steps, {**NUMBERS, "motor.lag": 0.4})
    still = likelihood_of("q-learning", "transition", steps, NUMBERS)
    same = np.r_[False, (np.diff(steps.proposed) == 0) & (np.diff(steps.episode) == 0)]
    first = np.r_[True, np.diff(steps.episode) > 0]
    expected = np.where(first, np.exp(own(still)), 0.6 * np.exp(own(still)) + 0.4 * same)
    assert np.exp(own(found)) == pytest.approx(expected)


def test_what_could_not_be_has_no_likelihood_and_the_rest_keeps_its_own():
    steps = bandit([0, 1, 0])
    candidate = make_candidate(
        "q-learning", "transition", fixed={"epsilon": 0.0, "learning_rate": 1.0, "lapse": 0.0}
    )
    found = Likelihood(candidate, choices_of(steps, "p"), Shape(1, 0, (0, 0)), 3)
    assert own(found).tolist() == [math.log(0.5), -np.inf, 0.0]


def every_coin(steps, seen):
    """The likelihood of a record by enumeration of what was noticed."""
    overridden = [bool(row.overridden) for row in rows_of(steps)]
    total = 0.0
    for noticed in itertools.product([False, True], repeat=sum(overridden)):
        chance = math.prod(seen.notices if each else 1 - seen.notices for each in noticed)
        found = log_likelihoods(
            steps, seen, rate=RATE, shares=lambda v: greedy_shares(v, EPSILON), noticed=noticed
        )
        total += chance * math.exp(sum(found))
    return total


def test_particles_agree_with_the_enumeration_of_every_coin():
    seen = Perception(0.4, "executed")
    steps = walked("q-learning", seen, 3)
    steps = part(steps, int(np.flatnonzero(np.cumsum(steps.overridden) == 8)[0]) + 12)
    exact = every_coin(steps, seen)
    found = likelihood_of("q-learning", seen, steps, NUMBERS, particles=50)
    repeats = np.array([math.exp(own(found, r).sum()) / exact for r in range(1, 41)])
    assert found.hidden
    error = repeats.std(ddof=1) / math.sqrt(len(repeats))
    assert 0 < error < 0.1
    assert abs(repeats.mean() - 1) < 4 * error


def test_a_learner_that_notices_all_or_nothing_needs_no_particles():
    steps = walked("q-learning", "observant")
    for notices, seen in ((0.0, "transition"), (1.0, "observant")):
        stated = likelihood_of("q-learning", Perception(notices, "executed"), steps, NUMBERS)
        assert (
            own(stated).tolist() == own(likelihood_of("q-learning", seen, steps, NUMBERS)).tolist()
        )
        assert not stated.hidden


def test_a_cut_episode_hides_what_a_learner_of_sarsa_meant_to_do_next():
    steps = walked("q-learning")
    last = int(np.flatnonzero(np.diff(steps.episode) > 0)[1])
    cut = steps._replace(events=np.where(np.arange(len(steps.episode)) == last, 16, steps.events))
    found = likelihood_of("sarsa", "transition", cut, NUMBERS)
    own(found)
    assert found.hidden


def test_what_a_record_does_not_say_is_refused():
    sarsa = likelihood_of("sarsa", "transition", walked("q-learning"), NUMBERS)
    stack = sarsa.candidate.stack
    with pytest.raises(RequestError, match=r"motor: learner sarsa chooses its next action"):
        sarsa.log_probabilities(stack._replace(motor=Motor(0.1, 0.0)))
    undone = walked("q-learning", assistant=make_assistant("undo", tolerance=20.0))
    assert undone.undone.any()
    with pytest.raises(RequestError, match=r"perception = 'observant'; steps were undone"):
        likelihood_of("q-learning", "observant", undone, NUMBERS)
    found = likelihood_of("q-learning", "transition", undone, NUMBERS)
    expected = log_likelihoods(
        undone, perception("transition"), rate=RATE, shares=lambda v: greedy_shares(v, EPSILON)
    )
    assert own(found) == pytest.approx(expected, abs=1e-9)


def test_a_changed_number_changes_the_likelihood():
    found = likelihood_of("q-learning", "transition", walked("q-learning"), NUMBERS)
    other = with_values(found.candidate.stack, {"epsilon": 0.9})
    assert found.log_probabilities(other).sum() < own(found).sum()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"state": np.zeros((3, 2), np.float32)}, "participant 7: states are not numbered"),
        (
            {"proposed": np.array([0, 2, 0])},
            r"participant 7: proposed = 2; it must lie in \[0, 2\)",
        ),
        ({"state": np.array([0, -1, 0])}, "participant 7: state = -1; it must be 0 or more"),
        ({"episode": np.array([0, 2, 1])}, "participant 7: episodes are out of order"),
        ({"reward": np.array([0, np.nan, 1])}, "participant 7: every reward must be finite"),
    ],
)
def test_damaged_records_are_named(changes, message):
    with pytest.raises(RequestError, match=message):
        choices_of(bandit([0, 1, 0])._replace(**changes), "participant 7")
