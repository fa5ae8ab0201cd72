"""One participant's episodes at one task: a fold of what they proposed, without clock or socket."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from qbumpers.assistants import make_assistant
from qbumpers.decisions import Noise, Step
from qbumpers.errors import RequestError
from qbumpers.play.setup import Setup
from qbumpers.play.stepping import chance_of
from qbumpers.session import Session, noise_of
from qbumpers.tasks.dynamics import CRASH, ENDS, LIMIT, SUCCESS


class Choice(NamedTuple):
    """Who assists in an episode.

    Attributes:
        name: under which a rule is registered.
        options: of the rule, JSON-like.
        assisted: whether it does; if not, nobody overrides.
    """

    name: str
    options: Mapping[str, Any]
    assisted: bool = True

    @property
    def acting(self) -> tuple[str, dict[str, Any]]:
        """Name and options of the rule that decides: the one that never overrides if unassisted."""
        if not self.assisted:
            return "none", {}
        # JSON has no tuples, and options have no lists.
        return self.name, {option: _tupled(value) for option, value in self.options.items()}

    @property
    def key(self) -> str:
        """The same for the same assistant, whatever the order of its options."""
        return json.dumps(self.acting, sort_keys=True)


def _tupled(value: Any) -> Any:
    return tuple(cast(list[Any], value)) if isinstance(value, list) else value


class Episode(NamedTuple):
    """What an episode of a participant has come to.

    Attributes:
        number: counted from 0.
        choice: who assisted.
        total: rewards, undiscounted.
        length: steps.
        overrides: steps that were overridden.
        success: whether the task announced one.
        crash: whether the task announced one.
        over: whether it has ended.
    """

    number: int
    choice: Choice
    total: float = 0.0
    length: int = 0
    overrides: int = 0
    success: bool = False
    crash: bool = False
    over: bool = False

    def after(self, step: Step) -> "Episode":
        """What it has come to after one more step."""
        events = int(step.events)
        return self._replace(
            total=self.total + float(step.reward),
            length=self.length + 1,
            overrides=self.overrides + bool(step.overridden),
            success=self.success or bool(events & SUCCESS),
            crash=self.crash or bool(events & CRASH),
            over=bool(events & ENDS),
        )


class Game:
    """One participant at one task; every decision and chance follows from the seed and proposals.

    Assistants may change between episodes; one that comes back goes on with what it remembers.

    Args:
        setup: what is played.
        seed: of the session, not negative.

    Attributes:
        number: decisions so far.
        episodes: every episode so far, the present one last.
        state: the present state, all of it.
        last: the last step of the present episode; None at its start.
        session: of whoever assists now; None before the first episode.
    """

    def __init__(self, setup: Setup, seed: int) -> None:
        self.setup, self.seed = setup, seed
        self.number = 0
        self.episodes: list[Episode] = []
        self.state: Any = None
        self.last: Step | None = None
        self.session: Session | None = None
        self._stepper = setup.make_stepper()
        self._sessions: dict[str, Session] = {}

    @property
    def playing(self) -> bool:
        """Whether an episode is going on."""
        return bool(self.episodes) and not self.episodes[-1].over

    def begin(self, choice: Choice) -> None:
        """Start the next episode.

        Args:
            choice: who assists.

        Raises:
            RequestError: while an episode is going on, or if the assistant does not suit.
        """
        if self.playing:
            raise RequestError("begin: the episode before has not ended")
        session = self._session_of(choice)
        number = len(self.episodes)
        state = self._stepper.reset(chance_of(self.seed, number))
        session.begin(self.setup.seen(state))
        self.session, self.state, self.last = session, state, None
        self.episodes.append(Episode(number, choice))

    def propose(self, action: int) -> Step:
        """What comes of an action that the participant proposes.

        Args:
            action: in [0, A).

        Returns:
            The record of the step.

        Raises:
            RequestError: outside an episode, or if there is no such action.
        """
        if not self.playing or self.session is None:
            raise RequestError("no episode is going on: begin the next one first")
        decision = self.session.decide(action, noise_of(self.seed, self.number))
        before = self._stepper.snapshot() if decision.undo else None
        state, reward, events = self._stepper.step(decision.action)
        if decision.undo:
            self._stepper.restore(before)
        if self.episodes[-1].length + 1 >= self.setup.limit:
            events |= LIMIT
        step = self.session.record(reward, self.setup.seen(state), events)
        self.state = self.state if decision.undo else state
        self.number, self.last = self.number + 1, step
        self.episodes[-1] = self.episodes[-1].after(step)
        return step

    def recall(self, played: "Played") -> None:
        """Take an episode that has ended from its record, without stepping through the task.

        Args:
            played: the episode; assistants that remember decide and observe its steps again.
        """
        session = self._session_of(played.choice)
        session.begin(played.steps[0].state)
        episode = Episode(len(self.episodes), played.choice)
        remembers = any(rule.start is not None for rule in session.assistant.chain)
        for step in played.steps:
            if remembers:
                session.decide(int(step.proposed), Noise(step.coin, step.tie))
                session.record(step.reward, step.next_state, int(step.events))
            episode = episode.after(step)
        self.number += len(played.steps)
        self.episodes.append(episode)

    def _session_of(self, choice: Choice) -> Session:
        if choice.key not in self._sessions:
            name, options = choice.acting
            if "name" in options:  # it would be taken for the rule's
                raise RequestError(f"assistant {name}: unknown option 'name'")
            self._sessions[choice.key] = self.setup.session(make_assistant(name, **options))
        return self._sessions[choice.key]


class Played(NamedTuple):
    """An episode as it was recorded.

    Attributes:
        choice: who assisted.
        steps: in their order.
    """

    choice: Choice
    steps: list[Step]


def resumed(setup: Setup, seed: int, played: Sequence[Played]) -> Game:
    """The game that a record leads to; in the last episode, everything is done again.

    Args:
        setup: what was played.
        seed: from which the session's noise and chance come.
        played: its episodes, in their order.

    Raises:
        RequestError: if a step of the last episode comes out differently than it was recorded.
    """
    game = Game(setup, seed)
    for episode in played[:-1]:
        game.recall(episode)
    for episode in played[-1:]:
        game.begin(episode.choice)
        for recorded in episode.steps:
            difference = differing(game.propose(int(recorded.proposed)), recorded)
            if difference:
                raise RequestError(f"step {game.number - 1} of the session: {difference}")
    return game


def differing(found: Step, recorded: Step) -> str:
    """The first field in which a step differs from its record, in words; empty if none does."""
    for field, again, before in zip(Step._fields, found, recorded, strict=True):
        if not np.array_equal(again, before):
            return f"{field} is {again}, recorded {before}"
    return ""
