"""Numbers of a learner that change from episode to episode."""

from typing import Annotated, NamedTuple

from pydantic import Field

from qbumpers.compilation import compiled


class Schedule(NamedTuple):
    """A number that changes linearly over the first episodes and then stays.

    Attributes:
        start: value in the first episode.
        end: value once the decay is over.
        fraction: share of all episodes over which it decays.
    """

    start: Annotated[float, Field(ge=0, le=1)] = 1.0
    end: Annotated[float, Field(ge=0, le=1)] = 0.02
    fraction: Annotated[float, Field(ge=0, le=1)] = 0.9


@compiled
def scheduled(schedule: Schedule, episode: int, episodes: int) -> float:
    """Value in one episode: start + min(e / n, 1) (end - start), n = int(fraction * episodes).

    Args:
        schedule: how it changes.
        episode: e, counted from 0.
        episodes: with the assistant, of the whole trial.

    Returns:
        The value; `end` at once if n is 0.
    """
    decay = int(schedule.fraction * episodes)
    progress = min(episode / decay, 1.0) if decay > 0 else 1.0
    return schedule.start + progress * (schedule.end - schedule.start)
