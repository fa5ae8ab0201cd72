"""Random streams: who draws what, seeded so that order and number of workers change nothing.

A condition has a counter-based generator, NumPy's Philox, seeded by the experiment's seed and the
condition's content; the number of a trial is a place in its sequence. What stands there seeds the
trial's four independent streams, one for each source of chance: NumPy's SFC64 generators, stepped
in compiled code.
"""

import hashlib
import json
from typing import Any

import numpy as np

from qbumpers.compilation import compiled

LEARNER, ASSISTANT, ENVIRONMENT, EVALUATION = range(4)
"""Rows of a trial's streams: exploration; override noise; transitions; the greedy episode."""

_STREAMS = 4
_SEED_WORDS = 3
_TRIAL_BITS = 64  # from trial to trial, more blocks of Philox than its episodes can use
_BLOCKS = _STREAMS * _SEED_WORDS // 4  # of Philox per trial, each of four 64-bit words
_ONE = np.uint64(1)
_SHIFT_3, _SHIFT_11 = np.uint64(3), np.uint64(11)
_SHIFT_24, _SHIFT_40 = np.uint64(24), np.uint64(40)


def content_digest(content: Any) -> bytes:
    """A digest of JSON-like data: equal data, equal digest, whatever the order of keys.

    Args:
        content: anything that `json.dumps` takes.

    Returns:
        The SHA-256 of its canonical JSON, 32 bytes.
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).digest()


def content_words(content: Any) -> list[int]:
    """Seed words for a piece of JSON-like data: `content_digest` as eight 32-bit numbers."""
    return np.frombuffer(content_digest(content), dtype="<u4").tolist()


def trial_streams(seed: int, content: Any, trials: range) -> np.ndarray:
    """The streams of trials of one condition.

    Args:
        seed: the experiment's, not negative.
        content: what the condition is, as JSON-like data; see `content_words`.
        trials: which trials.

    Returns:
        uint64 [T, 4, 4]: for each trial and source of chance, the state of an SFC64 generator.
    """
    if trials.step != 1:
        return np.concatenate([trial_streams(seed, content, range(t, t + 1)) for t in trials])
    source = np.random.Philox(np.random.SeedSequence([seed, *content_words(content)]))
    source.advance(trials.start * _BLOCKS)
    seeds = source.random_raw(len(trials) * _STREAMS * _SEED_WORDS)
    return _warmed(seeds.reshape(len(trials), _STREAMS, _SEED_WORDS))


def episode_streams(seed: int, content: Any, trials: range, episodes: int) -> np.ndarray:
    """Streams that begin anew in every episode.

    Args:
        seed: the experiment's, not negative.
        content: what has these streams in common, as JSON-like data; see `content_words`.
        trials: which trials.
        episodes: E, of a trial; the streams of its first ones do not depend on how many follow.

    Returns:
        uint64 [T, E, 4, 4]: for each trial, episode and source of chance, the state of an SFC64
        generator.
    """
    seeds = np.empty((len(trials), episodes, _STREAMS, _SEED_WORDS), np.uint64)
    sequence = np.random.SeedSequence([seed, *content_words(content)])
    for place, trial in enumerate(trials):
        source = np.random.Philox(sequence)
        source.advance(trial << _TRIAL_BITS)
        seeds[place] = source.random_raw(seeds[0].size).reshape(seeds[0].shape)
    states = _warmed(seeds.reshape(-1, _STREAMS, _SEED_WORDS))
    return states.reshape(len(trials), episodes, _STREAMS, _SEED_WORDS + 1)


@compiled
def _warmed(seeds: np.ndarray) -> np.ndarray:
    trials, streams, words = seeds.shape
    states = np.ones((trials, streams, words + 1), np.uint64)
    for trial in range(trials):
        for stream in range(streams):
            state = states[trial, stream]
            for word in range(words):
                state[word] = seeds[trial, stream, word]
            for _ in range(12):
                draw(state)
    return states


@compiled
def draw(state: np.ndarray) -> float:
    """The next number of a stream, uniform in [0, 1).

    SFC64 by C. Doty-Humphrey (PractRand), as in `numpy.random.SFC64`.

    Args:
        state: uint64 [4], changed in place.

    Returns:
        A float with 53 random bits.
    """
    a, b, c, counter = state[0], state[1], state[2], state[3]
    total = a + b + counter
    state[0] = b ^ (b >> _SHIFT_11)
    state[1] = c + (c << _SHIFT_3)
    state[2] = ((c << _SHIFT_24) | (c >> _SHIFT_40)) + total
    state[3] = counter + _ONE
    return (total >> _SHIFT_11) * (1.0 / 9007199254740992.0)
