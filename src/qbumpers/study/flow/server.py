"""The server of a study: who comes, who they are, and which condition they are assigned to."""

import asyncio
import contextlib
import secrets
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sqlalchemy as sql
from itsdangerous import BadSignature, URLSafeSerializer
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route
from starlette.websockets import WebSocket

import qbumpers
from qbumpers.errors import RequestError
from qbumpers.play.connection import MESSAGES_PER_SECOND, GoneError
from qbumpers.play.game import Game, resumed
from qbumpers.play.server import Entrance, UnknownSessionError
from qbumpers.play.setup import Setup
from qbumpers.play.tables import (
    SESSIONS,
    TENURES,
    Tenure,
    read_session,
    secret_of,
    take_session,
)
from qbumpers.play.writing import Row, Writer
from qbumpers.study.design.assignment import Assigned, Seat, assign
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block
from qbumpers.study.flow.forgetting import delete_participant
from qbumpers.study.flow.messages import Enter
from qbumpers.study.flow.pages import facts_of
from qbumpers.study.flow.standing import (
    MINUTE,
    after,
    attempts_at,
    needs_assignment,
    returning,
    seat_of,
    standing,
    training_of,
)
from qbumpers.study.flow.tables import (
    IDENTITIES,
    LOG,
    PARTICIPANTS,
    Event,
    events_of,
    identity_of,
    last_step_of,
    log_row,
    session_name,
)
from qbumpers.study.flow.visit import StudyConnection, Visit

PAGE = "study.html"
"""The page of a study in the folder of pages."""


class StudyHost(Entrance):
    """A study that is being served; one process serves it, and assigns one after the other.

    Args:
        study: what it is.
        setups: what is played in each block, by its id.
        engine: as `open_records` gave it.
        mode: "pilot" or "live".
        exposed: whether states are sent as they are, for simulated learners.
        second: how long a second of a countdown takes.

    Attributes:
        study: what it is.
        conditions: by name.
        writer: adds rows to the records.
        engine: as `open_records` gave it.
        exposed: see above.
        second: see above.
        visits: participants who are there, by identifier.
        token: that opens the researcher's page.
    """

    def __init__(
        self,
        study: Study,
        setups: Mapping[str, Setup],
        engine: sql.Engine,
        mode: str = "pilot",
        *,
        exposed: bool = False,
        second: float = 1.0,
    ) -> None:
        super().__init__()
        self.study, self.engine, self.exposed, self.second = study, engine, exposed, second
        self.conditions = {condition.name: condition for condition in study.all_conditions()}
        self.writer = Writer(engine)
        self.visits: dict[str, Visit] = {}
        self.token = secrets.token_urlsafe(16)
        self._setups, self._mode = setups, mode
        self._signer = URLSafeSerializer(secret_of(engine), salt="participant")
        self._finding, self._assigning = asyncio.Lock(), asyncio.Lock()

    def connection(self, socket: WebSocket) -> StudyConnection:
        """A page at the other end of a socket; simulated learners are quicker than people."""
        return StudyConnection(socket, 1e6 if self.exposed else MESSAGES_PER_SECOND)

    def routes(self) -> Sequence[BaseRoute]:
        """What is served beside the page and its socket."""
        facts = facts_of(self.study, self._mode)

        async def answer(_: Request) -> JSONResponse:
            return JSONResponse(facts)

        return [Route("/facts", answer)]

    async def join(self, connection: StudyConnection, hello: Enter) -> Visit:
        """Whose page it is that has greeted.

        Raises:
            UnknownSessionError: if the token is of nobody.
            RequestError: if the link is not one of the study.
        """
        async with self._finding:
            visit = await self._visit(hello)
            await visit.take_over(connection)
            return visit

    async def welcome(self, visit: Visit, connection: StudyConnection, hello: Enter) -> None:
        """Show a page where its participant is."""
        await visit.welcome(connection, hello, self._signer.dumps(visit.participant))

    async def leave(self, visit: Visit, connection: StudyConnection) -> None:
        """A page has gone; a participant without one is not kept in memory."""
        with contextlib.suppress(GoneError):
            if await visit.leave(connection) and self.visits.get(visit.participant) is visit:
                del self.visits[visit.participant]

    def close(self) -> None:
        """Write what is waiting."""
        self.writer.close()

    async def advance(self, visit: Visit, event: Event) -> None:
        """Write down what leads to another page, and assign a condition if it is time.

        Args:
            visit: of the participant whose page sent it.
            event: what happened.
        """
        following = after(self.study, visit.now, event)
        if not needs_assignment(self.study, following):
            await visit.log(event, lasting=True)
            return
        async with self._assigning:
            seats = await asyncio.to_thread(self.seats)
            await visit.log(event, await self._assignment(seats), lasting=True)

    def seats(self) -> list[Seat]:
        """Everybody who was assigned, as the assignment sees them."""
        now = time.time()
        found: list[Seat] = []
        for participant, events in events_of(self.engine).items():
            at = standing(self.study, events)
            if at.condition:
                visit = self.visits.get(participant)
                is_here = visit is not None and visit.connection is not None
                heard = now if is_here else at.heard
                found.append(seat_of(self.study, participant, at, now, heard))
        return found

    async def game(self, visit: Visit, block: Block) -> tuple[Tenure, Game]:
        """The session in which a block is played, and how far it has come.

        Args:
            visit: of the participant whose page sent it.
            block: that is played.

        Raises:
            RequestError: if the record does not lead to the same steps any more.
        """
        name = session_name(visit.participant, block.id, visit.now.attempt)
        setup = self._setups[block.id]
        tenure = await asyncio.to_thread(take_session, self.engine, name)
        recorded = await asyncio.to_thread(read_session, self.engine, name)
        if tenure is None or recorded is None:
            seed, tenure = secrets.randbits(63), Tenure(name, 0)
            rows = (self._session_row(name, seed, setup), (TENURES, tenure.row()))
            await visit.log(rows=rows)
            return tenure, Game(setup, seed)
        difference = setup.difference(recorded.setup)
        if difference:
            raise RequestError(f"block {block.id} cannot go on: {difference}")
        return tenure, await asyncio.to_thread(resumed, setup, recorded.seed, recorded.played)

    async def delete(self, participant: str, reason: str) -> None:
        """Delete everything of a participant.

        Args:
            participant: identifier.
            reason: for the tombstone.
        """
        await asyncio.to_thread(delete_participant, self.engine, participant, reason)

    async def _visit(self, hello: Enter) -> Visit:
        participant = await self._participant(hello)
        visit = self.visits.get(participant)
        if visit is None:
            events = await asyncio.to_thread(events_of, self.engine, [participant])
            if not events:
                raise UnknownSessionError("this study knows no such participant")
            visit = Visit(self, participant, standing(self.study, events[participant]))
            self.visits[participant] = visit
        await self._let_in(visit, hello.page)
        return visit

    async def _let_in(self, visit: Visit, page: str) -> None:
        """What becomes of a participant who comes back."""
        now = time.time()
        step = await asyncio.to_thread(last_step_of, self.engine, visit.participant)
        heard = now if visit.connection is not None else max(visit.now.heard, step)
        found = returning(self.study, visit.now, now, page, heard)
        if found == "open":
            part = visit.now.part(self.study).id
            said: dict[str, Any] = {"part": part, "content": {}, "shown": None, "at": None}
            await self.advance(visit, Event(now, "answered", said))
        elif found == "restart":
            await visit.log(Event(now, "restarted", {}))
        elif found in ("late", "blocked"):
            await visit.log(Event(now, "ended", {"outcome": found}), lasting=True)

    async def _participant(self, hello: Enter) -> str:
        """Who comes: by the link, else by the token, else somebody new."""
        identity = self._identity(hello.arrival)
        if identity:
            known = await asyncio.to_thread(identity_of, self.engine, identity)
            return known or await self._new(identity, hello.arrival)
        if hello.token:
            try:
                return str(self._signer.loads(hello.token))
            except BadSignature:
                raise UnknownSessionError("this study knows no such participant") from None
        if self.study.recruitment.by != "open":
            raise RequestError(self.study.word("unknown"))
        return await self._new("", {})

    def _identity(self, arrival: Mapping[str, str]) -> str:
        """Who somebody says that they are; empty if the link does not say."""
        by = self.study.recruitment.by
        if by == "prolific":
            return arrival.get("PROLIFIC_PID", "")
        code = arrival.get("code", "") if by == "class" else ""
        if code and code not in self.study.recruitment.class_list:
            raise RequestError(self.study.word("unknown"))
        return code

    async def _new(self, identity: str, arrival: Mapping[str, str]) -> str:
        participant, now = secrets.token_hex(8), time.time()
        rows: list[Row] = [
            (PARTICIPANTS, {"participant": participant, "came": now}),
            (LOG, log_row(participant, Event(now, "came", {"version": qbumpers.__version__}))),
        ]
        if identity:
            row = {
                "participant": participant,
                "identity": identity,
                "study_id": arrival.get("STUDY_ID", ""),
                "session_id": arrival.get("SESSION_ID", ""),
            }
            rows.append((IDENTITIES, row))
        await asyncio.wrap_future(self.writer.add(rows))
        return participant

    async def _assignment(self, seats: Sequence[Seat]) -> Event:
        draw = np.random.default_rng([self.study.seed, len(seats), *b"Assignment"]).random()
        now = time.time()
        stale = self.study.stale_after_minutes * MINUTE
        orders = len(self.study.orders())
        found = assign(list(self.conditions.values()), orders, seats, now, stale, float(draw))
        if found is None:
            return Event(now, "ended", {"outcome": "full"})
        yoke = await asyncio.to_thread(self._yoke, found)
        return Event(now, "assigned", {**found._asdict(), **yoke})

    def _yoke(self, assigned: Assigned) -> dict[str, list[int]]:
        """Lengths and overrides of the partner's assisted episodes."""
        found: dict[str, list[int]] = {"lengths": [], "overrides": []}
        if not assigned.partner:
            return found
        blocks = [block.id for block in training_of(self.study)]
        events = events_of(self.engine, [assigned.partner])[assigned.partner]
        for block, attempt in attempts_at(blocks, self.study, events).items():
            name = session_name(assigned.partner, block, attempt)
            recorded = read_session(self.engine, name)
            for played in recorded.played if recorded else ():
                if played.choice.assisted:
                    found["lengths"].append(len(played.steps))
                    found["overrides"].append(sum(bool(s.overridden) for s in played.steps))
        return found

    def _session_row(self, name: str, seed: int, setup: Setup) -> Row:
        row = {
            "session": name,
            "began": time.time(),
            "seed": str(seed),
            "setup": setup.described(),
            "version": qbumpers.__version__,
        }
        return SESSIONS, row
