"""What a long run shows while it goes on."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from qbumpers.cli.console import ERRORS, OUTPUT

if TYPE_CHECKING:
    from qbumpers.experiments.run import Progress as Running
    from qbumpers.tuning import Progress as Tuning


class TrialProgress:
    """A bar of trials, with steps a second and the time left.

    Args:
        what: is going on, for instance "simulating".
        announce: prints what is to be expected, once that is known.
    """

    def __init__(self, what: str, announce: Callable[[Any], None]) -> None:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:,.0f} of {task.total:,.0f} trials"),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
        )
        self._bar = Progress(*columns, console=OUTPUT)
        self._waiting = OUTPUT.status("compiling and calibrating")
        self._what, self._announce = what, announce
        self._begun: float | None = None

    def __enter__(self) -> Self:
        self._waiting.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._waiting.stop()
        self._bar.stop()

    def show(self, done: "Running | Tuning") -> None:
        """Show how far it is."""
        if self._begun is None:
            self._begun = time.monotonic()
            self._waiting.stop()
            for name in done.damaged:
                ERRORS.print(f"damaged, to be made again: {escape(name)}", soft_wrap=True)
            self._announce(done)
            self._bar.start()
            self._task = self._bar.add_task(self._what, total=done.of, rate="")
        seconds = max(time.monotonic() - self._begun, 1e-3)
        rate = f"{done.steps / seconds / 1e6:.1f} million steps a second" if done.steps else ""
        self._bar.update(self._task, completed=done.trials, rate=rate)
