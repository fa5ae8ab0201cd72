"""What the researcher's page shows of a study that is running, behind a token."""

import asyncio
import io
import secrets
import tempfile
import time
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sql
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route

from qbumpers.analysis.statistics import mean_interval
from qbumpers.play.server import STATIC
from qbumpers.play.setup import Setup
from qbumpers.play.tables import STEPS
from qbumpers.study.design.assignment import counts
from qbumpers.study.flow.server import StudyHost
from qbumpers.study.flow.standing import MINUTE, Standing, seat_of, standing, training_of
from qbumpers.study.flow.tables import events_of, participants_in
from qbumpers.study.outcomes.export import export_study
from qbumpers.tasks.dynamics import ENDS


def researcher_routes(host: StudyHost, setups: Mapping[str, Setup]) -> Sequence[BaseRoute]:
    """The researcher's page, its data and the export, which need the host's token.

    The token is sent in a header, never in an address: addresses are logged.

    Args:
        host: serves the study.
        setups: what is played in each block, by its id.
    """

    def refused(request: Request) -> bool:
        given = request.headers.get("authorization", "").removeprefix("Bearer ")
        return not secrets.compare_digest(given.encode(), host.token.encode())

    async def page(_: Request) -> Response:
        return FileResponse(STATIC / "researcher.html")

    async def data(request: Request) -> Response:
        if refused(request):
            return PlainTextResponse("the token is another one", 403)
        return JSONResponse(await asyncio.to_thread(overview, host))

    async def export(request: Request) -> Response:
        if refused(request):
            return PlainTextResponse("the token is another one", 403)
        content = await asyncio.to_thread(_zipped, host, setups)
        return Response(content, media_type="application/zip")

    return [
        Route("/researcher", page),
        Route("/researcher/data", data),
        Route("/researcher/export", export),
    ]


def overview(host: StudyHost) -> dict[str, Any]:
    """Who is where, counts per condition, drop-out, latency and learning curves, JSON-like.

    Args:
        host: serves the study.
    """
    study, now = host.study, time.time()
    came = participants_in(host.engine)
    events = events_of(host.engine)
    places = {name: standing(study, events.get(name, [])) for name in came}
    names = {condition: dict.fromkeys(_STATES, 0) for condition in ["", *host.conditions]}
    people: list[dict[str, Any]] = []
    for name, at in places.items():
        visit = host.visits.get(name)
        here = visit is not None and visit.connection is not None
        seat = seat_of(study, name, at, now, now if here else at.heard)
        stale = study.stale_after_minutes * MINUTE
        state = seat.progress
        if state == "ongoing" and not counts(seat, now, stale):
            state = "stale"
        names[at.condition][state] += 1
        people.append({
            "participant": name, "condition": at.condition, "state": state, "here": here,
            "part": at.outcome or at.parts[at.place], "minutes": round((now - came[name]) / 60, 1),
            "latency": visit.latency if visit is not None else None,
        })  # fmt: skip
    finished = sum(person["state"] in ("complete", "ended", "stale") for person in people)
    lost = sum(person["state"] in ("ended", "stale") for person in people)
    return {
        "title": study.title,
        "counts": [{"condition": c or "not assigned yet", **n} for c, n in names.items()],
        "people": people,
        "drop_out": lost / finished if finished else None,
        "curves": _curves(host, places),
    }


_STATES = ("complete", "ongoing", "stale", "ended")


def _curves(host: StudyHost, places: Mapping[str, Standing]) -> list[dict[str, Any]]:
    """Mean score of each episode of training per condition, with its interval."""
    blocks = {block.id: block.plan() for block in training_of(host.study)}
    scores: dict[tuple[str, int, bool], list[float]] = {}
    query = (
        sql.select(
            STEPS.c.session, STEPS.c.episode, sql.func.sum(STEPS.c.reward).label("score"),
            sql.func.max(STEPS.c.events).label("events"),
        )
        .group_by(STEPS.c.session, STEPS.c.episode)
    )  # fmt: skip
    with host.engine.connect() as connection:
        for row in connection.execute(query):
            name, block, _ = row.session.rsplit(".", 2)
            if block in blocks and name in places and row.events & ENDS:
                assisted = blocks[block][int(row.episode)]
                key = (places[name].condition, int(row.episode), assisted)
                scores.setdefault(key, []).append(float(row.score))
    found: list[dict[str, Any]] = []
    for (condition, episode, assisted), values in sorted(scores.items()):
        mean, low, high = mean_interval(np.array(values))
        ends = [None if np.isnan(end) else end for end in (low, high)]
        found.append({
            "condition": condition, "episode": episode, "assisted": assisted, "mean": mean,
            "low": ends[0], "high": ends[1], "participants": len(values),
        })  # fmt: skip
    return found


def _zipped(host: StudyHost, setups: Mapping[str, Setup]) -> bytes:
    """The export in one file; it is not noted, since it goes where it cannot be followed."""
    buffer = io.BytesIO()
    with tempfile.TemporaryDirectory() as folder:
        export_study(host.engine, host.study, setups, Path(folder), noted=False)
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for path in sorted(Path(folder).rglob("*")):
                if path.is_file():
                    archive.write(path, path.relative_to(folder))
    return buffer.getvalue()
