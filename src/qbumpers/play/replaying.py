"""Deciding recorded sessions again."""

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import sqlalchemy as sql

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Step
from qbumpers.errors import RequestError, in_short
from qbumpers.play.game import Played
from qbumpers.play.setup import Setup, setup_of
from qbumpers.play.stepping import chance_of
from qbumpers.play.tables import Recorded, open_records, read_session, sessions_in
from qbumpers.session import ReplayError, replay
from qbumpers.tasks.dynamics import LIMIT


class Replayed(NamedTuple):
    """What became of a recorded session.

    Attributes:
        session: identifier.
        task: name of the task.
        episodes: recorded.
        steps: that were decided and done again.
        difference: the first thing that came out differently, in words; empty if nothing did.
    """

    session: str
    task: str
    episodes: int
    steps: int
    difference: str


def replay_file(records: str | Path, sessions: Sequence[str] = ()) -> Iterator[Replayed]:
    """Hold rule and task to the sessions of records.

    Args:
        records: as `open_records` takes them.
        sessions: identifiers of those that are meant; all if there are none.

    Yields:
        What became of each.

    Raises:
        RequestError: as `open_records`, or if there is no such session; before the first one.
    """
    engine = open_records(records, new=False)
    chosen = chosen_sessions(engine, sessions)
    return _replayed(engine, chosen)


def chosen_sessions(engine: sql.Engine, sessions: Sequence[str]) -> list[str]:
    """Those of the sessions of a record that are meant.

    Args:
        engine: as `open_records` gave it.
        sessions: identifiers; all if there are none.

    Raises:
        RequestError: if there is no such session.
    """
    found = sessions_in(engine)
    for session in sessions:
        if session not in found:
            raise RequestError(f"session = {session!r}: the record has {in_short(found)}")
    return list(sessions) or found


def _replayed(engine: sql.Engine, sessions: Sequence[str]) -> Iterator[Replayed]:
    for session in sessions:
        recorded = read_session(engine, session)
        if recorded is not None:
            yield replay_session(recorded)
    engine.dispose()


def replay_session(recorded: Recorded) -> Replayed:
    """Hold rule and task to a recorded session; an episode that has not ended is held so far.

    Args:
        recorded: the session.
    """
    steps = sum(len(played.steps) for played in recorded.played)
    about = (recorded.session, str(recorded.setup.get("task")), len(recorded.played), steps)
    try:
        setup = setup_of(recorded.setup)
        difference = setup.difference(recorded.setup)
        if not difference:
            _replay(setup, recorded)
    except ReplayError as error:
        difference = str(error).removeprefix("replay: ")
    except RequestError as error:
        difference = str(error)
    return Replayed(*about, difference)


def _replay(setup: Setup, recorded: Recorded) -> None:
    """Decide every episode again, each assistant's in a session of its own."""
    numbered = [(n, played) for n, played in enumerate(recorded.played) if played.steps]
    numbered.sort(key=lambda each: each[1].choice.key)
    for _, group in itertools.groupby(numbered, key=lambda each: each[1].choice.key):
        episodes = list(group)
        name, options = episodes[0][1].choice.acting
        session = setup.session(make_assistant(name, **options))
        log = [step for _, played in episodes for step in _ended(played)]
        replay(session, _Again(setup, recorded.seed, [n for n, _ in episodes]), log)


def _ended(played: Played) -> list[Step]:
    """The steps of an episode; one that has not ended is cut as if at its limit."""
    last = played.steps[-1]
    return [*played.steps[:-1], last._replace(events=int(last.events) | LIMIT)]


class _Again:
    """The task once more, for `replay`: the recorded episodes with their chances."""

    def __init__(self, setup: Setup, seed: int, numbers: list[int]) -> None:
        self._setup, self._stepper = setup, setup.make_stepper()
        self._chances = iter([chance_of(seed, number) for number in numbers])

    def reset(self) -> Any:
        return self._setup.seen(self._stepper.reset(next(self._chances)))

    def step(self, action: int) -> tuple[Any, float, int]:
        state, reward, events = self._stepper.step(action)
        return self._setup.seen(state), reward, events

    def snapshot(self) -> Any:
        return self._stepper.snapshot()

    def restore(self, snapshot: Any) -> None:
        self._stepper.restore(snapshot)
