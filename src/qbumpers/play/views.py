"""What the page is shown: the scene, the state in words, and what the assistant sees."""

from typing import Any

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.decisions import Step
from qbumpers.play.game import Episode, Game
from qbumpers.play.setup import Setup
from qbumpers.tasks.display import Display


def task_view(setup: Setup) -> dict[str, Any]:
    """How a task is shown and played, JSON-like."""
    display = setup.display
    return {
        "name": setup.task.name,
        "width": display.width,
        "height": display.height,
        "actions": display.actions,
        "keys": dict(display.keys),
        "rate": display.rate,
        "idle": display.idle,
        "backdrop": list(display.backdrop),
        "limit": setup.limit,
    }


def episode_view(episode: Episode) -> dict[str, Any]:
    """What an episode has come to, JSON-like."""
    return {
        "episode": episode.number,
        "assistant": episode.choice.name,
        "options": dict(episode.choice.options),
        "assisted": episode.choice.assisted,
        "total": episode.total,
        "length": episode.length,
        "overrides": episode.overrides,
        "success": episode.success,
        "crash": episode.crash,
        "over": episode.over,
    }


def state_view(game: Game, *, with_view: bool = True) -> dict[str, Any]:
    """The present state, JSON-like.

    Args:
        game: in an episode, which may have ended.
        with_view: whether to say what the assistant sees.
    """
    display = game.setup.display
    return {
        "number": game.number,
        "episode": episode_view(game.episodes[-1]),
        **picture(display, game.state, game.last),
        "view": assistant_view(game) if with_view else None,
    }


def picture(display: Display, state: Any, last: Step | None) -> dict[str, Any]:
    """A state as it is drawn and said, with the step that led to it, JSON-like.

    Args:
        display: how the task is shown and played.
        state: to be shown.
        last: the step before; None at the start of an episode.
    """
    return {
        "scene": list(display.scene(state, last)),
        "words": display.words(state),
        "last": None if last is None else _last_view(last),
    }


def _last_view(step: Step) -> dict[str, Any]:
    """What was proposed and done on the last step."""
    return {
        "proposed": int(step.proposed),
        "executed": int(step.executed),
        "overridden": bool(step.overridden),
        "undone": bool(step.undone),
        "probability": float(step.probability),
        "projected": float(step.projected_return),
        "reward": float(step.reward),
    }


def assistant_view(game: Game) -> dict[str, Any] | None:
    """What the assistant sees before the next action; None if the episode has ended.

    Returns:
        `values` [A], Q* of each action; `projected` [A], the projected return of each;
        `probabilities` [A] of an override; `start_value`, V*(s_0); `floor`, how far the projected
        return may fall, None if the rule has no such bound.
    """
    session = game.session
    if session is None or session.values_now is None:
        return None
    account = session.account
    projected = account.earned + account.discount * np.asarray(session.values_now)
    return {
        "values": session.values_now.tolist(),
        "projected": projected.tolist(),
        "probabilities": session.override_probabilities().tolist(),
        "start_value": account.start_value,
        "floor": floor_of(session.assistant, account.start_value),
    }


def floor_of(assistant: Assistant, start_value: float) -> float | None:
    """The lower value of a rule with `alpha` and `v_min`, or of the rule that it is over.

    Args:
        assistant: any.
        start_value: V*(s_0).

    Returns:
        V*(s_0) - alpha (V*(s_0) - v_min); None if the rule has no such options.
    """
    options = assistant.options._asdict()
    if "alpha" in options and "v_min" in options:
        return start_value - options["alpha"] * (start_value - options["v_min"])
    return None if assistant.of is None else floor_of(assistant.of, start_value)
