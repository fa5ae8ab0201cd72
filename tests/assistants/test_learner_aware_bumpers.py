import math

import numpy as np
import pytest

from qbumpers import RequestError, make_assistant, simulate, solve
from qbumpers.assistants.mirrors import MIRRORS, PERCEPTIONS
from qbumpers.assistants.model_free_learner_aware_bumpers import experienced, recalled
from qbumpers.conformance import vector_corridor
from qbumpers.decisions import Decision, Noise
from qbumpers.simulation import make_condition, record
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.dynamics import TERMINATED
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import situation_of, step_of

TASK = cliff_walking()
VALUES = np.asarray(solve(TASK).table)
UP, RIGHT, DOWN, LEFT = range(4)
START = 36
NOISE = Noise(0.0, 0.0)
NAMES = ["learner-aware-bumpers", "model-free-learner-aware-bumpers"]


def proposing(action, state=START):
    return situation_of(VALUES[state], action, start_value=87.0)._replace(state=state)


def aware(alpha, name=NAMES[0]):
    assistant = make_assistant(name, alpha=alpha)
    return assistant, assistant.start(make_condition(TASK, assistant).model())


def after(assistant, memory, state, proposed, executed):
    """The memory after a step in a state."""
    place = (state, executed, 0)
    return assistant.observe(memory, step_of(
        proposing(proposed, state), executed, reward=float(TASK.reward[place]),
        next_state=int(TASK.next_state[place]), events=int(TASK.terminated[place]),
    ))  # fmt: skip


def test_a_first_fall_is_a_lesson_once_it_is_worth_more_than_it_costs():
    # Nothing is believed yet, so every choice here is as likely as the others. A transition learner
    # of rate l will believe -l of "right" if it is helped, and -100 l if it falls; an observant one
    # believes -l of "up" in the first case, and one that is interrupted nothing. The fall costs
    # 87 - (-13) = 100, and would be made up to 20 times again, as would walking into the wall,
    # which costs 1.
    costs = [0.0, 100.0 * 21, 21.0, 21.0]

    def cost_of(beliefs):
        gaps = [max(beliefs) - belief for belief in beliefs]
        near = [max(0.0, 1 - gap / (8 * 0.03 * 87)) ** 8 for gap in gaps]
        return sum(n * cost for n, cost in zip(near, costs, strict=True)) / sum(near)

    worth = 0.0
    for rate in (0.02, 0.1, 0.3, 0.6, 1.0):
        misled, noticed = cost_of([0.0, -rate, 0.0, 0.0]), cost_of([-rate, 0.0, 0.0, 0.0])
        help_costs = 0.98 * misled + 0.01 * noticed + 0.01 * cost_of([0.0] * 4)
        worth += (help_costs - cost_of([0.0, -100 * rate, 0.0, 0.0])) / 5 / rate
    for factor, expected in ((0.999, Decision(UP, 1.0)), (1.001, Decision(RIGHT, 0.0))):
        assistant, memory = aware(factor * 100 / worth)
        assert assistant.decide(proposing(RIGHT), NOISE, memory) == expected


def test_without_a_model_it_recalls_what_happened_and_guesses_the_rest():
    assistant, memory = aware(0.5, NAMES[1])
    memory.mirrors.best[START] = 80.0
    memory.mirrors.best[24] = 30.0
    for reward, next_state, events in ((-1.0, START, 0), (-3.0, 24, 0), (-2.0, 24, TERMINATED)):
        step = step_of(proposing(DOWN), DOWN, reward=reward, next_state=next_state, events=events)
        memory = experienced(memory, step, assistant.numbers)
        memory.mirrors.best[START], memory.mirrors.best[24] = 80.0, 30.0
    found = recalled(memory, START, VALUES[START])
    # 7 of 87 are missing here. "Down" led to 80 here, to 30 in 24, and to the end.
    expected = [87.0 - 7, -13.0 - 7, (79 + 27 - 2) / 3, 86.0 - 7]
    np.testing.assert_allclose(found.targets, np.tile(expected, (MIRRORS, 1)).T)
    np.testing.assert_allclose(found.back, [0.5, 0.5, 1 / 3, 0.5])
    for _ in range(9):
        memory = experienced(
            memory, step_of(proposing(DOWN), DOWN, next_state=24), assistant.numbers
        )
    memory.mirrors.best[24] = 30.0
    found = recalled(memory, START, VALUES[START])  # the last ten: the end, and 24 nine times
    np.testing.assert_allclose(found.targets[DOWN], (9 * 29 - 2) / 10)
    assert found.back[DOWN] == 0


def test_a_mistake_is_let_happen_once_where_bumpers_never_would():
    assistant, memory = aware(0.03)
    falling = proposing(RIGHT)
    assert assistant.decide(falling, NOISE, memory) == Decision(RIGHT, 0.0)
    memory = after(assistant, memory, START, RIGHT, RIGHT)
    assert assistant.decide(falling, NOISE, memory) == Decision(UP, 1.0)
    assert bumpers(falling, NOISE, alpha=0.03) == Decision(UP, 1.0)


def test_a_trifle_of_a_transition_learner_passes_the_likelier_the_less_it_costs():
    # 1 of 87 alpha is lost, f = 1 / (1 + exp(2 log(0.001 / 0.999) (x - 1/2))). "Left" has become
    # more than "up" is believed to bring, so that an override makes it look worse.
    lost = 1 / (87 * 0.05)
    due = 1 / (1 + math.exp(2 * math.log(0.001 / 0.999) * (lost - 0.5)))
    probability = 1 - 0.98 * (1 - 0.05**2) * (1 - due)
    assistant, memory = aware(0.05)
    memory.mirrors.values[START], memory.mirrors.best[START] = 3.0, 3.0
    memory.mirrors.values[START, RIGHT] = -60.0  # no choice of a learner, so that nothing is taught
    decision = assistant.decide(proposing(LEFT), Noise(probability - 1e-9, 0.0), memory)
    assert decision.action == UP
    assert decision.probability == pytest.approx(probability, abs=1e-12)
    assert assistant.decide(proposing(LEFT), Noise(probability + 1e-9, 0.0), memory).action == LEFT


def test_a_proposal_happens_if_it_is_cheap_and_no_override_would_make_it_look_worse():
    # Walking into the wall leads back here, and costs 1; "up" leads to where 3 is to be had.
    assistant, memory = aware(1 / (0.5 * 87) + 1e-9)
    memory.mirrors.best[24] = 3.0
    assert assistant.decide(proposing(LEFT), NOISE, memory) == Decision(LEFT, 0.0)
    dearer, memory_of_dearer = aware(1 / (0.5 * 87) - 1e-9)
    memory_of_dearer.mirrors.best[24] = 3.0
    assert dearer.decide(proposing(LEFT), NOISE, memory_of_dearer).action == UP
    assert dearer.decide(proposing(LEFT), NOISE, memory_of_dearer).probability > 0


@pytest.mark.parametrize("best_above", [0.0, 3.0])
def test_nothing_passes_for_its_own_sake_once_a_learner_hardly_learns(best_above):
    # Only the mirrors of rate 0.02 remain. A fall would be no lesson: "left" costs 1.
    assistant, memory = aware(0.05)
    memory.mirrors.best[24] = best_above
    memory.mirrors.values[START, LEFT] = -60.0
    weights = memory.mirrors.weights
    weights[...] *= np.where(np.arange(MIRRORS) % 5 == 0, 1.0, 1e-9)
    weights /= weights.sum()
    decision = assistant.decide(proposing(LEFT), Noise(1 - 1e-12, 0.0), memory)
    assert decision == Decision(UP, 1.0)


def test_the_filter_keeps_to_what_overrides_are_while_a_learner_hardly_learns():
    # A proposal that every transition learner means, and no other: believed only of who learns.
    for slow, kept in ((True, True), (False, False)):
        assistant, memory = aware(0.5)
        memory.mirrors.values[24, LEFT, :5] = 9.0
        memory.mirrors.values[24, UP, 5:] = 9.0
        memory.mirrors.best[24] = 9.0
        weights = memory.mirrors.weights
        weights[...] = 0.0
        weights[:, 0, [0, 5, 10] if slow else [2, 7, 12]] = 1 / 9
        memory = after(assistant, memory, 24, LEFT, UP)
        of_transition = memory.mirrors.weights[:, :, :5].sum()
        assert of_transition == pytest.approx(1 / 3 if kept else 1.0, abs=0.02)


def test_the_override_is_the_better_action_that_gets_the_least_credit():
    # Below the start row, (2, 1): up, right and left are all better than the cliff below.
    state, above, beside = 25, 13, 24
    assistant, memory = aware(0.2)
    for believed, action in (((3.0, 0.0), LEFT), ((0.0, 3.0), UP)):
        memory.mirrors.best[above], memory.mirrors.best[beside] = believed
        memory.mirrors.best[26] = 9.0
        memory.mirrors.values[state, DOWN] = -60.0  # nothing to learn from a fall any more
        assert assistant.decide(proposing(DOWN, state), NOISE, memory) == Decision(action, 1.0)


def test_if_no_action_keeps_to_the_floor_a_best_one_is_executed():
    assistant, memory = aware(0.2)
    memory.mirrors.values[25, DOWN] = -60.0
    wasted = proposing(DOWN, 25)._replace(earned=-40.0)
    assert assistant.decide(wasted, NOISE, memory) == Decision(RIGHT, 1.0)


@pytest.mark.parametrize("name", NAMES)
def test_best_actions_pass_and_at_alpha_0_nothing_else(name):
    assistant, memory = aware(0.0, name)
    assert assistant.decide(proposing(UP), NOISE, memory) == Decision(UP, 0.0)
    for proposed in (RIGHT, DOWN, LEFT):
        assert assistant.decide(proposing(proposed), NOISE, memory) == Decision(UP, 1.0)


def test_mirrors_learn_as_each_hypothesis_says():
    assistant, memory = aware(0.5)
    memory = after(assistant, memory, 24, LEFT, UP)  # -1, into a state of which nothing is known
    rates = np.array([0.02, 0.1, 0.3, 0.6, 1.0])
    transition, observant, interruption = memory.mirrors.values[24].reshape(4, 3, 5).swapaxes(0, 1)
    np.testing.assert_array_equal(transition, [[0.0] * 5, [0.0] * 5, [0.0] * 5, -rates])
    np.testing.assert_array_equal(observant, [-rates, [0.0] * 5, [0.0] * 5, [0.0] * 5])
    np.testing.assert_array_equal(interruption, np.zeros((4, 5)))


def test_an_episode_ends_with_mirrors_that_mix_with_their_neighbours():
    # Nothing tells the rates apart yet. 1 in 20 changes to each neighbour.
    assistant, memory = aware(0.5)
    memory = after(assistant, memory, 35, DOWN, DOWN)  # 99, and the end
    own = 99 * np.array([0.02, 0.1, 0.3, 0.6, 1.0])
    mixed = (
        0.9 * own + 0.05 * np.array([*own[:1], *own[:-1]]) + 0.05 * np.array([*own[1:], own[-1]])
    )
    np.testing.assert_allclose(memory.mirrors.values[35, DOWN], np.tile(mixed, 3))
    np.testing.assert_array_equal(memory.mirrors.best[35], memory.mirrors.values[35, DOWN])
    assert not memory.mirrors.values[34].any()


@pytest.mark.parametrize("perception", PERCEPTIONS)
def test_the_filter_finds_out_what_overrides_are_to_a_learner(perception):
    found = []
    for trial in range(4):
        assistant, memory = aware(0.05)
        condition = make_condition(TASK, assistant, perception=perception, episodes=40)
        steps = record(condition, trial=trial, seed=3)
        for number in range(len(steps.episode)):
            memory = assistant.observe(memory, type(steps)(*(part[number] for part in steps)))
        by_perception = memory.mirrors.weights.sum(axis=(0, 1)).reshape(3, MIRRORS // 3).sum(axis=1)
        assert by_perception.sum() == pytest.approx(1)
        found.append(PERCEPTIONS[by_perception.argmax()])
    assert found.count(perception) >= 3


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_transition_learners_are_better_off_than_with_bumpers(name):
    found = {
        each: simulate(TASK, make_assistant(each, alpha=0.2), trials=60).outcomes
        for each in (name, "stochastic-q-bumpers")
    }
    assisted = {each: outcomes.assisted_return.mean() for each, outcomes in found.items()}
    unassisted = {each: outcomes.unassisted_return.mean() for each, outcomes in found.items()}
    assert assisted[name] > 55
    assert unassisted[name] > -200
    assert unassisted["stochastic-q-bumpers"] < -2000


@pytest.mark.parametrize("name", NAMES)
def test_what_it_cannot_do_is_refused_in_a_line(name):
    with pytest.raises(RequestError, match=f"{name}: alpha = -1"):
        make_assistant(name, alpha=-1)
    with pytest.raises(RequestError, match=r"v_min = 90 must be below .* = 87"):
        simulate(TASK, make_assistant(name, alpha=1, v_min=90.0), trials=1)
    with pytest.raises(RequestError, match=f"{name}: task .* has no numbered states"):
        simulate(vector_corridor(), make_assistant(name, alpha=1), trials=1)
