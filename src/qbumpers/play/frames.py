"""A recorded episode, state by state: what was shown, what the assistant saw, and how it came."""

from collections.abc import Iterator, Sequence
from typing import Any

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Account, Step, begin, settle
from qbumpers.errors import RequestError
from qbumpers.play.game import Episode, Game, Played, differing
from qbumpers.play.setup import Setup
from qbumpers.play.tables import Moment, Recorded
from qbumpers.play.views import assistant_view, episode_view, floor_of, picture

_NO_MOMENT = Moment("", None, None, None, None)


def frames_of(
    setup: Setup, recorded: Recorded, number: int, moments: Sequence[Moment]
) -> list[dict[str, Any]]:
    """What a replay shows of an episode, JSON-like.

    Every step is decided and done again. As far as it comes out as it was recorded, the state is
    the task's own, and the probabilities are those of every action. After that, and if the setup
    has changed, all is as it was recorded: the state as the assistant saw it, and the probability
    of what was proposed.

    Args:
        setup: made of the session's own description.
        recorded: the session.
        number: of the episode, from 0.
        moments: how each step of the session came about.

    Returns:
        One frame per state, the first before any step: `step`, `scene`, `words`, `last` and `view`
        (see `qbumpers.play.views`), `total` and `overrides` so far; and of the step that led
        there, `coin`, `device`, `reaction` (milliseconds from the state's being shown to the key)
        and `seconds` since the one before, each None if it is not known. Without frames after a
        difference if the assistant does not see the whole state.
    """
    first = sum(len(played.steps) for played in recorded.played[:number])
    played = recorded.played[number]
    frames: list[dict[str, Any]] = []
    episode = Episode(number, played.choice)
    states = zip(_states(setup, recorded, number), _recorded_views(setup, played), strict=False)
    for step, ((state, view), recorded_view) in enumerate(states):
        last = played.steps[step - 1] if step else None
        episode = episode if last is None else episode.after(last)
        moment = moments[first + step - 1] if step else _NO_MOMENT
        before = moments[first + step - 2] if step > 1 else _NO_MOMENT
        frames.append({
            "step": step,
            **picture(setup.display, state, last),
            "view": view or recorded_view,
            "total": episode.total,
            "overrides": episode.overrides,
            "coin": None if last is None else float(last.coin),
            "device": moment.device,
            "reaction": _between(moment.shown, moment.pressed),
            "seconds": _between(before.applied, moment.applied),
        })  # fmt: skip
    return frames


def episodes_of(recorded: Recorded) -> list[dict[str, Any]]:
    """What every episode of a session came to, JSON-like."""
    found: list[dict[str, Any]] = []
    for number, played in enumerate(recorded.played):
        episode = Episode(number, played.choice)
        for step in played.steps:
            episode = episode.after(step)
        found.append(episode_view(episode))
    return found


def _between(before: float | None, after: float | None) -> float | None:
    return None if before is None or after is None else after - before


def _states(
    setup: Setup, recorded: Recorded, number: int
) -> Iterator[tuple[Any, dict[str, Any] | None]]:
    """Every state with what the assistant sees there; None after a difference."""
    played = recorded.played[number]
    game = _begun(setup, recorded, number)
    if game is not None:
        yield game.state, assistant_view(game)
    elif setup.task.seen is None and played.steps:
        yield played.steps[0].state, None
    for step in played.steps:
        if game is not None and not _again(game, step):
            game = None
        if game is not None:
            yield game.state, assistant_view(game)
        elif setup.task.seen is None:
            yield (step.state if step.undone else step.next_state), None


def _begun(setup: Setup, recorded: Recorded, number: int) -> Game | None:
    """The game at the start of an episode; None if it cannot come to the same any more."""
    earlier = recorded.played[:number]
    if setup.difference(recorded.setup) or not all(played.steps for played in earlier):
        return None
    game = Game(setup, recorded.seed)
    try:
        for played in earlier:
            game.recall(played)
        game.begin(recorded.played[number].choice)
    except RequestError:
        return None
    return game


def _again(game: Game, step: Step) -> bool:
    """Whether a step comes out as it was recorded."""
    try:
        return not differing(game.propose(int(step.proposed)), step)
    except RequestError:
        return False


def _recorded_views(setup: Setup, played: Played) -> Iterator[dict[str, Any] | None]:
    """What the assistant saw before each step, as far as it was recorded; None at the end."""
    account: Account | None = None
    for step in played.steps:
        account = account or begin(step.values, 0)
        chances: list[float | None] = [None] * len(step.values)
        chances[int(step.proposed)] = float(step.probability)
        yield {
            "values": step.values.tolist(),
            "projected": (account.earned + account.discount * step.values).tolist(),
            "probabilities": chances,
            "start_value": account.start_value,
            "floor": _floor(played, account.start_value),
        }
        account = settle(account, float(step.reward), setup.task.discount)
    yield None


def _floor(played: Played, start_value: float) -> float | None:
    name, options = played.choice.acting
    try:
        return floor_of(make_assistant(name, **options), start_value)
    except RequestError:  # of an assistant that is not known any more
        return None
