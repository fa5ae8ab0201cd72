"""Advice on a budget, step by step in two states, one of which is important."""

import pytest

from qbumpers import RequestError, make_assistant
from qbumpers.decisions import Decision, Noise
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import model_of, situation_of, step_of

NOISE = Noise(0.5, 0.5)
BAD, BEST = 0, 2
IMPORTANT = situation_of([-13.0, 92.0, 94.0], BAD, start_value=87.0)  # I(s) = 107
TRIFLING = situation_of([92.0, 92.5, 94.0], BAD, start_value=87.0)._replace(state=3)  # I(s) = 2


def advised(when, steps, **options):
    """In which of the steps (situation, proposed) the best action was executed by advice."""
    given = {"budget": 100, "threshold": 50.0, **options}
    assistant = make_assistant("advice-on-a-budget", when=when, **given)
    memory, found = assistant.start(model_of()), []
    for situation, proposed in steps:
        moment = situation._replace(proposed=proposed)
        decision = assistant.decide(moment, NOISE, memory)
        assert decision in (Decision(proposed, 0.0), Decision(BEST, 1.0))
        found.append(decision.probability == 1)
        memory = assistant.observe(memory, step_of(moment, decision.action))
    return found, memory.spent


@pytest.mark.parametrize(
    ("when", "expected", "spent"),
    [
        # Bad, bad, best and bad in the important state, then bad, bad in the trifling one.
        ("early", [True, True, False, True, True, True], 6),
        ("alternating", [True, False, False, False, True, False], 3),
        ("importance", [True, True, False, True, False, False], 4),
        ("mistakes", [True, True, False, True, False, False], 3),
        ("predictive", [False, True, False, False, False, False], 2),
        ("jointly", [True, False, False, True, False, False], 2),
    ],
)
def test_when_advice_is_given_and_when_it_costs(when, expected, spent):
    steps = [
        (IMPORTANT, BAD), (IMPORTANT, BAD), (IMPORTANT, BEST), (IMPORTANT, BAD), (TRIFLING, BAD),
        (TRIFLING, BAD),
    ]  # fmt: skip
    # After bad, bad, best the most frequent proposal has a share of two thirds.
    assert advised(when, steps, sure=0.75) == (expected, spent)


@pytest.mark.parametrize(
    ("when", "expected"),
    [
        ("early", [False, True, False, False]),
        ("importance", [False, True, False, False]),
        ("mistakes", [False, True, False, True]),
    ],
)
def test_the_budget_is_spent_on_good_proposals_too_but_for_mistakes(when, expected):
    steps = [(IMPORTANT, BEST), (IMPORTANT, BAD), (IMPORTANT, BEST), (IMPORTANT, BAD)]
    assert advised(when, steps, budget=2) == (expected, 2)


@pytest.mark.parametrize(("every", "expected"), [(1, "1111111"), (3, "1001001"), (9, "1000000")])
def test_alternating_advice_is_given_in_every_mth_step(every, expected):
    found, spent = advised("alternating", [(TRIFLING, BAD)] * 7, every=every)
    assert found == [number == "1" for number in expected]
    assert spent == sum(found)


def test_importance_is_above_the_threshold():
    assert advised("importance", [(IMPORTANT, BAD)], threshold=106.75)[0] == [True]
    assert advised("importance", [(IMPORTANT, BAD)], threshold=107.0)[0] == [False]


def test_a_predicted_mistake_is_the_last_proposal_of_the_same_state():
    steps = [
        (IMPORTANT, BAD),
        (TRIFLING, BEST),
        (IMPORTANT, BEST),
        (IMPORTANT, BAD),
        (IMPORTANT, 1),
    ]
    # Predicted in the third step, where it costs though the learner is right, and in the fifth.
    assert advised("predictive", steps) == ([False, False, False, False, True], 2)


def test_a_learner_asks_while_no_proposal_has_the_share():
    steps = [(IMPORTANT, action) for action in (0, 1, 0, 0, 1)]
    # Shares of the most frequent one before each step: none yet, 1, 1/2, 2/3, 3/4.
    assert advised("jointly", steps, sure=0.75)[0] == [True, False, True, True, False]


def test_a_fall_after_the_budget_and_a_trifle_before_it_unlike_with_bumpers():
    found, _ = advised("early", [(TRIFLING, BAD), (IMPORTANT, BAD)], budget=1)
    assert found == [True, False]
    assert bumpers(TRIFLING, NOISE).action == BAD
    assert bumpers(IMPORTANT, NOISE) == Decision(BEST, 1.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"when": "late"}, "when = 'late'.*'early', 'alternating'"),
        ({"budget": -1}, "budget = -1"),
        ({"every": 0}, "every = 0"),
        ({"threshold": -1.0}, "threshold = -1.0"),
        ({"sure": 1.5}, "sure = 1.5"),
    ],
)
def test_options_have_bounds(options, message):
    given = {"when": "early", "budget": 3, **options}
    with pytest.raises(RequestError, match=f"assistant advice-on-a-budget: {message}"):
        make_assistant("advice-on-a-budget", **given)
