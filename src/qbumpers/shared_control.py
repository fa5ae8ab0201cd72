"""The Gymnasium wrapper: a person's or an agent's action goes in, the assisted one is executed."""

from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from qbumpers.assistants import Assistant, make_assistant
from qbumpers.compilation import uncompiled
from qbumpers.decisions import Noise, Situation, Step, projected_return
from qbumpers.errors import RequestError
from qbumpers.learners import perceive
from qbumpers.learners import perception as named_perception
from qbumpers.values import QValues, check_width, load_values

RECORD, SUMMARY = "assistance", "assisted_episode"
"""Keys of `info`: the record of every step, and the summary at the end of an episode."""

_NOISE_DRAWN = 256  # decisions for which noise is drawn at a time

_perceive, _projected_return = uncompiled(perceive), uncompiled(projected_return)


class SharedControl(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Share control of an environment between whoever calls `step` and an assistant.

    `info["assistance"]` holds the record of each step, always with the keys of
    `qbumpers.decisions.Step`; after `reset` it shows the values of the first state and -1 for the
    actions. The `info` of an episode's last step also holds `info["assisted_episode"]`, with
    `return`, `length`, `overrides`, `start_value` and `projected_return` (of the last decision).

    The assistant draws its noise from a generator of its own, seeded by `reset(seed=)`, so that
    the environment's chances are the same with and without an assistant. Recorded noise can be
    played again: `reset(options={"noise": [(coin, tie), ...]})`.

    Args:
        env: an environment with a Discrete action space.
        assistant: an assistant, or the name of one, its options then being given by `options`.
        values: Q* of the assistant, any callable from an observation to one value an action; or
            the path of a file written by `TabularValues.save`.
        discount: of the values, in (0, 1]; needed where the values do not state their own.
        perception: learner model for the record's `credited` action.
        **options: of the assistant, for instance `alpha=0.7`.

    Raises:
        RequestError: where the action space is not Discrete, or an argument is unknown, missing or
            out of range. `reset` raises it where the values do not fit the environment or the
            assistant's options do not suit the episode.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        assistant: Assistant | str,
        values: QValues | str | Path,
        *,
        discount: float | None = None,
        perception: str = "transition",
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
        self.assistant = (
            assistant if isinstance(assistant, Assistant) else make_assistant(assistant, **options)
        )
        self.values: QValues = load_values(values) if isinstance(values, str | Path) else values
        self.discount = _discount_of(self.values, discount)
        self.perception = named_perception(perception)
        self._actions = int(env.action_space.n)
        self._first_action = int(env.action_space.start)
        self._generator = np.random.Generator(np.random.SFC64())
        self._noise: list[list[float]] = []
        self._recorded: list[list[float]] = []
        self._memory = self.assistant.start()
        self._row: np.ndarray | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; `options["noise"]` is the assistant's, the rest the environment's."""
        options = dict(options or {})
        if seed is not None:
            self._generator = np.random.Generator(np.random.SFC64([seed, *b"SharedControl"]))
            self._noise = []
        self._recorded = _checked_noise(options.pop("noise", ()))
        self._row = None
        observation, info = self.env.reset(seed=seed, options=options or None)
        row = check_width(self.values(observation), self._actions, "at reset")
        self._start_value = float(row.max())
        self.assistant.check_start(self._start_value)
        self._row = row
        self._earned, self._discount_now, self._total = 0.0, 1.0, 0.0
        self._length, self._overrides = 0, 0
        record = Step(-1, -1, -1, False, 0.0, 0.0, 0.0, row.copy(), self._start_value, 0.0)
        return observation, {**info, RECORD: record._asdict()}

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Propose an action; the assistant decides which one the environment gets.

        Raises:
            gymnasium.error.ResetNeeded: before `reset` or after an episode's end.
            RequestError: for an action outside the action space, the person's or the rule's.
        """
        row = self._row
        if row is None:
            raise gymnasium.error.ResetNeeded(
                "call reset() before step(), and after an episode's end"
            )
        first = self._first_action
        proposed = int(action) - first
        if not 0 <= proposed < self._actions:
            raise RequestError(
                f"action = {action!r}; it must lie in [{first}, {first + self._actions})"
            )
        if not self._noise:
            self._noise = self._generator.random((_NOISE_DRAWN, 2)).tolist()
        noise = Noise(*(self._recorded or self._noise).pop())
        situation = Situation(row, proposed, self._earned, self._discount_now, self._start_value)
        decision = self.assistant.decide(situation, noise, self._memory)
        executed = int(decision.action)
        if not 0 <= executed < self._actions:
            raise RequestError(f"assistant {self.assistant.name} chose action {executed}")
        observation, reward, terminated, truncated, info = self.env.step(executed + first)
        reward = float(reward)
        credited = _perceive(self.perception, proposed, executed, reward, 0.0).action
        record = Step(
            proposed + first, executed + first, credited + first if credited >= 0 else -1,
            executed != proposed, float(decision.probability), noise.coin, noise.tie, row.copy(),
            _projected_return(self._earned, self._discount_now, float(row[proposed])), reward,
        )  # fmt: skip
        self._count(record, executed != proposed, reward)
        info = {**info, RECORD: record._asdict()}
        if terminated or truncated:
            self._row = None
            info[SUMMARY] = self._summary(record)
        else:
            self._row = check_width(
                self.values(observation), self._actions, f"after step {self._length}"
            )
        return observation, reward, terminated, truncated, info

    def _count(self, record: Step, overridden: bool, reward: float) -> None:
        self._memory = self.assistant.observe(self._memory, record)
        self._earned += self._discount_now * reward
        self._discount_now *= self.discount
        self._total += reward
        self._length += 1
        self._overrides += overridden

    def _summary(self, last: Step) -> dict[str, Any]:
        return {
            "return": self._total,
            "length": self._length,
            "overrides": self._overrides,
            "start_value": self._start_value,
            "projected_return": last.projected_return,
        }


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
    if not 0 < chosen <= 1:
        raise RequestError(f"discount = {chosen!r}; it must lie in (0, 1]")
    return float(chosen)
