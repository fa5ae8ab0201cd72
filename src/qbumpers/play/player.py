"""One participant's session: what their page says, the clock, and what is written down."""

import asyncio
import contextlib
import json
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from qbumpers.errors import RequestError, action_number
from qbumpers.play.connection import (
    AGAIN,
    FAILED,
    NOT_KEPT,
    TAKEN_OVER,
    Connection,
    GoneError,
)
from qbumpers.play.game import Choice, Game
from qbumpers.play.messages import (
    Act,
    Begin,
    Continue,
    Focus,
    Hello,
    Hold,
    Message,
    Pause,
    Speed,
)
from qbumpers.play.tables import EPISODES, NOTES, STEPS, Tenure, step_row
from qbumpers.play.views import episode_view, state_view
from qbumpers.play.writing import Row, TakenOverError, UnreachableError, Writer

COUNTDOWN = 3
"""Seconds before the clock goes on."""

AWAY = 1.5
"""Seconds without a sign of life after which the clock stops."""

_VIEW_EVERY = 5  # steps of a real-time task between two views of the assistant's


class Proposal(NamedTuple):
    """An action as a page proposed it.

    Attributes:
        action: in [0, A), to be checked.
        device: that it was proposed with.
        pressed: milliseconds of the page's clock; None if nothing is pressed.
        shown: when the state was shown, likewise.
        received: seconds since 1970; None if nothing was.
    """

    action: int
    device: str
    pressed: float | None
    shown: float | None
    received: float | None


class Player:
    """A session with at most one page; every step is committed before its outcome is shown.

    Args:
        tenure: by which its steps are added to the record.
        game: as far as the record goes.
        writer: adds rows to the records.
        second: how long a second of the countdown takes.
        with_view: whether the page is sent what the assistant sees.

    Attributes:
        tenure: see above; it has the session's identifier.
        connection: the page; None while it is away.
        lost: whether the game went wrong, so that the record alone knows the state.
    """

    def __init__(
        self,
        tenure: Tenure,
        game: Game,
        writer: Writer,
        second: float = 1.0,
        *,
        with_view: bool = True,
    ) -> None:
        self.tenure = tenure
        self.connection: Connection | None = None
        self.lost = False
        self._game, self._writer, self._second = game, writer, second
        self._with_view = with_view
        self._display = game.setup.display
        self._stepping = asyncio.Lock()
        self._clock: asyncio.Task[None] | None = None
        self._ticking = 0  # number of the clock that may go; any change stops the one before
        self._share = 1.0
        self._held: Hold | None = None
        self._held_since: float | None = None
        self._sequence = -1
        self._heard = 0.0

    async def welcome(self, connection: Connection, hello: Hello, facts: Mapping[str, Any]) -> None:
        """Show a page where the session is; `connection` is that page already.

        Args:
            connection: to the page that plays.
            hello: what it said of itself.
            facts: what else it needs to know.
        """
        await self._note("joined", {f: getattr(hello, f) for f in hello.__struct_fields__[1:]})
        async with self._stepping:
            game = self._game
            await connection.send(
                "welcome",
                **facts,
                history=[episode_view(episode) for episode in game.episodes],
                share=self._share,
            )
            if game.episodes:
                await connection.send("state", **state_view(game, with_view=self._with_view))
        self._start_clock()

    async def take_over(self, connection: Connection) -> None:
        """Make a page the one that plays; the one before is dismissed and learns why."""
        before, self.connection = self.connection, connection
        self._stop_clock()
        self._held, self._sequence = None, -1
        if before is not None:
            await before.close(TAKEN_OVER, "this session goes on in another tab or window")

    async def leave(self, connection: Connection) -> bool:
        """A page has gone.

        Returns:
            Whether nobody plays any more and all that happened is written, or never will be.
        """
        if self.connection is connection:
            self.connection = None
            self._stop_clock()
            await self._note("left", {})
        async with self._stepping:  # a step may be on its way into the record
            return self.connection is None

    async def handle(self, message: Message) -> None:
        """Do what a message asks for.

        Raises:
            RequestError: if it cannot be done; the session goes on as if it had not been asked.
        """
        self._heard = time.monotonic()
        match message:
            case Act():
                await self._act(message)
            case Hold():
                self._hold(message)
            case Begin():
                await self._begin(message)
            case Focus():
                await self._note("focus", {"focused": message.focused, "at": message.at})
                if not message.focused:
                    await self._pause("the page is not in front")
            case Pause():
                await self._pause("")
            case Continue():
                self._start_clock()
            case Speed():
                self._share = 1.0 if message.share == "1" else 0.5
                await self._note("speed", {"share": self._share})
            case Hello():
                raise RequestError("hello: it has been said already")

    async def _begin(self, message: Begin) -> None:
        game = self._game
        async with self._stepping:
            if message.episode != len(game.episodes) or game.playing:
                return  # late or repeated
            choice = Choice(message.assistant, message.options, message.assisted)
            await asyncio.to_thread(game.begin, choice)
            row = {
                "session": self.tenure.session,
                "episode": message.episode,
                "began": time.time(),
                "assistant": choice.name,
                "options": _json(choice.options),
                "assisted": choice.assisted,
            }
            await self._commit((EPISODES, row))
            await self._show()
        self._start_clock()

    async def _act(self, message: Act) -> None:
        if self._display.rate > 0:
            raise RequestError("act: this task goes by the clock; hold an action instead")
        received = time.time()
        async with self._stepping:
            if message.number != self._game.number or not self._game.playing:
                return  # late or repeated
            await self._step(
                Proposal(message.action, message.device, message.pressed, message.shown, received)
            )

    def _hold(self, message: Hold) -> None:
        if message.sequence <= self._sequence:
            return  # late
        if message.action is not None:
            action_number(message.action, "action", 0, len(self._display.actions))
        self._sequence = message.sequence
        if self._held is None or self._held.action != message.action:
            self._held_since = time.time()
        self._held = message

    async def _step(self, proposal: Proposal) -> None:
        """One step, written down and shown; `_stepping` is held."""
        game = self._game
        action_number(proposal.action, "action", 0, game.setup.task.actions)
        try:
            step = game.propose(proposal.action)
        except RequestError as error:
            await self._give_up(FAILED, str(error))
            raise GoneError from error
        over = not game.playing
        row = {
            **step_row(self.tenure.session, game.number - 1, game.episodes[-1].number, step),
            "device": proposal.device,
            "shown": proposal.shown,
            "pressed": proposal.pressed,
            "received": proposal.received,
            "applied": time.time(),
        }
        await self._commit((STEPS, row), lasting=over)
        await self._show()

    async def _commit(self, row: Row, *, lasting: bool = False) -> None:
        try:
            await asyncio.wrap_future(self._writer.add([row], self.tenure, lasting=lasting))
        except TakenOverError as error:
            await self._give_up(TAKEN_OVER, str(error))
            raise GoneError from error
        except UnreachableError as error:
            await self._give_up(AGAIN, f"the database cannot be reached just now: {error}")
            raise GoneError from error
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            await self._give_up(NOT_KEPT, f"the record cannot be written: {reason}")
            raise GoneError from error

    async def _give_up(self, code: int, reason: str) -> None:
        """Leave a game that is ahead of its record; who comes back gets the recorded one."""
        self.lost = True
        self._stop_clock()
        if self.connection is not None:
            await self.connection.close(code, reason)

    async def _note(self, kind: str, content: Mapping[str, Any]) -> None:
        row = {"session": self.tenure.session, "time": time.time(), "kind": kind}
        await self._commit((NOTES, {**row, "content": _json(content)}))

    async def _show(self) -> None:
        game = self._game
        turns = self._display.rate == 0
        due = turns or not game.episodes[-1].length % _VIEW_EVERY or not game.playing
        with_view = self._with_view and due
        await self._send("state", **state_view(game, with_view=with_view))

    async def _send(self, kind: str, **fields: Any) -> None:
        """To the page, if it is there; if not, the clock stops."""
        connection = self.connection
        if connection is None:
            return
        try:
            await connection.send(kind, **fields)
        except GoneError:
            self._stop_clock()

    async def _pause(self, why: str) -> None:
        if self._display.rate > 0 and self._game.playing:
            self._stop_clock()
            await self._note("paused", {"why": why})
            await self._send("paused", why=why)

    def _stop_clock(self) -> None:
        self._ticking += 1
        self._held = None

    def _start_clock(self) -> None:
        """Let the clock of a real-time task go, after a countdown."""
        if self._display.rate > 0 and self._game.playing and self.connection is not None:
            self._ticking += 1
            self._heard = time.monotonic()
            self._clock = asyncio.create_task(self._run_clock(self._ticking))

    async def _run_clock(self, number: int) -> None:
        """Count down and go, until another clock has started, none may, or the page has gone."""
        with contextlib.suppress(GoneError):
            if await self._counted_down(number):
                await self._go(number)

    async def _counted_down(self, number: int) -> bool:
        """Whether this clock may still go after its countdown."""
        for seconds in range(COUNTDOWN, 0, -1):
            await self._send("countdown", seconds=seconds)
            await asyncio.sleep(self._second)
            if self._ticking != number:
                return False
        return True

    async def _go(self, number: int) -> None:
        """Step at the task's rate."""
        await self._send("running")
        self._heard = time.monotonic()
        due = time.monotonic()
        while self._game.playing:
            due = max(due + 1 / (self._display.rate * self._share), time.monotonic() - 0.1)
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            async with self._stepping:
                if self._ticking != number:
                    return
                await self._step(self._proposed_now())
            if time.monotonic() - self._heard > AWAY:
                await self._pause("the page has not been heard of")

    def _proposed_now(self) -> Proposal:
        held = self._held
        idle = self._display.idle
        if idle < 0:
            idle = self._game.number % self._game.setup.task.actions
        if held is None:
            return Proposal(idle, "none", None, None, None)
        action = idle if held.action is None else held.action
        return Proposal(action, held.device, held.pressed, held.shown, self._held_since)


def _json(content: Any) -> str:
    return json.dumps(content, sort_keys=True)
