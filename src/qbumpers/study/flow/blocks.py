"""A block as a participant plays it: who helps in which episode, and what the page may show."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from qbumpers.play.game import Choice, Game
from qbumpers.study.design.assignment import yoked_dose
from qbumpers.study.design.conditions import Condition
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block
from qbumpers.study.flow.standing import Standing

_ASKED_IF_OVERRIDDEN, _ASKED_IF_NOT = 0.5, 0.1
"""Probability that "was that you?" is asked after a step, until there are enough."""


class BlockPlay:
    """A participant at a block.

    Args:
        study: that they take part in.
        block: that they play.
        condition: that they are in; None before the assignment.
        now: where they are.
        game: as far as it has come.
        exposed: whether states are sent as they are, for simulated learners.
    """

    def __init__(
        self,
        study: Study,
        block: Block,
        condition: Condition | None,
        now: Standing,
        game: Game,
        *,
        exposed: bool = False,
    ) -> None:
        self._study, self._block, self._condition = study, block, condition
        self._now, self._game, self._exposed = now, game, exposed
        self._plan = block.plan()
        self._asked: dict[int, int] = {}  # how many questions there were, by episode

    @property
    def over(self) -> bool:
        """Whether every episode is over."""
        return len(self._game.episodes) == len(self._plan) and not self._game.playing

    def awaits(self, episode: int) -> bool:
        """Whether an episode of that number is the one to begin now."""
        return episode == len(self._game.episodes) and not self._game.playing

    def next_choice(self) -> Choice | None:
        """Who assists in the next episode; None if there is none."""
        number = len(self._game.episodes)
        if number >= len(self._plan):
            return None
        if not self._plan[number] or self._condition is None:
            return Choice("none", {}, assisted=False)
        if self._now.yoke is None:
            return Choice(self._condition.assistant, self._condition.options)
        assisted = [episode for episode in self._game.episodes if episode.choice.assisted]
        delivered = sum(episode.overrides for episode in assisted)
        dose = yoked_dose(self._now.yoke, len(assisted), delivered)
        of = {"name": "random-override", "probability": dose.probability}
        return Choice("budget", {"per_episode": dose.overrides, "of": of})

    def page(self) -> dict[str, Any]:
        """What the page of the block needs beside what every page does."""
        return {"episodes": len(self._plan), "over": self.over, "played": self._played()}

    def messages(
        self, kind: str, fields: Mapping[str, Any]
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        """What a page may see of a message of play, and what follows from it.

        Args:
            kind: of the message.
            fields: JSON-like.
        """
        if kind == "welcome":
            yield "board", {"task": fields["task"]}
        elif kind == "state":
            yield "state", self._state(fields)
            if self._asks(fields):
                yield "ask", self._question(fields)
        else:
            yield kind, dict(fields)

    def _played(self) -> int:
        return len(self._game.episodes) - self._game.playing

    @property
    def _hidden(self) -> bool:
        return self._condition is None or self._condition.overrides == "hidden"

    def _state(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        episode, last = fields["episode"], fields["last"]
        shown = ("episode", "total", "length", "success", "crash", "over")
        state = {
            "number": fields["number"],
            "scene": fields["scene"],
            "words": fields["words"],
            "episode": {name: episode[name] for name in shown},
            "assisted": None if self._hidden else self._helps(episode),
            "override": "" if last is None else self._override(last),
            "over": self.over,
        }
        if self._exposed:
            state["exposed"] = self._exposure(episode)
        return state

    def _exposure(self, episode: Mapping[str, Any]) -> dict[str, Any]:
        """What no participant sees: the state, and the last step as it was."""
        step, state = self._game.last, np.asarray(self._game.state).tolist()
        exposed = {"state": state, "training": self._block.phase == "training"}
        exposed["assisted"] = episode["assisted"]
        if step is None:
            return {**exposed, "last": None}
        led = np.asarray(step.next_state).tolist() if step.undone else state
        last = {
            "proposed": int(step.proposed), "executed": int(step.executed),
            "undone": bool(step.undone), "reward": float(step.reward), "led": led,
            "events": int(step.events),
        }  # fmt: skip
        return {**exposed, "last": last}

    def _helps(self, episode: Mapping[str, Any]) -> bool:
        """Whether there is an assistant in an episode that could ever do something."""
        helping = episode["assisted"] and self._condition is not None
        return helping and (episode["assistant"] != "none")

    def _override(self, last: Mapping[str, Any]) -> str:
        """What the page says of an override; nothing if there was none or it is hidden."""
        if not last["overridden"] or self._hidden:
            return ""
        actions: Sequence[str] = self._game.setup.display.actions
        words = {
            "proposed": actions[int(last["proposed"])],
            "executed": actions[int(last["executed"])],
            "projected": f"{last['projected']:.0f}",
        }
        key = "override"
        if last["undone"]:
            key = "override_undone"
        elif self._condition is not None and self._condition.overrides == "explained":
            key = "override_because"
        return self._study.word(key).format(**words)

    def _asks(self, fields: Mapping[str, Any]) -> bool:
        """Whether "was that you?" is asked after a step; decided by its number alone."""
        last, episode = fields["last"], fields["episode"]
        number = episode["episode"]
        enough = self._asked.get(number, 0) >= self._block.attribution
        if last is None or enough or episode["over"] or not episode["assisted"]:
            return False
        draw = np.random.default_rng([self._game.seed, fields["number"], *b"Asked"]).random()
        asks = draw < (_ASKED_IF_OVERRIDDEN if last["overridden"] else _ASKED_IF_NOT)
        self._asked[number] = self._asked.get(number, 0) + asks
        return bool(asks)

    def _question(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        actions: Sequence[str] = self._game.setup.display.actions
        executed = actions[int(fields["last"]["executed"])]
        text = self._study.word("attribution").format(executed=executed)
        return {"number": fields["number"] - 1, "text": text}
