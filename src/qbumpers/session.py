"""One learner or participant with one assistant at one task: no Gymnasium, no clock, no socket.

A host tells a session where an episode begins, what is proposed and what came of it; the session
decides, keeps the account and gives the record of each step. What it is after any number of steps
is a fold of their records, so a session can be replayed.
"""

import functools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from qbumpers.assistants import Assistant
from qbumpers.borrowing import read_only
from qbumpers.compilation import uncompiled
from qbumpers.decisions import (
    Account,
    Decision,
    Execution,
    Model,
    Noise,
    Situation,
    Step,
    begin,
    execution_of,
    settle,
    situate,
    step_of,
)
from qbumpers.errors import RequestError, action_number, counted
from qbumpers.learners import Perception, perceive, perception
from qbumpers.registration import as_numbers
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, TRUNCATED
from qbumpers.tasks.identity import transitions_digest
from qbumpers.values import QValues, check_width
from qbumpers.values.fitting import Use
from qbumpers.values.others import all_further_values
from qbumpers.values.tabular import as_values

_ENDS = TERMINATED | TRUNCATED | LIMIT
_ANY_NOISE = Noise(0.5, 0.5)  # probabilities are those before it is drawn
_perceive = uncompiled(perceive)


class ReplayError(RequestError):
    """A replay came to something else than the record."""


class Session:
    """One learner or participant with one assistant.

    Args:
        assistant: what decides, a rule with its options.
        values: Q* of the assistant: an array [S, A] with the model's discount, or any callable from
            a state or observation to one value per action; with `others`, a mapping of further ones
            by name, if the assistant's rule named any.
        model: of the task, for rules with memory; its `actions` and `discount` hold for all.
        perceived: what the learner believes happened, a `Perception` or the name of one; it decides
            what the records say is credited.

    Attributes:
        perception: what the learner believes happened, as numbers.
        decision: the decision that awaits its `record`; None if there is none.
        account: what was earned in the episode so far, see `qbumpers.decisions.Account`.
        state: the present state, as in `Situation`.
        values_now: float64 [A], the assistant's values in the present state, read-only; None
            between episodes.

    Raises:
        RequestError: if the perception is unknown, the values lack rows that the rule named, or
            what they say of themselves (sizes, discount, what they were made for) is not what the
            model says.
    """

    def __init__(
        self,
        assistant: Assistant,
        values: QValues | np.ndarray,
        model: Model,
        perceived: Perception | str = "transition",
    ) -> None:
        self.assistant, self.model = assistant, model
        self.values = as_values(values, _use_of(model, values))
        stated = getattr(self.values, "discount", None)
        if stated is not None and stated != model.discount:
            raise RequestError(
                f"discount = {model.discount!r} of the model, but the values were made with "
                f"{stated!r}"
            )
        found = perception(perceived) if isinstance(perceived, str) else perceived
        self.perception = as_numbers(found)
        further = all_further_values(self.values, assistant.values, assistant.name, model.actions)
        self._others = list(further.values())
        self._no_others = read_only(np.zeros((0, model.actions)))
        self._memory = assistant.start(model)
        self._episode = -1
        self.account = Account(0.0, 1.0, 0.0, 0, 0)
        self.state: Any = None
        self.values_now: np.ndarray | None = None
        self.decision: Decision | None = None

    def begin(self, state: Any) -> None:
        """Start an episode.

        Args:
            state: its first state or observation, as the values take it.

        Raises:
            RequestError: if the values do not fit, or the episode does not suit the assistant.
        """
        self.values_now = None
        row, others = self._rows(state, "at reset")
        account = begin(row, self._episode + 1)
        self.assistant.check_start(account.start_value)
        self._episode, self.account = account.episode, account
        self.state = _as_state(state)
        self.values_now, self._others_now = row, others
        self.decision = None

    def decide(self, proposed: int, noise: Noise) -> Decision:
        """What the assistant does about a proposed action; `record` must follow.

        Args:
            proposed: in [0, A).
            noise: coin and tie of this decision, for instance `noise_of(seed, number)`.

        Raises:
            RequestError: outside an episode, before the last decision was recorded, if there is no
                such action, or if the rule decides on something that cannot be done.
        """
        row = self.values_now
        if row is None or self.decision is not None:
            missing = "begin(state)" if row is None else "record(...) of the last decision"
            raise RequestError(f"decide: {missing} must come first")
        actions = self.model.actions
        proposed = action_number(proposed, "proposed", 0, actions)
        situation = situate(self.account, self.state, row, self._others_now, proposed)
        decision = self.assistant.decide(situation, noise, self._memory)
        try:
            executed, undone, probability = execution_of(decision, bool(decision.undo), actions)
        except RequestError as error:
            raise RequestError(f"assistant {self.assistant.name}: {decision}: {error}") from error
        self._situation, self._noise = situation, noise
        self.decision = Decision(executed, probability, undone)
        return self.decision

    def override_probabilities(self) -> np.ndarray:
        """How probably each action would be overridden if it were proposed now.

        Returns:
            float64 [A], before any coin is tossed.

        Raises:
            RequestError: outside an episode.
        """
        row = self.values_now
        if row is None:
            raise RequestError("override_probabilities: begin(state) must come first")
        found = np.empty(self.model.actions)
        for action in range(self.model.actions):
            situation = situate(self.account, self.state, row, self._others_now, action)
            found[action] = self.assistant.decide(situation, _ANY_NOISE, self._memory).probability
        return found

    def record(self, reward: float, next_state: Any, events: int, notice: float = 0.0) -> Step:
        """The record of the step that was decided, once the action has happened.

        Args:
            reward: what the environment gave for the executed action.
            next_state: where it led, also if the step is undone.
            events: bits of `qbumpers.tasks.dynamics`. Of an undone step only `LIMIT` ends the
                episode.
            notice: in [0, 1), whether an override is noticed by a learner that sometimes does.

        Returns:
            The step.

        Raises:
            RequestError: if nothing was decided, the reward is not finite, or the values do not fit
                the next state.
        """
        decision = self.decision
        if decision is None:
            raise RequestError("record: decide(...) must come first")
        if not math.isfinite(reward):
            self.values_now = None  # the account is lost: nothing more can be decided
            step = self.account.step + 1
            raise RequestError(f"reward = {reward!r} of step {step}; it must be finite")
        situation: Situation = self._situation
        happened = events & ~(TERMINATED | TRUNCATED) if decision.undo else events
        following = _as_state(next_state)
        experience = _perceive(
            self.perception, situation.proposed, decision.action, decision.undo, reward, notice
        )
        step = step_of(
            situation, self._noise, Execution(decision.action, decision.undo, decision.probability),
            experience.action, reward, following, happened,
        )  # fmt: skip
        self._memory = self.assistant.observe(self._memory, step)
        self.account = settle(self.account, reward, self.model.discount)
        self.decision = None
        if happened & _ENDS:
            self.values_now = None
        elif not decision.undo:
            self.values_now = None  # stays so if the values do not fit
            where = f"after step {self.account.step}"
            self.values_now, self._others_now = self._rows(next_state, where)
            self.state = following
        return step

    def _rows(self, state: Any, where: str) -> tuple[np.ndarray, np.ndarray]:
        """Q*(s, .) [A] and the further rows [K, A], which no rule can change."""
        actions = self.model.actions
        row = check_width(self.values(state), actions, where)
        row.flags.writeable = False
        if not self._others:
            return row, self._no_others
        others = [check_width(each(state), actions, where) for each in self._others]
        return row, read_only(np.array(others))


def _use_of(model: Model, values: Any) -> Use:
    """What a model says of what values are put to."""
    sizes = (model.states, model.observation_size, model.actions)
    use = Use("the model", *sizes, discount=model.discount)
    if model.dynamics is None or not getattr(values, "made_for", ""):
        return use
    return use._replace(identity=transitions_digest(model.dynamics))


def _as_state(state: Any) -> Any:
    """A state as situations and records have it: a number, float32 [D], or None."""
    if isinstance(state, int | np.integer):
        return int(state)
    if isinstance(state, np.ndarray) and state.ndim == 1 and state.dtype.kind in "fiub":
        # A copy: environments may go on writing into what they returned.
        return read_only(np.array(state, np.float32))
    return None


def noise_of(seed: int, number: int) -> Noise:
    """The noise of one decision, by its number alone: a restarted host needs nothing else.

    Args:
        seed: one per session, not negative.
        number: which decision of the session, counted from 0.

    Returns:
        The same noise for the same arguments.
    """
    source = np.random.Philox(_sequence_of(seed))
    source.advance(number)
    coin, tie = (source.random_raw(2) >> np.uint64(11)) * (1.0 / 9007199254740992.0)
    return Noise(float(coin), float(tie))


@functools.lru_cache(1024)
def _sequence_of(seed: int) -> np.random.SeedSequence:
    """What a session's generator starts from, which takes longer to make than a number of it."""
    return np.random.SeedSequence([seed, *b"Session"])


_COMPARED = (
    "state", "executed", "undone", "credited", "overridden", "probability", "projected_return",
    "reward", "next_state", "events",
)  # fmt: skip


def replay(session: Session, stepper: Any, log: Step | Iterable[Step]) -> int:
    """Decide a recorded session again, and compare every step with its record.

    Args:
        session: fresh, of the same assistant and values.
        stepper: the task once more: `reset() -> state`, `step(action) -> (state, reward, events)`,
            and `snapshot()`, `restore(snapshot)` if steps were undone. None takes states, rewards
            and events from the record: then only the assistant is held to it.
        log: the record, a table or single steps in their order.

    Returns:
        How many steps were replayed.

    Raises:
        ReplayError: at the first difference, or if the log ends before its last episode does.
    """
    steps = list(rows_of(log) if isinstance(log, Step) else log)
    if steps and not int(steps[-1].events) & _ENDS:
        raise ReplayError(
            f"replay: the log ends after {counted(len(steps), 'step')}, before its last episode "
            "does"
        )
    over = True
    for number, recorded in enumerate(steps):
        if over:
            session.begin(recorded.state if stepper is None else stepper.reset())
        decision = session.decide(int(recorded.proposed), Noise(recorded.coin, recorded.tie))
        step = session.record(*_outcome(stepper, decision, recorded))
        _compare(number, step, recorded, session)
        over = bool(step.events & _ENDS)
    return len(steps)


def _outcome(stepper: Any, decision: Decision, recorded: Step) -> tuple[float, Any, int]:
    """Reward, next state and events of a decision."""
    if stepper is None:
        return float(recorded.reward), recorded.next_state, int(recorded.events)
    before = stepper.snapshot() if decision.undo else None
    state, reward, events = stepper.step(decision.action)
    if decision.undo:
        stepper.restore(before)
    return float(reward), state, int(events) | (int(recorded.events) & LIMIT)


def _compare(number: int, step: Step, recorded: Step, session: Session) -> None:
    for field in _COMPARED:
        if field == "credited" and 0 < session.perception.notices < 1:
            continue  # whether an override was noticed is not in the record
        found, expected = getattr(step, field), getattr(recorded, field)
        if not np.array_equal(found, expected):
            raise ReplayError(
                f"replay: step {number} (episode {int(recorded.episode)}): {field} is {found}, "
                f"recorded {expected}"
            )


def rows_of(table: Step) -> Iterator[Step]:
    """The single steps of a table."""
    for place in range(len(table.episode)):
        yield Step(*(column[place] for column in table))
