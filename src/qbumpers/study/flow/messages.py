"""What the page of a study says, beside what a page of play does."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, field

from qbumpers.play.messages import (
    Act,
    Begin,
    Continue,
    Count,
    Focus,
    Hello,
    Hold,
    Milliseconds,
    Name,
    Pause,
    decoded_by,
)

Long = Annotated[str, Meta(max_length=5000)]
Content = bool | int | float | Long | None


class Enter(Hello, tag="hello", forbid_unknown_fields=True):
    """The first message of a page.

    Attributes:
        page: made up by the page when it was loaded: a connection that is lost and comes back has
            the same, a reload another one.
        arrival: what the link says of who comes, for instance PROLIFIC_PID.
    """

    page: Name = ""
    arrival: Annotated[dict[Name, Name], Meta(max_length=5)] = field(default_factory=dict[str, str])


class _Said(msgspec.Struct, forbid_unknown_fields=True, tag_field="type"):
    """A message of a page of a study."""


class Answer(_Said, tag="answer"):
    """A page is done with.

    Attributes:
        number: of the page; another one than the present is late or repeated, and ignored.
        content: by item.
        shown: when the page was shown, in milliseconds of the page's clock.
        at: when it was answered, likewise.
    """

    number: Count
    shown: Milliseconds
    at: Milliseconds
    content: Annotated[dict[Name, Content], Meta(max_length=200)] = field(
        default_factory=dict[str, Content]
    )


class Attribute(_Said, tag="attribute"):
    """An answer to "was that you?".

    Attributes:
        number: of the step in its session.
        answer: who it was.
        shown: when the question was shown, in milliseconds of the page's clock.
        at: when it was answered, likewise.
    """

    number: Count
    answer: Literal["me", "assistant", "unsure"]
    shown: Milliseconds
    at: Milliseconds


class Ping(_Said, tag="ping"):
    """Is answered at once.

    Attributes:
        at: milliseconds of the page's clock.
        last: how long the answer to the one before took, in milliseconds; None if there was none.
    """

    at: Milliseconds
    last: Milliseconds | None = None


class Withdraw(_Said, tag="withdraw"):
    """The participant withdraws: everything of theirs is to be deleted."""


Said = Enter | Answer | Attribute | Ping | Withdraw | Begin | Act | Hold | Pause | Continue | Focus
decoded = decoded_by(Said)
"""A message of a page of a study, as `qbumpers.play.messages.decoded`."""
