"""One participant at the server: their pages, their answers, and what is written down."""

import asyncio
import time
from typing import Any, Protocol

import msgspec
from starlette.websockets import WebSocket

from qbumpers.errors import RequestError
from qbumpers.play.connection import (
    MESSAGES_PER_SECOND,
    NOT_KEPT,
    TAKEN_OVER,
    Connection,
    GoneError,
)
from qbumpers.play.game import Game
from qbumpers.play.messages import Begin, Hello
from qbumpers.play.player import Player
from qbumpers.play.tables import Tenure
from qbumpers.play.views import task_view
from qbumpers.play.writing import Row, Writer
from qbumpers.study.design.conditions import Condition
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block
from qbumpers.study.flow.blocks import BlockPlay
from qbumpers.study.flow.messages import Answer, Attribute, Enter, Ping, Withdraw, decoded
from qbumpers.study.flow.pages import checked_content, page_of
from qbumpers.study.flow.standing import Standing, after
from qbumpers.study.flow.tables import LOG, Event, log_row


class Host(Protocol):
    """The study that visits are of.

    Attributes:
        study: what it is.
        conditions: by name.
        writer: adds rows to the records.
        exposed: whether states are sent as they are, for simulated learners.
        second: how long a second of a countdown takes.
    """

    study: Study
    conditions: dict[str, Condition]
    writer: Writer
    exposed: bool
    second: float

    async def advance(self, visit: "Visit", event: Event) -> None:
        """Write down what leads to another page, and assign a condition if it is time."""
        ...

    async def game(self, visit: "Visit", block: Block) -> tuple[Tenure, Game]:
        """The session in which a block is played, and how far it has come."""
        ...

    async def delete(self, participant: str, reason: str) -> None:
        """Delete everything of a participant."""
        ...


class StudyConnection(Connection):
    """A page of a study.

    Args:
        socket: accepted.
        per_second: messages that the page may send for long.

    Attributes:
        block: what of a block's messages the page may see; None if it shows none.
    """

    def __init__(self, socket: WebSocket, per_second: float = MESSAGES_PER_SECOND) -> None:
        super().__init__(socket, decoded, per_second)
        self.block: BlockPlay | None = None

    async def send(self, kind: str, **fields: Any) -> None:
        """Send a message, or what the page may see of it."""
        if self.block is None or kind in ("page", "pong", "closing", "problem"):
            await super().send(kind, **fields)
            return
        for shown, content in self.block.messages(kind, fields):
            await super().send(shown, **content)


class Visit:
    """A participant with at most one page; every answer is committed before the next page.

    Args:
        host: serves the study.
        participant: identifier.
        now: where they are.

    Attributes:
        participant: identifier.
        connection: the page; None while it is away.
        now: where they are.
        latency: of the connection, round trip in milliseconds as the page last measured it; None if
            it never did.
    """

    def __init__(self, host: "Host", participant: str, now: Standing) -> None:
        self.participant, self.now = participant, now
        self.connection: StudyConnection | None = None
        self.latency: float | None = None
        self._host: Host = host
        self._turn = asyncio.Lock()
        self._player: Player | None = None
        self._block: BlockPlay | None = None
        self._device = Hello()

    async def take_over(self, connection: StudyConnection) -> None:
        """Make a page the participant's; the one before is dismissed and learns why."""
        async with self._turn:
            await self._leave_block()
        before, self.connection = self.connection, connection
        if before is not None:
            await before.close(TAKEN_OVER, self._host.study.word("elsewhere"))

    async def welcome(self, connection: StudyConnection, hello: Enter, token: str) -> None:
        """Show a page where the participant is."""
        device = {field: getattr(hello, field) for field in Hello.__struct_fields__[1:]}
        self._device = Hello(**device)
        async with self._turn:
            await self.log(Event(time.time(), "arrived", {"page": hello.page, **device}))
            await connection.send("welcome", token=token)
            await self._show()

    async def leave(self, connection: StudyConnection) -> bool:
        """A page has gone.

        Returns:
            Whether nobody is there any more.
        """
        async with self._turn:
            if self.connection is connection:
                await self._leave_block()
                self.connection = None
                if not self.now.outcome:
                    await self.log(Event(time.time(), "left", {}))
            return self.connection is None

    async def handle(self, message: Any) -> None:
        """Do what a message asks for.

        Raises:
            RequestError: if it cannot be done; the study goes on as if it had not been asked.
        """
        match message:
            case Answer():
                async with self._turn:
                    await self._answer(message)
            case Ping():
                self.latency = message.last if message.last is not None else self.latency
                await self._send("pong", at=message.at)
            case Attribute():
                await self._attribute(message)
            case Withdraw():
                async with self._turn:
                    await self._withdraw()
            case Enter():
                raise RequestError("hello: it has been said already")
            case Begin():
                await self._begin(message)
            case _:
                await self._playing().handle(message)

    async def log(self, *events: Event, rows: tuple[Row, ...] = (), lasting: bool = False) -> None:
        """Write down what happened, all of it or nothing, and go where it leads."""
        added = [*rows, *((LOG, log_row(self.participant, event)) for event in events)]
        try:
            await asyncio.wrap_future(self._host.writer.add(added, lasting=lasting))
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:300]
            if self.connection is not None:
                await self.connection.close(NOT_KEPT, f"the record cannot be written: {reason}")
            raise GoneError from error
        for event in events:
            self.now = after(self._host.study, self.now, event)

    async def _answer(self, message: Answer) -> None:
        if message.number != self.now.number or self.now.outcome:
            return  # late or repeated
        part = self.now.part(self._host.study)
        if isinstance(part, Block) and not (self._block and self._block.over):
            raise RequestError(f"{part.id}: its episodes are not over")
        if part.kind == "sitting":
            raise RequestError(f"{part.id}: the next sitting has not begun")
        content = checked_content(part, message.content)
        said = {"part": part.id, "content": content, "shown": message.shown, "at": message.at}
        event = Event(time.time(), "answered", said)
        if after(self._host.study, self.now, event).outcome == "no_consent":
            await self._decline()
            return
        await self._leave_block()
        await self._host.advance(self, event)
        await self._show()

    async def _decline(self) -> None:
        """Nothing is kept of who does not agree."""
        await self._host.delete(self.participant, "no consent")
        self.now = self.now._replace(outcome="no_consent", number=self.now.number + 1)
        await self._show()

    async def _withdraw(self) -> None:
        await self._leave_block()
        await self._host.delete(self.participant, "withdrawn")
        self.now = self.now._replace(outcome="withdrawn", number=self.now.number + 1)
        await self._show()

    async def _leave_block(self) -> None:
        """Stop the clock of a block, and wait for what is on its way into the record."""
        player, self._player, self._block = self._player, None, None
        if self.connection is not None:
            self.connection.block = None
        if player is not None and player.connection is not None:
            await player.leave(player.connection)

    async def _show(self) -> None:
        """The present page, with its block if it has one."""
        study = self._host.study
        page = page_of(study, self.now)
        part = None if self.now.outcome else self.now.part(study)
        connection = self.connection
        if not isinstance(part, Block):
            await self._send("page", page=page)
            return
        tenure, game = await self._host.game(self, part)
        condition = self._host.conditions.get(self.now.condition)
        self._block = BlockPlay(study, part, condition, self.now, game, exposed=self._host.exposed)
        self._player = Player(tenure, game, self._host.writer, self._host.second, with_view=False)
        await self._send("page", page={**page, **self._block.page()})
        if connection is not None:
            connection.block = self._block
            await self._player.take_over(connection)
            await self._player.welcome(connection, self._device, {"task": task_view(game.setup)})

    async def _begin(self, message: Begin) -> None:
        """The next episode, with who assists in it by the plan, whatever the page says."""
        player = self._playing()
        if self._block is None or not self._block.awaits(message.episode):
            return  # late or repeated
        choice = self._block.next_choice()
        if choice is None:
            raise RequestError("begin: this block has no further episode")
        planned = {"assistant": choice.name, "options": choice.options}
        await player.handle(msgspec.structs.replace(message, **planned, assisted=choice.assisted))

    async def _attribute(self, message: Attribute) -> None:
        part = self.now.part(self._host.study)
        if self._player is None:
            raise RequestError("attribute: nothing is played")
        said = {
            "part": part.id, "session": self._player.tenure.session, "number": message.number,
            "answer": message.answer, "shown": message.shown, "at": message.at,
        }  # fmt: skip
        await self.log(Event(time.time(), "attributed", said))

    def _playing(self) -> Player:
        if self._player is None:
            raise RequestError("nothing is played on this page")
        return self._player

    async def _send(self, kind: str, **fields: Any) -> None:
        if self.connection is not None:
            await self.connection.send(kind, **fields)
