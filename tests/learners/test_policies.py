"""What learners say of their choices against the choices they make.

Bound: of N draws the share of an outcome of probability p errs by sqrt(p (1 - p) / N). It may be
4.5 of these away, which a right learner exceeds in one of 150,000 comparisons; with the seeds fixed
the outcome is always the same. What has probability 0 never happens.
"""

import numpy as np
import pytest

from qbumpers.learners import ExpectedSarsa, Motor, QLearner, Sarsa, dispatch, learners
from qbumpers.learners.interface import Rates, Shape, Transition
from qbumpers.learners.motor import move, moved_policy
from qbumpers.random_streams import trial_streams
from qbumpers.tasks import cliff_walking

DRAWS, STANDARD_ERRORS = 4000, 4.5
STATES, ACTIONS = 4, 4
RATES = Rates(0.3, 1.0)
TABULAR = [kind for kind in learners().values() if kind.built_in and kind.observes == "states"]


def stream():
    return trial_streams(5, {"test": "policies"}, range(1))[0, 0]


def drawn(stream):
    """How many numbers a stream has given: the last word of its state counts them."""
    return int(stream[3])


def memory_of(settings, values):
    memory = dispatch.start(settings, Shape(STATES, 0, (0,) * ACTIONS), stream())
    memory[0][:] = values  # of what it chooses by
    return memory


# A single best action, two of them, all equal, and a best one among negative values.
VALUES = np.array([[1.0, 3.0, 2.0, 0.0], [4.0, 0.0, 4.0, 1.0], [2.0] * 4, [-3.0, -1.0, -2.0, -5.0]])


def assert_shares(chosen, probabilities):
    assert probabilities.sum() == pytest.approx(1, abs=1e-12)
    shares = np.bincount(chosen, minlength=len(probabilities)) / len(chosen)
    error = np.sqrt(probabilities * (1 - probabilities) / len(chosen))
    assert (np.abs(shares - probabilities) <= STANDARD_ERRORS * error + 1e-12).all()


def test_every_learner_that_suits_a_table_is_compared():
    assert {kind.name for kind in TABULAR} == set(cliff_walking().learners)


@pytest.mark.parametrize("state", range(STATES))
@pytest.mark.parametrize("kind", TABULAR, ids=lambda kind: kind.name)
def test_policy_gives_the_probabilities_of_choose(kind, state):
    settings = kind.settings_type()
    memory, probabilities, chances = memory_of(settings, VALUES), np.empty(ACTIONS), stream()
    dispatch.policy(settings, memory, state, RATES, probabilities)
    chosen = [dispatch.choose(settings, memory, state, RATES, chances) for _ in range(DRAWS)]
    assert_shares(chosen, probabilities)


@pytest.mark.parametrize("last", [-1, 2, 3])
@pytest.mark.parametrize("motor", [Motor(0.2, 0.0), Motor(0.0, 0.3), Motor(0.25, 0.4)])
def test_moved_policy_gives_the_probabilities_of_what_the_hand_does(motor, last):
    meant = np.array([0.5, 0.2, 0.3, 0.0])
    expected, chances = np.empty(4), stream()
    moved_policy(motor, meant, last, expected)
    generator = np.random.default_rng(2)
    actions = generator.choice(4, size=DRAWS, p=meant)
    assert_shares([move(motor, int(a), last, 4, chances) for a in actions], expected)
    moved_policy(motor, meant, last, meant)  # in place
    assert np.array_equal(meant, expected)


@pytest.mark.parametrize(
    ("motor", "last", "most"),
    [(None, 2, 0), (Motor(), 2, 0), (Motor(lag=0.5), -1, 0), (Motor(slip=1.0), -1, 2)],
)
def test_a_hand_draws_only_for_what_can_happen(motor, last, most):
    chances = stream()
    before = drawn(chances)
    action = move(motor, 1, last, 4, chances)
    assert drawn(chances) - before == most
    assert (action == 1) == (most == 0)


def test_a_hand_with_a_single_action_cannot_slip():
    assert move(Motor(slip=1.0), 0, -1, 1, stream()) == 0
    out = np.empty(1)
    moved_policy(Motor(slip=1.0), np.ones(1), -1, out)
    assert out.tolist() == [1.0]


# Every value in a state is another, so that a target tells which action it was made of.
TELLING = np.array(
    [[0.0] * 4, [10.0, 20.0, 30.0, 40.0], [5.0, 6.0, 7.0, 8.0], [1.0, 2.0, 3.0, 4.0]]
)


def taught(settings=Sarsa(discount=0.5), **changes):  # noqa: B008
    """A learner after one step from state 0 to state 1, by action 2, for a reward of -1."""
    memory, chances = memory_of(settings, TELLING), stream()
    transition = Transition(0, 2, -1.0, 1, False, -1)._replace(**changes)
    dispatch.learn(settings, memory, transition, RATES, chances)
    return settings, memory, chances


def next_of(settings, memory, state, chances):
    """The next choice, and how many numbers were drawn for it."""
    before = drawn(chances)
    action = dispatch.choose(settings, memory, state, RATES, chances)
    return action, drawn(chances) - before


@pytest.mark.parametrize("epsilon", [0.0, 1.0])
def test_sarsa_chooses_next_the_action_that_it_learned_from(epsilon):
    settings, chances, seen = Sarsa(discount=0.5), stream(), set()
    for _ in range(40):
        memory = memory_of(settings, TELLING)
        transition = Transition(0, 2, -1.0, 1, False, -1)
        dispatch.learn(settings, memory, transition, Rates(epsilon, 1.0), chances)
        learned_from = TELLING[1].tolist().index((memory.values[0, 2] + 1.0) / 0.5)
        assert next_of(settings, memory, 1, chances) == (learned_from, 0)
        seen.add(learned_from)
    assert seen == ({3} if epsilon == 0 else {0, 1, 2, 3})


def test_sarsa_chooses_anew_in_a_new_episode():
    settings, memory, chances = taught()
    dispatch.begin(settings, memory, 1, 10)
    assert next_of(settings, memory, 1, chances)[1] == 2


def test_sarsa_chooses_anew_after_a_step_from_which_it_did_not_learn():
    settings, memory, chances = taught()
    assert next_of(settings, memory, 1, chances)[1] == 0
    assert next_of(settings, memory, 1, chances)[1] == 2


def test_sarsa_chooses_anew_if_the_state_is_another():
    settings, memory, chances = taught()
    assert next_of(settings, memory, 0, chances)[1] == 2
    assert next_of(settings, memory, 1, chances)[1] == 2  # the old choice is gone


@pytest.mark.parametrize("action", range(4))
def test_sarsa_learns_from_the_next_action_that_a_record_tells(action):
    _, memory, chances = taught(next_action=action)
    assert memory.values[0, 2] == -1.0 + 0.5 * TELLING[1, action]
    assert drawn(chances) == drawn(stream())


@pytest.mark.parametrize("kind", [QLearner, Sarsa, ExpectedSarsa])
def test_nothing_follows_an_end(kind):
    _, memory, chances = taught(kind(discount=0.5), terminated=True)
    assert memory.values[0, 2] == -1.0
    assert drawn(chances) == drawn(stream())


@pytest.mark.parametrize("kind", [QLearner, ExpectedSarsa])
def test_off_policy_targets_are_the_best_and_the_expected_value(kind):
    settings, memory, chances = taught(kind(discount=0.5))
    probabilities = np.empty(ACTIONS)
    dispatch.policy(settings, memory, 1, RATES, probabilities)
    worth = {QLearner: 40.0, ExpectedSarsa: float(probabilities @ TELLING[1])}[kind]
    assert memory.values[0, 2] == pytest.approx(-1.0 + 0.5 * worth, abs=1e-12)
    assert drawn(chances) == drawn(stream())
