"""A session without any host: against the wrapper and the simulator, and its replay."""

import numpy as np
import pytest

from qbumpers import RequestError, make_assistant, register_assistant
from qbumpers.decisions import Decision, Model, Noise, Step
from qbumpers.session import ReplayError, Session, noise_of, replay, rows_of
from qbumpers.simulation import record
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.dynamics import LIMIT, SUCCESS, TERMINATED, TRUNCATED
from tests.assistants.own_rules import ABOVE_THE_GOAL, NoOptions, never_arrive
from tests.narrowing import present
from tests.shared_control_examples import CLIFF, DOWN, RIGHT, UP, bumpers, walking
from tests.simulation.conditions import BUMPERS, on_the_cliff, taken_back

START, GOAL = 36, 47
MODEL = Model(48, 0, 4, -1, 1.0, None, 1 - np.eye(4))
HALF = Noise(0.5, 0.5)


class Walker:
    """Cliff Walking written down once more: 4 rows, 12 columns, the cliff in the last row."""

    def reset(self):
        self.state, self.steps = START, 0
        return self.state

    def step(self, action):
        row, column = divmod(self.state, 12)
        row = min(max(row + (-1, 0, 1, 0)[action], 0), 3)
        column = min(max(column + (0, 1, 0, -1)[action], 0), 11)
        self.state, reward, events = 12 * row + column, -1.0, 0
        if row == 3 and 0 < column < 11:
            self.state, reward, events = START, -100.0, 4
        if self.state == GOAL:
            reward, events = 99.0, TERMINATED | SUCCESS
        return self.state, reward, events

    def snapshot(self):
        return self.state

    def restore(self, snapshot):
        self.state = snapshot


def session_of(assistant, values=CLIFF, perceived="transition"):
    return Session(assistant, values, MODEL, perceived)


def bumpers_session(**settings):
    return session_of(make_assistant(BUMPERS[0], **BUMPERS[1]), **settings)


def assert_equal_steps(found, expected):
    for field in Step._fields:
        assert np.array_equal(getattr(found, field), getattr(expected, field)), field


@pytest.mark.parametrize("perceived", ["transition", "observant", "interruption"])
def test_a_session_keeps_the_records_of_the_wrapper(perceived):
    environment = walking(**bumpers(second=True), perception=perceived)
    session = bumpers_session(perceived=perceived)
    generator, overridden = np.random.default_rng(0), 0
    environment.reset(seed=4)
    for _ in range(4):
        (state, _), ended = environment.reset(), False
        session.begin(state)
        while not ended:
            proposed = int(generator.integers(4))
            _, reward, terminated, truncated, info = environment.step(proposed)
            shown = Step(**info["assistance"])
            decision = session.decide(proposed, Noise(shown.coin, shown.tie))
            assert (decision.action, decision.probability) == (shown.executed, shown.probability)
            step = session.record(reward, shown.next_state, shown.events)
            # The wrapper was reset once more, before the first of these episodes.
            assert_equal_steps(step._replace(episode=step.episode + 1), shown)
            overridden += step.overridden
            ended = terminated or truncated
            assert (session.values_now is None) == ended
    assert overridden > 20


@pytest.mark.parametrize("stepper", [None, Walker()], ids=["by the record", "at the task"])
def test_a_replay_comes_to_what_the_simulator_recorded(stepper):
    steps = record(on_the_cliff(BUMPERS, perception="observant"), trial=1, seed=3)
    assert {bool(events & LIMIT) for events in steps.events} == {True, False}
    assert steps.overridden.any()
    count = replay(bumpers_session(perceived="observant"), stepper, steps)
    assert count == len(steps.episode)
    assert replay(bumpers_session(perceived="observant"), stepper, rows_of(steps)) == count


def test_rows_of_a_table_are_its_steps():
    steps = record(on_the_cliff(BUMPERS, episodes=2), seed=3)
    rows = list(rows_of(steps))
    for field in Step._fields:
        column = np.array([getattr(row, field) for row in rows])
        assert np.array_equal(column, getattr(steps, field)), field


CHANGES = {
    "state": lambda state: state + 1,
    "executed": lambda action: (action + 1) % 4,
    "undone": lambda undone: not undone,
    "credited": lambda action: (action + 1) % 4,
    "overridden": lambda overridden: not overridden,
    "probability": lambda probability: probability + 1e-9,
    "projected_return": lambda value: value + 1e-9,
    "reward": lambda reward: reward + 1e-9,
    "next_state": lambda state: state - 1,
    "events": lambda events: events ^ SUCCESS,
}


@pytest.mark.parametrize("field", CHANGES)
def test_a_replay_stops_at_the_first_difference(field):
    steps = list(rows_of(record(on_the_cliff(BUMPERS, episodes=3), seed=3)))
    for place in (30, 40):
        changed = CHANGES[field](getattr(steps[place], field))
        steps[place] = steps[place]._replace(**{field: changed})
    with pytest.raises(ReplayError, match=rf"step 30 \(episode \d\): {field} is .*, recorded"):
        replay(bumpers_session(), Walker(), steps)


def test_a_replay_with_another_assistant_stops_at_its_first_other_decision():
    steps = record(on_the_cliff(BUMPERS, episodes=3), seed=3)
    first = int(np.argmax(steps.probability > 0))
    with pytest.raises(ReplayError, match=rf"step {first} .*(executed|probability) is"):
        replay(session_of(make_assistant("none")), None, steps)


def test_a_log_that_ends_within_an_episode_is_an_error():
    steps = record(on_the_cliff(BUMPERS, episodes=3), seed=3)
    cut = Step(*(column[:-1] for column in steps))
    count = len(steps.episode) - 1
    with pytest.raises(ReplayError, match=f"ends after {count} steps, before its last episode"):
        replay(bumpers_session(), None, cut)


def test_nothing_is_replayed_of_an_empty_log():
    assert replay(bumpers_session(), Walker(), []) == 0


@pytest.mark.parametrize("stepper", [None, Walker()], ids=["by the record", "at the task"])
def test_undone_steps_are_replayed(own_registry, stepper):
    condition = taken_back(perception="observant")
    steps = record(condition, seed=3)
    assert steps.undone.any()
    session = session_of(condition.assistant, perceived="observant")
    assert replay(session, stepper, steps) == len(steps.episode)


def at_the_goal(perceived):
    """A session whose learner stands above the goal, after 12 steps."""
    register_assistant("never-arrive", NoOptions, needs=("undo",))(never_arrive)
    session, walker = session_of(make_assistant("never-arrive"), perceived=perceived), Walker()
    session.begin(walker.reset())
    for action in [UP, *[RIGHT] * 11]:
        session.decide(action, HALF)
        state, reward, events = walker.step(action)
        session.record(reward, state, events)
    assert session.state == ABOVE_THE_GOAL
    return session


@pytest.mark.parametrize(("perceived", "credited"), [("observant", DOWN), ("interruption", -1)])
def test_an_undone_step_counts_and_ends_nothing(own_registry, perceived, credited):
    session = at_the_goal(perceived)
    assert session.decide(DOWN, HALF) == Decision(DOWN, 1.0, True)
    step = session.record(99.0, GOAL, TERMINATED | SUCCESS)
    assert (step.executed, step.undone, step.overridden) == (DOWN, True, True)
    assert (step.reward, step.next_state, step.events) == (99.0, GOAL, SUCCESS)
    assert step.credited == credited
    assert session.state == ABOVE_THE_GOAL
    assert (session.account.step, session.account.earned) == (13, -12.0 + 99.0)
    assert present(session.values_now).tolist() == CLIFF(ABOVE_THE_GOAL).tolist()
    session.decide(UP, HALF)
    assert session.record(-1.0, 23, 0).projected_return == 87.0 + CLIFF(ABOVE_THE_GOAL)[UP]


@pytest.mark.parametrize("end", [TRUNCATED, TERMINATED, TERMINATED | TRUNCATED])
def test_only_the_step_limit_ends_an_episode_with_an_undone_step(own_registry, end):
    session = at_the_goal("transition")
    session.decide(DOWN, HALF)
    assert session.record(99.0, GOAL, end | LIMIT).events == LIMIT
    assert session.values_now is None
    with pytest.raises(RequestError, match=r"begin\(state\)"):
        session.decide(DOWN, HALF)


def test_calls_out_of_order_are_refused():
    session = bumpers_session()
    with pytest.raises(RequestError, match=r"decide: begin\(state\) must come first"):
        session.decide(UP, HALF)
    with pytest.raises(RequestError, match=r"record: decide\(...\) must come first"):
        session.record(0.0, 24, 0)
    session.begin(START)
    session.decide(UP, HALF)
    with pytest.raises(RequestError, match=r"decide: record\(...\) of the last decision"):
        session.decide(UP, HALF)
    session.record(-1.0, 24, 0)
    with pytest.raises(RequestError, match=r"record: decide\(...\) must come first"):
        session.record(-1.0, 24, 0)


@pytest.mark.parametrize("proposed", [-1, 4])
def test_a_proposal_that_there_is_not_is_refused_and_no_decision(proposed):
    session = bumpers_session()
    session.begin(START)
    with pytest.raises(RequestError, match=rf"proposed = {proposed}; it must lie in \[0, 4\)"):
        session.decide(proposed, HALF)
    assert session.decide(UP, HALF).action == UP


def test_a_new_episode_begins_a_new_account():
    session = bumpers_session()
    for episode in range(3):
        session.begin(START)
        assert session.account == (0.0, 1.0, 87.0, episode, 0)
        session.decide(UP, HALF)
        assert session.record(-1.0, 24, 0).episode == episode


def test_rules_cannot_change_the_values():
    session = bumpers_session()
    session.begin(START)
    with pytest.raises(ValueError, match="read-only"):
        present(session.values_now)[0] = 5.0


SEEDS, NUMBERS = range(4), range(2500)


@pytest.fixture(scope="module")
def drawn():
    """Float64 [4, 2500, 2], coins and ties."""
    return np.array([[noise_of(seed, number) for number in NUMBERS] for seed in SEEDS])


def test_noise_is_a_function_of_seed_and_number_alone(drawn):
    for number in (2499, 7, 0, 7):
        for seed in (3, 0):
            assert noise_of(seed, number) == Noise(*drawn[seed, number])


def test_noise_is_uniform_and_independent_of_its_neighbours(drawn):
    assert ((drawn >= 0) & (drawn < 1)).all()
    assert len(np.unique(drawn)) == drawn.size  # no number is drawn twice
    numbers = drawn.size // 2
    for column in (drawn[..., 0], drawn[..., 1]):
        # The mean of N uniform numbers errs by 1 / sqrt(12 N), a share p by sqrt(p (1 - p) / N);
        # bounds are 4 of these.
        assert abs(column.mean() - 0.5) < 4 / np.sqrt(12 * numbers)
        for tenth in np.arange(10) / 10:
            share = ((column >= tenth) & (column < tenth + 0.1)).mean()
            assert abs(share - 0.1) < 4 * np.sqrt(0.09 / numbers)
    pairs = {
        "coin and tie": (drawn[..., 0], drawn[..., 1]),
        "coin and next coin": (drawn[:, :-1, 0], drawn[:, 1:, 0]),
        "tie and next coin": (drawn[:, :-1, 1], drawn[:, 1:, 0]),
        "coins of neighbouring seeds": (drawn[:-1, :, 0], drawn[1:, :, 0]),
    }
    for name, (first, second) in pairs.items():
        # Correlations of N independent pairs err by 1 / sqrt(N).
        correlation = np.corrcoef(first.ravel(), second.ravel())[0, 1]
        assert abs(correlation) < 4 / np.sqrt(first.size), name


def test_the_walker_is_the_packages_task():
    task, walker = cliff_walking(), Walker()
    walker.reset()
    for state in range(37):
        for action in range(4):
            walker.restore(state)
            found = walker.step(action)
            place = (state, action, 0)
            expected = (int(task.next_state[place]), float(task.reward[place]))
            assert found[:2] == expected
            assert bool(found[2] & TERMINATED) == bool(task.terminated[place])


def test_probabilities_of_overrides_are_those_that_decisions_then_have():
    generator = np.random.default_rng(3)
    session, walker = bumpers_session(), Walker()
    session.begin(walker.reset())
    for _ in range(40):
        found = session.override_probabilities()
        assert found.shape == (4,)
        again = session.override_probabilities()  # asking changes nothing
        assert np.array_equal(found, again)
        proposed = int(generator.integers(4))
        decision = session.decide(proposed, Noise(*generator.random(2)))
        assert decision.probability == found[proposed]
        session.record(*_as_recorded(walker.step(decision.action)))
        if session.values_now is None:
            break


def _as_recorded(outcome):
    state, reward, events = outcome
    return reward, state, events


def test_probabilities_outside_an_episode_are_refused():
    with pytest.raises(RequestError, match=r"override_probabilities: begin\(state\) must come"):
        bumpers_session().override_probabilities()
