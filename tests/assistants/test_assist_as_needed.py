import pytest

from qbumpers import RequestError, make_assistant
from qbumpers.decisions import Decision, Noise
from qbumpers.tasks.dynamics import CRASH, LIMIT, TERMINATED, TRUNCATED
from tests.assistants.otherwise import bumpers
from tests.assistants.situations import model_of, situation_of, step_of

NOISE = Noise(0.5, 0.5)
SITUATION = situation_of([10.0, 20.0], 0, start_value=20.0)


def after(episodes, **options):
    """The memory after episodes, each a list of rewards that ends with its last one."""
    given = {"forgetting": 0.5, "gain": 1.0, **options}
    assistant = make_assistant("assist-as-needed", **given)
    memory = assistant.start(model_of())  # whose discount is 0.9
    for episode, rewards in enumerate(episodes):
        for number, reward in enumerate(rewards):
            events = TERMINATED if number == len(rewards) - 1 else CRASH
            step = step_of(SITUATION, 0, episode=episode, reward=reward, events=events)
            memory = assistant.observe(memory, step)
    return assistant, memory


@pytest.mark.parametrize(
    ("episodes", "options", "strength"),
    [
        ([], {}, 0.0),
        ([[15.0]], {}, 0.25),
        ([[15.0]], {"gain": 2.0}, 0.5),
        ([[15.0]], {"dead_band": 0.125}, 0.125),
        ([[15.0]], {"v_min": 10.0}, 0.5),
        ([[15.0]], {"v_min": 10.0, "gain": 4.0}, 1.0),
        ([[20.0]], {"dead_band": 0.125}, 0.0),
        ([[15.0], [10.0]], {}, 0.25 / 2 + 0.5),
        ([[15.0], [25.0], [20.0]], {}, 0.0625),  # more than V* is no negative error
        ([[6.0, 10.0]], {}, 0.25),  # 6 + 0.9 * 10
    ],
)
def test_strength_is_f_times_itself_and_g_times_the_error_beyond_the_dead_band(
    episodes, options, strength
):
    assert after(episodes, **options)[1].strength == pytest.approx(strength, abs=1e-15)


@pytest.mark.parametrize("end", [TERMINATED, TRUNCATED, LIMIT])
def test_only_the_end_of_an_episode_changes_the_strength(end):
    assistant, memory = after([])
    for events in (0, CRASH, end):
        assert memory.strength == 0.0
        memory = assistant.observe(memory, step_of(SITUATION, 0, reward=0.0, events=events))
    assert memory.strength == 1.0


def test_an_episode_that_was_broken_off_is_forgotten():
    assistant, memory = after([])
    memory = assistant.observe(memory, step_of(SITUATION, 0, reward=-50.0))
    late = step_of(SITUATION, 0, episode=1, reward=15.0, events=TERMINATED)
    assert assistant.observe(memory, late).strength == 0.25


def test_the_value_of_the_start_is_that_of_each_episode():
    assistant, memory = after([])
    rich = situation_of([40.0, 10.0], 0)
    for episode in (0, 1):
        step = step_of(rich, 0, episode=episode, reward=30.0, events=TERMINATED)
        memory = assistant.observe(memory, step)
    assert memory.strength == 0.25 / 2 + 0.25


@pytest.mark.parametrize(("coin", "action"), [(0.24, 1), (0.25, 0)])
def test_strength_is_the_probability_of_an_override(coin, action):
    assistant, memory = after([[15.0]])
    assert assistant.decide(SITUATION, Noise(coin, 0.5), memory) == Decision(action, 0.25)
    best = SITUATION._replace(proposed=1)
    assert assistant.decide(best, Noise(coin, 0.5), memory) == Decision(1, 0.0)


def test_past_episodes_decide_about_a_fall_and_a_trifle_unlike_with_bumpers():
    fall = situation_of([-13.0, 94.0], 0, start_value=87.0)
    trifle = situation_of([85.0, 87.0], 0, start_value=87.0)
    assistant, good = after([[20.0]])
    assert assistant.decide(fall, NOISE, good).action == 0
    assert bumpers(fall, NOISE) == Decision(1, 1.0)
    assistant, bad = after([[0.0], [0.0]])
    assert assistant.decide(trifle, NOISE, bad) == Decision(1, 1.0)
    assert bumpers(trifle, NOISE).action == 0


@pytest.mark.parametrize(
    ("option", "value"),
    [("forgetting", 1.0), ("gain", -1.0), ("dead_band", 1.0), ("v_min", float("nan"))],
)
def test_options_have_bounds(option, value):
    options = {"forgetting": 0.5, "gain": 1.0, option: value}
    with pytest.raises(RequestError, match=f"assist-as-needed: {option} = {value}"):
        make_assistant("assist-as-needed", **options)


def test_the_lower_bound_must_lie_below_the_value_of_the_start():
    with pytest.raises(RequestError, match="v_min = 0 must be below"):
        make_assistant("assist-as-needed", forgetting=0.5, gain=1.0).check_start(-1.0)
