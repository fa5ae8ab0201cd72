"""What the page and the server say to each other: JSON texts, strictly checked on arrival."""

from collections.abc import Callable
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from qbumpers.errors import RequestError

MOST_BYTES = 8192
"""Of a message from a page."""

Device = Literal["keyboard", "touch", "gamepad"]
Milliseconds = Annotated[float, Meta(ge=0, le=1e12)]
Count = Annotated[int, Meta(ge=0, le=2**53)]
Action = Annotated[int, Meta(ge=0, le=10_000)]
Name = Annotated[str, Meta(max_length=100)]
Number = bool | int | float | Name | None


class _Message(msgspec.Struct, forbid_unknown_fields=True, tag_field="type"):
    """A message of a page."""


class Hello(_Message, tag="hello"):
    """The first message of a page.

    Attributes:
        token: of the session to go on with; empty for a new one.
        refresh: the screen's rate, per second; 0 if it is not known.
        width: of the page, in pixels.
        height: of the page, in pixels.
        touch: whether the device has a touch screen.
        reduced_motion: whether the participant prefers little motion.
    """

    token: Annotated[str, Meta(max_length=200)] = ""
    refresh: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    width: Annotated[int, Meta(ge=0, le=100_000)] = 0
    height: Annotated[int, Meta(ge=0, le=100_000)] = 0
    touch: bool = False
    reduced_motion: bool = False


class Begin(_Message, tag="begin"):
    """Start the next episode.

    Attributes:
        episode: its number; another one than the next is late or repeated, and ignored.
        assistant: name of a rule.
        options: by name, what the rule is set to.
        assisted: whether the assistant helps.
    """

    episode: Count
    assistant: Name
    options: Annotated[dict[Name, Number | dict[Name, Number]], Meta(max_length=20)] = {}
    assisted: bool = True


class Act(_Message, tag="act"):
    """Propose an action, of a task that waits for one.

    Attributes:
        number: of the step; another one than the next is late or repeated, and ignored.
        action: proposed.
        device: that it was proposed with.
        pressed: when, in milliseconds of the page's clock.
        shown: when the state was shown, likewise.
    """

    number: Count
    action: Action
    device: Device
    pressed: Milliseconds
    shown: Milliseconds


class Hold(_Message, tag="hold"):
    """The action that is held from now on, of a task in real time; also a sign of life.

    Attributes:
        sequence: counted up by the page; a lower one than before is late, and ignored.
        action: held; None if no key is down.
        device: that it is held with.
        pressed: when it was pressed, in milliseconds of the page's clock; None if none is.
        shown: when the latest state was shown, likewise; None if none was.
    """

    sequence: Count
    action: Action | None = None
    device: Device = "keyboard"
    pressed: Milliseconds | None = None
    shown: Milliseconds | None = None


class Pause(_Message, tag="pause"):
    """Stop the clock."""


class Continue(_Message, tag="continue"):
    """Let the clock go on, after a countdown."""


class Speed(_Message, tag="speed"):
    """How fast the clock goes.

    Attributes:
        share: of the task's own rate.
    """

    share: Literal["1", "1/2"]


class Focus(_Message, tag="focus"):
    """The page came to the front or went from it.

    Attributes:
        focused: whether it is in front.
        at: when, in milliseconds of the page's clock.
    """

    focused: bool
    at: Milliseconds


Message = Hello | Begin | Act | Hold | Pause | Continue | Speed | Focus
_encoder = msgspec.json.Encoder()


def decoded_by(kinds: Any) -> Callable[[str | bytes], Any]:
    """A function that reads messages of a page.

    Args:
        kinds: a union of Structs, the messages that there are.

    Returns:
        From a JSON text to a message. It raises RequestError if the text is too long, is no JSON,
        or has a field that is unknown, missing or out of range.
    """
    decoder = msgspec.json.Decoder(kinds)

    def decode(text: str | bytes) -> Any:
        if len(text) > MOST_BYTES:
            raise RequestError(f"message of {len(text)} bytes; at most {MOST_BYTES} are taken")
        try:
            return decoder.decode(text)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise RequestError(f"message: {error}") from error

    return decode


decoded: Callable[[str | bytes], Message] = decoded_by(Message)
"""A message of a page of play."""


def encoded(kind: str, **fields: Any) -> str:
    """A message to a page.

    Args:
        kind: its type.
        **fields: JSON-like.
    """
    return _encoder.encode({"type": kind, **fields}).decode()
