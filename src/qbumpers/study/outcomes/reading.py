"""Everything that is recorded of participants, read back."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import sqlalchemy as sql

from qbumpers.decisions import Step
from qbumpers.play.game import Episode
from qbumpers.play.tables import read_moments, read_session
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block
from qbumpers.study.flow.standing import Standing, attempts_at, standing
from qbumpers.study.flow.tables import Event, events_of, participants_in, session_name


class BlockPlayed(NamedTuple):
    """A block as a participant played it to its end.

    Attributes:
        block: id.
        phase: of the block.
        session: identifier of the session.
        episodes: in order.
        steps: of each of them.
        times: of every step, with its device, see `qbumpers.play.tables.Moment`.
    """

    block: str
    phase: str
    session: str
    episodes: Sequence[Episode]
    steps: Sequence[Sequence[Step]]
    times: Sequence[dict[str, Any]]


class Participant(NamedTuple):
    """What is recorded of a participant.

    Attributes:
        name: identifier.
        came: when, in seconds since 1970.
        now: where they are.
        events: what happened to them, in order.
        blocks: that they finished, in order.
    """

    name: str
    came: float
    now: Standing
    events: Sequence[Event]
    blocks: Sequence[BlockPlayed]

    def answers(self) -> dict[str, Event]:
        """The last answer to each part, by its id."""
        return {e.content["part"]: e for e in self.events if e.kind == "answered"}

    def returns(self, phase: str) -> list[float]:
        """Undiscounted returns of the unassisted episodes of a phase; "probes" are of training."""
        wanted = "training" if phase == "probes" else phase
        return [
            episode.total
            for block in self.blocks
            if block.phase == wanted
            for episode in block.episodes
            if not episode.choice.assisted
        ]

    def measure(self, name: str) -> float:
        """A measure of `qbumpers.study.design.models.Analysis`; NaN if it is unknown."""
        if name == "gain":
            return _mean(self.returns("posttest")) - _mean(self.returns("pretest"))
        return _mean(self.returns(name))


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def read_participants(engine: sql.Engine, study: Study) -> list[Participant]:
    """What is recorded of everybody, the earliest first.

    Args:
        engine: as `open_records` gave it.
        study: whose records they are.
    """
    events = events_of(engine)
    return [
        read_participant(engine, study, name, came, events.get(name, []))
        for name, came in participants_in(engine).items()
    ]


def read_participant(
    engine: sql.Engine, study: Study, name: str, came: float, events: Sequence[Event]
) -> Participant:
    """What is recorded of one participant.

    Args:
        engine: as `open_records` gave it.
        study: whose records they are.
        name: identifier.
        came: when, in seconds since 1970.
        events: what happened to them, in order.
    """
    phases = {part.id: part.phase for part in study.parts if isinstance(part, Block)}
    blocks: list[BlockPlayed] = []
    for block, attempt in attempts_at(list(phases), study, events).items():
        session = session_name(name, block, attempt)
        recorded = read_session(engine, session)
        if recorded is not None:
            episodes = [
                _episode(number, played.choice, played.steps)
                for number, played in enumerate(recorded.played)
            ]
            steps = [played.steps for played in recorded.played]
            times = [moment._asdict() for moment in read_moments(engine, session)]
            blocks.append(BlockPlayed(block, phases[block], session, episodes, steps, times))
    return Participant(name, came, standing(study, events), events, blocks)


def _episode(number: int, choice: Any, steps: Iterable[Step]) -> Episode:
    episode = Episode(number, choice)
    for step in steps:
        episode = episode.after(step)
    return episode
