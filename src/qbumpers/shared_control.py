"""The Gymnasium wrapper: a person's or an agent's action goes in, the assisted one is executed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.assistants.registry import registered
from qbumpers.borrowing import read_only
from qbumpers.decisions import Model, Noise, Step
from qbumpers.errors import RequestError, action_number, check_number, suggestion, unknown_name
from qbumpers.learners import Perception
from qbumpers.session import Session
from qbumpers.tasks.announcing import events_told
from qbumpers.tasks.dynamics import LIMIT, TERMINATED, TRUNCATED
from qbumpers.tasks.identity import task_inside
from qbumpers.tasks.undoing import reached_limit, undo_of
from qbumpers.values import QValues, TabularValues, load_values
from qbumpers.values.fitting import use_in
from qbumpers.values.offset import OffsetValues
from qbumpers.values.tabular import as_values

RECORD, SUMMARY = "assistance", "assisted_episode"
"""Keys of `info`: the record of every step, and the summary at the end of an episode."""

_OWN = ("discount", "perception")  # arguments beside those of the assistant
_NOISE_DRAWN = 256  # decisions for which noise is drawn at a time


class SharedControl(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Share control of an environment between whoever calls `step` and an assistant.

    `info["assistance"]` holds the record of each step, always with the keys of
    `qbumpers.decisions.Step`; after `reset` it shows the values of the first state and -1 for the
    actions. The `info` of an episode's last step also holds `info["assisted_episode"]`, with
    `return`, `length`, `overrides`, `start_value` and `projected_return` (of the last decision).

    The assistant draws its noise from a generator of its own, seeded by `reset(seed=)`, so that
    the environment's chances are the same with and without an assistant. Recorded noise can be
    played again: `reset(options={"noise": [(coin, tie), ...]})`.

    What values say of themselves is compared with the environment: sizes, and what they were made
    for. Tables and rules count states and actions from 0, whatever the environment's spaces start
    with; a function gets the observation as it is.

    Args:
        env: an environment with a Discrete action space.
        assistant: an assistant, or the name of one, its options then being given by `options`.
        values: Q* of the assistant: an array [S, A], any callable from an observation to one value
            per action, or the path of a file written by `TabularValues.save`.
        discount: of the values, in (0, 1]; needed if the values do not state their own.
        perception: learner model for the record's `credited` action, a `Perception` or its name.
        **options: of the assistant, for instance `alpha=0.7`.

    Raises:
        RequestError: if the action space is not Discrete, an argument is unknown, missing or out of
            range, the environment lacks what the assistant needs, or the values state sizes or a
            task that are not the environment's. `reset` raises it if the
            values do not fit the environment or the assistant's options do not suit the episode.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        assistant: Assistant | str,
        values: QValues | np.ndarray | str | Path,
        *,
        discount: float | None = None,
        perception: Perception | str = "transition",
        **options: Any,
    ) -> None:
        RecordConstructorArgs.__init__(
            self, assistant=assistant, values=values, discount=discount, perception=perception,
            **options,
        )  # fmt: skip
        super().__init__(env)
        if not isinstance(env.action_space, gymnasium.spaces.Discrete):
            raise RequestError(
                f"action space {env.action_space} of {env}: an assistant needs a finite number of "
                "actions, a Discrete action space"
            )
        if isinstance(assistant, Assistant) and options:
            raise RequestError(
                f"options {sorted(options)} go with an assistant's name, not with an Assistant"
            )
        _check_names(assistant, options)
        self.assistant = (
            assistant if isinstance(assistant, Assistant) else make_assistant(assistant, **options)
        )
        given: Any = load_values(values) if isinstance(values, str | Path) else values
        self.discount = _discount_of(given, discount)
        self.perception = perception
        self._actions = int(env.action_space.n)
        self._first_action = int(env.action_space.start)
        shown = env.observation_space
        discrete = isinstance(shown, gymnasium.spaces.Discrete)
        self._first_state = int(shown.start) if discrete else 0
        self._generator = np.random.Generator(np.random.SFC64())
        self._noise: list[list[float]] = []
        self._recorded: list[list[float]] | None = None
        task = task_inside(env)
        self._seen = None if task is None else task.seen
        self._undo = undo_of(env) if "undo" in self.assistant.needs else None
        model = self._model()
        name = str(env.spec.id if env.spec else env)
        states = model.states if self._seen is None else int(max(self._seen)) + 1
        use = use_in(env, name, states, model.observation_size, given)
        self.values: QValues = as_values(given, use._replace(discount=self.discount))
        self._session = Session(self.assistant, self._values_of_states(), model, perception)

    def _values_of_states(self) -> QValues:
        """Values by what a session is given for a state, compared with the environment already."""
        if self._seen is not None:
            return OffsetValues(self.values, 0)
        counts_from_zero = not self._first_state or isinstance(self.values, TabularValues)
        return self.values if counts_from_zero else OffsetValues(self.values, self._first_state)

    def _model(self) -> Model:
        """What the rule may know of the environment: more if it is made from a task."""
        task = task_inside(self.env)
        space = self.env.observation_space
        discrete = isinstance(space, gymnasium.spaces.Discrete)
        shape = () if discrete or space.shape is None else space.shape
        model = Model(
            states=int(space.n) if discrete else 0,
            observation_size=int(shape[0]) if len(shape) == 1 else 0,
            actions=self._actions,
            no_op=-1 if task is None else task.no_op,
            discount=self.discount,
            dynamics=task.dynamics() if task is not None and task.states else None,
            distance=1 - np.eye(self._actions) if task is None else task.distance,
        )
        has = {
            "states": discrete,
            "dynamics": model.dynamics is not None and self._seen is None,
            "distance": task is not None and task.has_distance,
            "undo": True,  # undo_of has looked
            "no_op": model.no_op >= 0,
        }
        self.assistant.check_task(str(self.env.spec.id if self.env.spec else self.env), has)
        return read_only(model)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; `options["noise"]` is the assistant's, the rest the environment's."""
        options = dict(options or {})
        if seed is not None:
            self._generator = np.random.Generator(np.random.SFC64([seed, *b"SharedControl"]))
            self._noise = []
        recorded = options.pop("noise", None)
        self._recorded = None if recorded is None else _checked_noise(recorded)
        self._session.values_now = None
        observation, info = self.env.reset(seed=seed, options=options or None)
        self._session.begin(self._number(observation))
        self._observation, self._total, self._overrides = observation, 0.0, 0
        account, row = self._session.account, np.asarray(self._session.values_now)
        state = self._session.state
        first = Step(
            account.episode, state, -1, -1, False, -1, False, 0.0, 0.0, 0.0, row,
            account.start_value, 0.0, state, 0,
        )  # fmt: skip
        return observation, {**info, RECORD: self._shown(first)}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Propose an action; the assistant decides which one the environment gets.

        Raises:
            gymnasium.error.ResetNeeded: before `reset` or after an episode's end.
            RequestError: for an action outside the action space, the caller's or the rule's, or if
                the noise to be played again has run out.
        """
        session, first = self._session, self._first_action
        if session.values_now is None:
            raise gymnasium.error.ResetNeeded(
                "call reset() before step(), and after an episode's end"
            )
        proposed = action_number(action, "action", first, self._actions) - first
        decision = session.decide(proposed, self._next_noise())
        before = self._undo[0]() if decision.undo and self._undo else None
        observation, reward, terminated, truncated, info = self.env.step(decision.action + first)
        reward = float(reward)
        events = self._events(terminated, truncated, info)
        if decision.undo:
            self._take_back(before)
            terminated, truncated = False, bool(events & LIMIT)
        notice = self._notice(decision.action != proposed or decision.undo)
        step = session.record(reward, self._number(observation), events, notice)
        observation = self._observation if decision.undo else observation
        self._observation = observation
        self._total += reward
        self._overrides += step.overridden
        info = {**info, RECORD: self._shown(step)}
        if terminated or truncated:
            info[SUMMARY] = self._summary(step)
        return observation, reward, terminated, truncated, info

    def _number(self, observation: Any) -> Any:
        """The number of what the assistant sees, from 0; other observations as they are."""
        if self._seen is not None:
            return int(self._seen[observation])
        return observation - self._first_state if self._first_state else observation

    def _next_noise(self) -> Noise:
        if self._recorded is not None:
            if not self._recorded:
                raise RequestError(
                    "noise: the pairs to be played again have run out before the episode ended"
                )
            return Noise(*self._recorded.pop())
        if not self._noise:
            self._noise = self._generator.random((_NOISE_DRAWN, 2)).tolist()
        return Noise(*self._noise.pop())

    def _notice(self, overridden: bool) -> float:
        """A coin for a learner that notices some overrides, drawn only if it decides anything."""
        undecided = overridden and 0 < self._session.perception.notices < 1
        return float(self._generator.random()) if undecided else 0.0

    def _events(self, terminated: bool, truncated: bool, info: dict[str, Any]) -> int:
        """Bits of `qbumpers.tasks.dynamics` of a step."""
        events = TERMINATED * bool(terminated)
        if truncated:
            events |= LIMIT if reached_limit(self.env) else TRUNCATED
        return events | events_told(info)

    def _take_back(self, before: Any) -> None:
        if self._undo is None:
            raise RequestError(
                f"assistant {self.assistant.name} undoes a step; its rule must be registered with "
                'needs=("undo",)'
            )
        self._undo[1](before)

    def _shown(self, step: Step) -> dict[str, Any]:
        """A record of its own for the caller, numbered as the environment numbers."""
        shown = step._asdict()
        shown["values"] = step.values.copy()
        if self._first_action:
            for field in ("proposed", "executed", "credited"):
                shown[field] += self._first_action if shown[field] >= 0 else 0
        if self._first_state:
            shown["state"] += self._first_state
            shown["next_state"] += self._first_state
        return shown

    def _summary(self, last: Step) -> dict[str, Any]:
        account = self._session.account
        return {
            "return": self._total,
            "length": account.step,
            "overrides": self._overrides,
            "start_value": account.start_value,
            "projected_return": last.projected_return,
        }


def _check_names(assistant: Assistant | str, options: Mapping[str, Any]) -> None:
    """RequestError for an option that means an argument of the wrapper itself."""
    if options and not isinstance(assistant, Assistant):
        kind: Any = registered(assistant).options_type
        fields: tuple[str, ...] = kind._fields
        for option in options:
            if option not in fields and suggestion(option, _OWN):
                raise unknown_name("argument", option, [*_OWN, *fields])


def _checked_noise(noise: Any) -> list[list[float]]:
    """Recorded noise, the last decision's first."""
    pairs = np.asarray(noise, np.float64)
    if not pairs.size:
        return []
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not ((pairs >= 0) & (pairs < 1)).all():
        raise RequestError(
            f"noise has shape {pairs.shape}; pairs (coin, tie), [N, 2], of numbers in [0, 1) are "
            "needed"
        )
    return pairs[::-1].tolist()


def _discount_of(values: Any, discount: float | None) -> float:
    stated: float | None = getattr(values, "discount", None)
    if discount is not None and stated is not None and discount != stated:
        raise RequestError(
            f"discount = {discount!r}, but the values were made with {stated!r}; leave it out"
        )
    chosen = stated if discount is None else discount
    if chosen is None:
        raise RequestError(
            "discount is missing: the values state none; give the one they were made with, in "
            "(0, 1]"
        )
    check_number(chosen, "discount", "in (0, 1]")
    if not 0 < chosen <= 1:
        raise RequestError(f"discount = {chosen!r}; it must lie in (0, 1]")
    return float(chosen)
