"""Rehearsing a study: a server, and simulated learners who come to it."""

import asyncio
import contextlib
import threading
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any, NamedTuple

import uvicorn
from starlette.routing import BaseRoute

from qbumpers.errors import RequestError
from qbumpers.play.addresses import listening_at
from qbumpers.play.running import configuration
from qbumpers.play.server import make_application
from qbumpers.play.setup import Setup
from qbumpers.study.bots.page import BotPage, Taken
from qbumpers.study.bots.person import Person
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Sitting
from qbumpers.study.flow.server import PAGE, StudyHost

AT_ONCE = 8
"""Simulated learners who take part at the same time."""

TakePart = Callable[[str, Person, Mapping[str, str]], Any]
"""How somebody takes part: `(address, person, arrival)`, an awaitable of `Taken`."""


class Rehearsed(NamedTuple):
    """What became of a rehearsal.

    Attributes:
        outcomes: how many participants ended how.
        reloads: of pages, in all.
    """

    outcomes: Counter[str]
    reloads: int


def without_waiting(study: Study) -> Study:
    """A study whose later sittings can be begun at once."""
    parts = [
        part.model_copy(update={"after_days": 0.0}) if isinstance(part, Sitting) else part
        for part in study.parts
    ]
    return study.model_copy(update={"parts": parts})


@contextlib.contextmanager
def serving(
    make_host: Callable[[], StudyHost],
    more: Callable[[StudyHost], Sequence[BaseRoute]] = lambda host: (),
) -> Generator[tuple[str, StudyHost], None, None]:
    """A study on this machine, served from a thread.

    Args:
        make_host: makes the study that is served.
        more: further routes, for instance the researcher's.

    Yields:
        The address, "host:port", and the study.
    """
    with contextlib.closing(listening_at(0)) as listening:
        address = f"127.0.0.1:{listening.getsockname()[1]}"
        host = make_host()
        application = make_application(
            host, [address], file=PAGE, routes=[*host.routes(), *more(host)]
        )
        server = uvicorn.Server(configuration(application))
        thread = threading.Thread(target=server.run, args=[[listening]], daemon=True)
        thread.start()
        try:
            yield address, host
        finally:
            server.should_exit = True
            thread.join(20)


def arrival_of(study: Study, number: int) -> dict[str, str]:
    """What the link of a simulated participant says.

    Args:
        study: that they take part in.
        number: of the participant, from 0.

    Raises:
        RequestError: if the class list has no code for them.
    """
    recruitment = study.recruitment
    if recruitment.by == "prolific":
        return {"PROLIFIC_PID": f"simulated-{number}", "STUDY_ID": "s", "SESSION_ID": f"v{number}"}
    if recruitment.by == "open":
        return {}
    if number >= len(recruitment.class_list):
        raise RequestError(
            f"participants: class_list has {len(recruitment.class_list)} codes; simulate at most "
            "as many"
        )
    return {"code": recruitment.class_list[number]}


def by_socket(address: str, person: Person, arrival: Mapping[str, str]) -> Any:
    """Take part over the WebSocket alone, see `TakePart`."""
    return BotPage(address, person, arrival).take_part()


def rehearse(
    study: Study,
    setups: Mapping[str, Setup],
    engine: Any,
    participants: int,
    *,
    take_part: TakePart = by_socket,
    at_once: int = AT_ONCE,
    advance: Callable[[Taken], None] = lambda taken: None,
) -> Rehearsed:
    """Let simulated learners take part in a study, through the real WebSocket.

    Args:
        study: in which they take part; what it says of later sittings is left to
            `without_waiting`.
        setups: what is played in each block, by its id.
        engine: of the records, which must be those of a rehearsal.
        participants: how many, at least 1.
        take_part: how one takes part.
        at_once: how many take part at the same time.
        advance: is called with each who is done.

    Raises:
        RequestError: if the class list has too few codes, or something goes wrong for one.
    """
    arrivals = [arrival_of(study, number) for number in range(participants)]
    learners = study.rehearsal.learners

    async def everybody(address: str) -> list[Taken]:
        free = asyncio.Semaphore(at_once)

        async def one(number: int) -> Taken:
            async with free:
                person = Person(study, setups, learners[number % len(learners)], number)
                taken: Taken = await take_part(address, person, arrivals[number])
                advance(taken)
                return taken

        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(one(number)) for number in range(participants)]
        return [task.result() for task in tasks]

    def make() -> StudyHost:
        return StudyHost(study, setups, engine, "simulated", exposed=True, second=0.01)

    with serving(make) as (address, _):
        taken = _run(everybody(address))
    return Rehearsed(Counter(each.outcome for each in taken), sum(each.reloads for each in taken))


def _run(everybody: Any) -> list[Taken]:
    try:
        return asyncio.run(everybody)
    except* RequestError as errors:
        raise errors.exceptions[0] from None
