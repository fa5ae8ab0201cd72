"""Streams against NumPy's own generators."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.random_streams import (
    ASSISTANT,
    ENVIRONMENT,
    EVALUATION,
    LEARNER,
    content_digest,
    content_words,
    draw,
    episode_streams,
    trial_streams,
)
from tests.reference_simulation import bit_generators_of_episode, seeded_bit_generators

CONTENT = {"assistant": "none", "options": {"alpha": 0.5, "second": True}, "list": [1, None]}
words = st.integers(0, 2**64 - 1)


def numpy_generator(state):
    bit_generator = np.random.SFC64()
    bit_generator.state = {**bit_generator.state, "state": {"state": state.copy()}}
    return np.random.Generator(bit_generator)


@given(st.tuples(words, words, words, words))
def test_draws_equal_those_of_numpy_from_any_state(state):
    state = np.array(state, np.uint64)
    generator = numpy_generator(state)
    assert [draw(state) for _ in range(50)] == generator.random(50).tolist()
    assert state.tolist() == generator.bit_generator.state["state"]["state"].tolist()


@given(st.tuples(words, words, words, words))
def test_draws_lie_in_the_half_open_unit_interval(state):
    state = np.array(state, np.uint64)
    assert all(0 <= draw(state) < 1 for _ in range(50))


@given(st.integers(0, 2**40), st.integers(0, 1000))
def test_a_trial_owns_four_streams_seeded_as_numpy_would(seed, trial):
    states = trial_streams(seed, CONTENT, range(trial, trial + 1))[0]
    expected = seeded_bit_generators(seed, CONTENT, trial)
    for row, bit_generator in enumerate(expected):
        assert states[row].tolist() == bit_generator.state["state"]["state"].tolist()


def test_the_four_sources_of_chance_have_a_row_each():
    assert sorted([LEARNER, ASSISTANT, ENVIRONMENT, EVALUATION]) == [0, 1, 2, 3]


@pytest.mark.parametrize("parts", [(1, 9), (2, 3, 5), (1,) * 10])
def test_streams_of_a_trial_do_not_depend_on_the_trials_asked_with_it(parts):
    ends = np.cumsum(parts)
    pieces = [
        trial_streams(3, CONTENT, range(end - part, end))
        for end, part in zip(ends.tolist(), parts, strict=True)
    ]
    assert np.array_equal(np.concatenate(pieces), trial_streams(3, CONTENT, range(10)))


@given(st.integers(0, 2**40), st.integers(0, 2**31), st.integers(0, 12), st.integers(1, 5))
def test_an_episode_owns_four_streams_seeded_as_numpy_would(seed, trial, episode, following):
    trials = range(trial, trial + 1)
    states = episode_streams(seed, CONTENT, trials, episode + following)[0, episode]
    expected = bit_generators_of_episode(seed, CONTENT, trial, episode)
    for row, bit_generator in enumerate(expected):
        assert states[row].tolist() == bit_generator.state["state"]["state"].tolist()


def test_streams_of_the_first_episodes_do_not_depend_on_how_many_follow():
    many = episode_streams(3, CONTENT, range(2, 6), 12)
    assert many.shape == (4, 12, 4, 4)
    assert np.array_equal(episode_streams(3, CONTENT, range(2, 6), 5), many[:, :5])
    assert np.array_equal(episode_streams(3, CONTENT, range(3, 6, 2), 12), many[1::2])


def test_every_episode_trial_seed_and_content_gets_streams_of_its_own():
    states = np.concatenate(
        [
            episode_streams(seed, content, range(4), 30)
            for seed in range(2)
            for content in (CONTENT, [])
        ]
    ).reshape(-1, 4)
    assert len(np.unique(states, axis=0)) == 2 * 2 * 4 * 30 * 4


def test_order_of_keys_does_not_matter():
    turned = {key: CONTENT[key] for key in reversed(CONTENT)}
    turned["options"] = {"second": True, "alpha": 0.5}
    assert list(turned) != list(CONTENT)
    assert content_words(turned) == content_words(CONTENT)
    assert np.array_equal(trial_streams(0, turned, range(2)), trial_streams(0, CONTENT, range(2)))


def test_seeds_contents_trials_and_sources_all_get_different_streams():
    contents = [CONTENT, {**CONTENT, "assistant": "maximal"}, {**CONTENT, "list": [None, 1]}, []]
    states = np.concatenate(
        [trial_streams(seed, content, range(5)) for seed in range(3) for content in contents]
    ).reshape(-1, 4)
    assert len(np.unique(states, axis=0)) == 3 * len(contents) * 5 * 4


def test_content_words_are_eight_words_of_thirty_two_bits():
    found = content_words(CONTENT)
    assert len(found) == 8
    assert all(isinstance(word, int) and 0 <= word < 2**32 for word in found)


def test_a_digest_depends_on_contents_and_not_on_the_order_of_keys():
    assert content_digest({"a": 1, "b": [2, 3]}) == content_digest({"b": [2, 3], "a": 1})
    assert content_digest([1, 2]) != content_digest([2, 1])
    assert len({content_digest(content) for content in (1, 1.0, "1", [1])}) == 4
