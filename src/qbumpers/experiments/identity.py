"""With what the numbers of a condition are made, beside what seeds its random streams.

A condition's content seeds its streams: task, values, assistant, learner. Its identity holds what
else decides its numbers, and finished trials are used again only if both are the same:

- The code of the user's own rules, learners and environments, by what it means (`qbumpers.source`).
- Revisions of the package's own rules, learners, tasks and engines, which are raised when their
  numbers change; `tests/kept` sees to it.
- Versions of installed packages that the user's own code refers to, and of those that step an
  environment: Gymnasium, the one that the environment is from, and the ones that this one imports.
  NumPy's version is among them for environments alone: they draw from its generators, whose
  numbers may change between versions. The streams of simulations come from its seed sequences and
  Philox, which do not change, and everything behind them is the package's own.
- The processor's architecture, and the precision: libraries of elementary functions differ. On a
  graphics card, that it was one, and the version of the compiler for it: cards round products and
  sums together where the compiler says so.

Numba's version is not part of it: compiled code keeps to the arithmetic of IEEE 754 in the order in
which it is written, and kept numbers are the same in all versions that the package allows. Nor is
SciPy's, which has a part in Q* alone: the content holds Q* itself. Pydantic checks options and
decides no number.
"""

import platform
import uuid
from collections.abc import Mapping
from typing import Any, NamedTuple

from qbumpers.assistants import Assistant, assistants
from qbumpers.learners import LearnerType, learners
from qbumpers.random_streams import content_digest
from qbumpers.source import Meaning, meaning_of
from qbumpers.tasks import Task

_DECIDING_NOTHING = {"pydantic"}
_GPU = "gpu"  # in the place of the processor's architecture
_NAMED = 3  # pieces of code in one message at most


class Identity(NamedTuple):
    """With what numbers are made.

    Attributes:
        parts: JSON-like: processor, precision, revisions, whether code of the user's own is part
            of it (`own`), code, packages; and unknown, if something cannot be known, with the
            number of the run.
    """

    parts: Mapping[str, Any]

    @property
    def digest(self) -> str:
        """Sixteen hexadecimal digits: the same for equal parts."""
        return content_digest(self.parts).hex()[:16]

    @property
    def allows_unmarked(self) -> bool:
        """Whether it may have made trials of a version that noted no identity.

        So it may if nothing of the user's own is in it, no revision was raised since, and it is
        none of a graphics card.
        """
        unchanged = set(self.parts["revisions"].values()) <= {1}
        return not self.parts["own"] and unchanged and self.parts["processor"] != _GPU


def identity_of(
    assistant: Assistant, learner: LearnerType, task: Task, engine: Mapping[str, Any]
) -> Identity:
    """With what the numbers of a condition are made.

    Args:
        assistant: whose rules, the ones below it too, are looked at.
        learner: its kind of learner.
        task: its task.
        engine: what simulates it, from `qbumpers.simulation.made_by`.

    Returns:
        An identity; one that nothing else equals if something cannot be known.
    """
    registered = {f"assistant {rule.name}": rule for rule in assistant.chain}
    registered |= {f"learner {learner.name}": learner}
    own = {name: each.parts for name, each in registered.items() if not each.built_in}
    meaning = meaning_of(own | ({f"task {task.name}": task.code} if task.code else {}))
    revisions = {name: each.revision for name, each in registered.items()}
    if task.code:
        revisions[f"task {task.name}"] = task.revision
    parts = {
        "processor": platform.machine(),
        "precision": engine["precision"],
        "revisions": {"engine": engine["revision"], **revisions, **_borrowed(meaning)},
        "own": bool(meaning.modules),
        "code": meaning.code,
        "packages": {p: v for p, v in meaning.packages.items() if p not in _DECIDING_NOTHING},
    }
    if _GPU in engine:
        parts["processor"] = _GPU
        parts["revisions"] |= {"engine on a GPU": engine[_GPU]["revision"]}
        parts["packages"] |= {"numba-cuda": engine[_GPU]["numba-cuda"]}
    if meaning.unknown:
        parts |= {"unknown": list(meaning.unknown), "run": uuid.uuid4().hex}
    return Identity(parts)


def _borrowed(meaning: Meaning) -> dict[str, int]:
    """Revisions of the package's own rules and learners that code of the user's own calls."""
    found = {f"assistant {name}": rule for name, rule in assistants().items()}
    found |= {f"learner {name}": kind for name, kind in learners().items()}
    return {
        name: each.revision
        for name, each in found.items()
        if each.built_in and any(p and p.__module__ in meaning.of_package for p in each.parts)
    }


def differences(before: Mapping[str, Any] | None, now: Mapping[str, Any]) -> str:
    """What two identities differ in, in words.

    Args:
        before: parts of the one; None if nothing was noted.
        now: parts of the other.

    Returns:
        For example "the code of own_rules.helper changed since they were simulated".
    """
    if now.get("unknown"):
        return f"what decides them cannot be known ({'; '.join(now['unknown'])})"
    if before is None:
        return "what they were simulated with was not noted"
    if before.get("unknown"):
        return f"what had decided them cannot be known ({'; '.join(before['unknown'])})"
    return ", ".join([*_changed_code(before, now), *_changed_versions(before, now)])


def _changed_code(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    names = before["code"].keys() | now["code"].keys()
    changed = sorted(n for n in names if before["code"].get(n) != now["code"].get(n))
    # What is named by what it belongs to changes with the names of its parts.
    named = [name for name in changed if " " not in name] or changed
    if not named:
        return []
    more = f" and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
    return [f"the code of {', '.join(named[:_NAMED])}{more} changed since they were simulated"]


def _changed_versions(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    then = {**before["packages"], **_flat(before)}
    found = {**now["packages"], **_flat(now)}
    return [
        f"{name} was {then.get(name, 'not used')} and is {found.get(name, 'not used')}"
        for name in sorted(then.keys() | found.keys())
        if then.get(name) != found.get(name)
    ]


def _flat(parts: Mapping[str, Any]) -> dict[str, Any]:
    revisions = {f"the revision of {name}": n for name, n in parts["revisions"].items()}
    return {"the processor": parts["processor"], "the precision": parts["precision"], **revisions}
