"""What a long run shows while it goes on."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import rich.progress
from rich.markup import escape
from rich.text import Text

from qbumpers.cli.console import ERRORS, OUTPUT, duration
from qbumpers.errors import counted

if TYPE_CHECKING:
    from qbumpers.comparison.running import ComparisonProgress
    from qbumpers.experiments.run import RunProgress
    from qbumpers.tuning import TuningProgress

_TRUST = 4  # finished trials that weigh as much as what was expected before the first


class TrialProgress:
    """A bar of trials, with steps per second and the time left.

    Args:
        what: is going on, for example "simulating".
        announce: prints what is to be expected, once that is known.
    """

    def __init__(self, what: str, announce: Callable[[Any], None]) -> None:
        columns = (
            rich.progress.TextColumn("{task.description}"),
            rich.progress.BarColumn(),
            rich.progress.TextColumn("{task.completed:,.0f} of {task.fields[whole]}"),
            rich.progress.TextColumn("{task.fields[rate]}"),
            _TimeLeft(),
        )
        self._bar = rich.progress.Progress(*columns, console=OUTPUT)
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
        if kind is None:  # a race, which may need fewer trials, is at its end too
            for each in self._bar.tasks:
                done = int(each.completed)
                self._bar.update(each.id, total=done, ends=None, whole=counted(done, "trial"))
        self._bar.stop()

    def show(self, done: "RunProgress | TuningProgress | ComparisonProgress") -> None:
        """Show how far it is."""
        if self._begun is None:
            self._begun = time.monotonic()
            self._waiting.stop()
            for name in done.damaged:
                ERRORS.print(f"damaged, to be made again: {escape(name)}", soft_wrap=True)
            for reason in done.changed:
                ERRORS.print(f"changed: {escape(reason)}", soft_wrap=True)
            self._announce(done)
            self._bar.start()
            expected = getattr(done, "expected", None)  # others cannot tell
            self._before = Before(done.trials, expected)
            self._task = self._bar.add_task(
                self._what, total=done.of, rate="", ends=None, whole=counted(done.of, "trial")
            )
        seconds = max(time.monotonic() - self._begun, 1e-3)
        left = time_left(self._before, done.trials, done.of, seconds)
        self._bar.update(
            self._task,
            completed=done.trials,
            rate=rate(done.steps, seconds),
            ends=None if left is None else time.monotonic() + left,
        )


class Before(NamedTuple):
    """What was known before a run.

    Attributes:
        trials: how many trials were there already.
        expected: seconds that the others were to take; None if it is unknown.
    """

    trials: int
    expected: float | None


class _TimeLeft(rich.progress.ProgressColumn):
    """The time left, counted down between one finished trial and the next."""

    def render(self, task: rich.progress.Task) -> Text:
        """See Rich."""
        ends = task.fields["ends"]
        if ends is None or task.finished:
            return Text("")
        return Text(f"{duration(max(0.0, ends - time.monotonic()))} left")


def time_left(before: Before, trials: int, of: int, seconds: float) -> float | None:
    """Seconds that are left: as expected at first, more and more by what trials have taken.

    Args:
        before: what was known before the run.
        trials: finished now.
        of: trials of the whole run.
        seconds: since the run began.

    Returns:
        The time; None if nothing is known yet.
    """
    finished, remaining = trials - before.trials, of - trials
    if before.expected is None:
        return seconds / finished * remaining if finished else None
    trust = _TRUST / (finished + _TRUST)
    usual = before.expected / max(1, of - before.trials)
    measured = seconds / finished if finished else usual
    return (trust * usual + (1 - trust) * measured) * remaining


def rate(steps: int, seconds: float) -> str:
    """How fast it goes, for example "4.1 million steps per second"."""
    if not steps:
        return ""
    speed = steps / seconds
    number = f"{speed / 1e6:.1f} million" if speed >= 1e5 else f"{speed:,.0f}"
    return f"{number} steps per second"
