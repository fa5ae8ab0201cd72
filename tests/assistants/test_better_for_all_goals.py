import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from qbumpers import make_task, simulate, solve
from qbumpers.assistants.better_for_all_goals import BetterForAllGoalsOptions, better_for_all_goals
from qbumpers.decisions import Decision, Noise
from tests import reference_rules as plain
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import assert_decides, fractions, noises, situation_of, situations

NOISE, OPTIONS = Noise(0.5, 0.5), BetterForAllGoalsOptions()


def of_goals(goals, proposed, **changes):
    situation = situation_of(list(np.mean(goals, axis=0)), proposed, **changes)
    return situation._replace(others=np.array(goals, float))


@st.composite
def situations_with_goals(draw):
    situation = draw(situations())
    rows = st.lists(
        fractions(-2, 2, 2), min_size=len(situation.values), max_size=len(situation.values)
    )
    return situation._replace(others=np.array(draw(st.lists(rows, min_size=1, max_size=3))))


@given(situations_with_goals(), noises)
def test_agrees_with_the_plain_rule(situation, noise):
    expected = plain.better_for_all_goals(situation, noise)
    assert_decides(better_for_all_goals, situation, noise, OPTIONS, expected)


def test_of_what_is_better_for_every_goal_the_best_on_average_is_executed():
    situation = of_goals([[0.0, 1.0, 5.0, 1.0], [0.0, 2.0, 1.0, 1.0]], 0)
    assert better_for_all_goals(situation, NOISE, OPTIONS) == Decision(2, 1.0)
    # Against action 3, the second goal has no better action than 1, and the first none but 2.
    kept = situation._replace(proposed=3)
    assert better_for_all_goals(kept, NOISE, OPTIONS) == Decision(3, 0.0)


def test_what_may_be_right_passes_however_much_is_lost_and_bumpers_end_it():
    goals = [[90.0, 0.0], [0.0, 80.0]]
    situation = of_goals(goals, 1, earned=-80.0, start_value=60.0)
    assert better_for_all_goals(situation, NOISE, OPTIONS) == Decision(1, 0.0)
    assert bumpers(situation, NOISE) == Decision(0, 1.0)


def test_the_hidden_goal_is_reached_with_it_more_often_than_alone_or_by_the_mean():
    """Returns in [-1000, 29] a trial; differences of 20 and more are over 10 standard errors."""
    task = make_task("hidden-goal")
    values = solve(task, others=("goals",))

    def mean_return(assistant):
        found = simulate(task, assistant, values=values, trials=100, episodes=100, seed=1)
        return found.outcomes.assisted_return.mean()

    alone, mean, helped = map(mean_return, ("none", "maximal", "better-for-all-goals"))
    assert helped > alone + 20
    assert helped > mean + 20
