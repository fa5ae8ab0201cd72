"""A game is a fold of what was proposed, and does what the task and the rule do by themselves."""

import numpy as np
import pytest

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.play.game import Choice, Game, Played, differing, resumed
from qbumpers.play.setup import Setup
from qbumpers.play.stepping import TabularStepper
from qbumpers.tasks.dynamics import LIMIT, SUCCESS, TERMINATED
from tests.narrowing import present
from tests.play.serving import AROUND, DOWN, RIGHT, UP

BUMPERS = Choice("stochastic-q-bumpers", {"alpha": 0.5})
UNASSISTED = BUMPERS._replace(assisted=False)


def played(game, choice, actions):
    game.begin(choice)
    return Played(choice, [game.propose(action) for action in actions])


def test_the_way_around_the_cliff_earns_what_it_should(cliff):
    game = Game(cliff, seed=1)
    steps = played(game, UNASSISTED, AROUND).steps
    assert [step.state for step in steps] == [36, *range(24, 36)]
    assert game.episodes[0].total == 87 == 100 - 13
    assert int(steps[-1].events) == TERMINATED | SUCCESS
    assert (game.episodes[0].success, game.episodes[0].over, game.playing) == (True, True, False)


def test_nobody_helps_who_is_not_to_and_maximal_help_leaves_no_mistake(cliff):
    game = Game(cliff, seed=1)
    fallen = played(game, UNASSISTED, [RIGHT]).steps
    assert (fallen[0].executed, fallen[0].overridden) == (RIGHT, False)
    game = Game(cliff, seed=1)
    helped = played(game, Choice("maximal", {}), [RIGHT] * 12 + [UP]).steps
    assert [step.executed for step in helped] == AROUND
    assert game.episodes[0].overrides == 2


def test_a_task_of_vectors_moves_as_its_stepper_does(lander):
    game = Game(lander, seed=1)
    steps = played(game, UNASSISTED, [2, 1, 3, 0, 2] * 10).steps
    stepper = lander.task.make_stepper()
    state = stepper.reset(0.0)
    for step in steps:
        np.testing.assert_array_equal(step.state, state)
        state, reward, events = stepper.step(int(step.proposed))
        assert (step.reward, step.events) == (reward, events)
        np.testing.assert_array_equal(step.next_state, state)


def test_an_episode_ends_at_its_limit(cliff):
    setup = Setup("FrozenLake-v1", discount=0.9, episode_limit=3)
    game = Game(setup, seed=1)
    steps = played(game, Choice("none", {}), [0, 0, 0]).steps  # left, on ice: no hole within 3
    assert [int(step.events) & LIMIT for step in steps] == [0, 0, LIMIT]


@pytest.mark.parametrize("choice", [BUMPERS, Choice("expert-mixing", {"decay": 0.5})])
def test_a_record_leads_to_the_same_game(cliff, choice):
    game, keys = Game(cliff, seed=5), np.random.default_rng(0)
    log = []
    for episode in range(4):
        who = choice if episode % 2 else UNASSISTED
        game.begin(who)
        steps = []
        while game.playing and len(steps) < (20 if episode == 3 else 500):
            steps.append(game.propose(int(keys.integers(4))))
        log.append(Played(who, steps))
    again = resumed(cliff, 5, log)
    assert again.episodes == game.episodes
    assert (again.number, again.state) == (game.number, game.state)
    for _ in range(30):
        if not game.playing:
            break
        action = int(keys.integers(4))
        assert differing(again.propose(action), game.propose(action)) == ""


def test_a_record_of_something_else_is_refused(cliff):
    game = Game(cliff, seed=5)
    game.begin(BUMPERS)
    steps = [game.propose(UP) for _ in range(3)]
    wrong = [*steps[:2], steps[2]._replace(reward=7.0)]
    with pytest.raises(RequestError, match=r"step 2 of the session: reward is -1\.0, recorded 7"):
        resumed(cliff, 5, [Played(BUMPERS, wrong)])


def test_what_comes_at_the_wrong_time_is_refused(cliff):
    game = Game(cliff, seed=1)
    with pytest.raises(RequestError, match="no episode is going on"):
        game.propose(UP)
    game.begin(BUMPERS)
    with pytest.raises(RequestError, match="the episode before has not ended"):
        game.begin(BUMPERS)
    with pytest.raises(RequestError, match=r"proposed = 4; it must lie in \[0, 4\)"):
        game.propose(4)
    assert game.number == 0


def test_an_undone_step_leaves_the_state(cliff):
    game = Game(cliff, seed=1)
    [step] = played(game, Choice("undo", {}), [RIGHT]).steps
    assert (step.undone, step.reward, game.state) == (True, -100.0, 36)
    assert game.propose(UP).next_state == 24


def test_a_hidden_goal_is_hidden_from_the_assistant_only():
    setup = Setup("hidden-goal")
    game = Game(setup, seed=1)
    [step] = played(game, Choice("maximal", {}), [DOWN]).steps
    assert step.next_state == int(present(setup.task.seen)[game.state])
    assert step.next_state != game.state


def test_chance_of_a_table_comes_out_as_often_as_it_should():
    task = qbumpers.make_task("frozen-lake")
    stepper = TabularStepper(task.dynamics())
    found = []
    for episode in range(3000):
        assert stepper.reset(episode / 3000) == 0
        found.append(stepper.step(1)[0])  # down slips to the left and to the right as often
    counts = np.bincount(found, minlength=5) / 3000
    np.testing.assert_allclose(counts[[0, 1, 4]], 1 / 3, atol=0.04)
