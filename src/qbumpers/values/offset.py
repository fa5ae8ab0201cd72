"""Values by numbers that count from 0."""

from typing import Any


class OffsetValues:
    """Values of states whose numbers begin elsewhere; they state nothing of themselves.

    Args:
        values: what is called with a state as it is numbered there, and its further rows in
            `others`, if it has some.
        first: the number that stands for 0.
    """

    def __init__(self, values: Any, first: int) -> None:
        self._values, self._first = values, first
        others = getattr(values, "others", {})
        self.others = {name: OffsetValues(each, first) for name, each in others.items()}

    def __call__(self, state: Any, /) -> Any:
        """Q*(s, .), as the values give it."""
        return self._values(state + self._first)
