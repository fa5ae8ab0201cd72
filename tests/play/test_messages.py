"""What a page may say, and what it hears of what it may not."""

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.errors import RequestError
from qbumpers.play.messages import MOST_BYTES, Act, Begin, Hold, Message, decoded, encoded

ACT = {"type": "act", "number": 3, "action": 1, "device": "touch", "pressed": 5.0, "shown": 4.0}


def test_a_message_is_what_it_says():
    assert decoded(json.dumps(ACT)) == Act(3, 1, "touch", 5.0, 4.0)
    assert decoded('{"type": "hold", "sequence": 0}') == Hold(0)
    options = {"alpha": 0.5, "second": True, "of": {"name": "maximal"}}
    begin = {"type": "begin", "episode": 0, "assistant": "fading", "options": options}
    assert decoded(json.dumps(begin)) == Begin(0, "fading", options)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "message: Input data was truncated"),
        ("[1]", "message: Expected `object`, got `array`"),
        ("{}", "missing required field `type`"),
        ('{"type": "become"}', r"Invalid value 'become' - at `\$.type`"),
        (json.dumps({**ACT, "action": -1}), r"Expected `int` >= 0 - at `\$.action`"),
        (json.dumps({**ACT, "action": "1"}), r"Expected `int`, got `str` - at `\$.action`"),
        (json.dumps({**ACT, "number": 1e300}), r"at `\$.number`"),
        (json.dumps({**ACT, "device": "mind"}), r"Invalid enum value 'mind'"),
        (json.dumps({**ACT, "pressed": None}), r"Expected `float`, got `null`"),
        (json.dumps({**ACT, "reward": 100}), "unknown field `reward`"),
        (json.dumps({k: v for k, v in ACT.items() if k != "shown"}), "required field `shown`"),
        ("[" * 5000, "message"),
        (json.dumps({"type": "hello", "token": "a" * 201}), "length <= 200"),
        (b"\xff\xfe", "message"),
    ],
)
def test_a_wrong_message_is_refused_by_what_is_wrong(text, message):
    with pytest.raises(RequestError, match=f"(?i){message}"):
        decoded(text)


@given(st.text() | st.binary())
def test_whatever_comes_is_a_message_or_refused(text):
    with contextlib.suppress(RequestError):
        assert isinstance(decoded(text), Message)


VALUES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
TYPES = st.sampled_from(["hello", "begin", "act", "hold", "pause", "continue", "speed", "focus"])
FIELDS = st.sampled_from([
    "episode", "assistant", "options", "number", "action", "device", "pressed", "shown", "sequence",
    "share", "focused", "at", "token",
])  # fmt: skip


@given(TYPES, st.dictionaries(FIELDS, VALUES))
def test_fields_of_any_kind_are_a_message_or_refused(kind, fields):
    with contextlib.suppress(RequestError):
        found = decoded(json.dumps({"type": kind, **fields}))
        assert isinstance(found, Message)
        if isinstance(found, Act):
            assert found.action >= 0
            assert 0 <= found.number < 2**60


def test_a_long_message_is_not_read():
    with pytest.raises(RequestError, match=f"at most {MOST_BYTES} are taken"):
        decoded(" " * (MOST_BYTES + 1))


def test_what_is_sent_is_json():
    assert json.loads(encoded("state", number=1)) == {"type": "state", "number": 1}
