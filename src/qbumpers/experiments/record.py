"""What an output folder notes of its conditions: what each is, and with what its numbers are made.

Results can so be read by programs that know neither the rules nor the learners.
"""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter, ValidationError

from qbumpers.assistants import Assistant
from qbumpers.experiments.design import NamedCondition
from qbumpers.experiments.identity import Identity
from qbumpers.experiments.learner_designs import written

CONDITIONS, FILES = "conditions.json", "files"
"""File of the record in an output folder; folder of what is in files that conditions name."""


class RecordedCondition(NamedTuple):
    """A condition as its output folder notes it.

    Attributes:
        condition: its readable id.
        assistant: name of its rule.
        alpha: the option of that name, of its rule or of one that this is over; None if none has.
        learner: the learner's readable id.
        options: of the rule by name; tuples and other assistants as ids write them.
        content: digest of what seeds its random streams, which names its cells.
        identity: digest of what else decides its numbers; empty if the folder does not note it.
        files: what is in the files that its options and its learner's settings name: the names
            under which the folder keeps them, by the names that the experiment has for them.
    """

    condition: str
    assistant: str
    alpha: float | None
    learner: str
    options: Mapping[str, Any]
    content: str = ""
    identity: str = ""
    files: Mapping[str, str] = {}


class Record(NamedTuple):
    """What an output folder notes of its conditions.

    Attributes:
        conditions: in the order of the experiment.
        task: digest of the task.
        values: digest of Q*.
        identities: the parts of every identity that some trial in the folder was simulated with, by
            digest.
        discount: gamma of the task; None if the folder does not note it.
        starts: numbers of what the assistant sees in the states in which an episode can start;
            empty if states are not numbered, or the folder does not note it.
    """

    conditions: Sequence[RecordedCondition]
    task: str = ""
    values: str = ""
    identities: Mapping[str, Mapping[str, Any]] = {}
    discount: float | None = None
    starts: Sequence[int] = ()

    def by_id(self) -> dict[str, RecordedCondition]:
        """The conditions by their readable ids."""
        return {each.condition: each for each in self.conditions}

    def allows_unmarked(self, identity: str) -> bool:
        """Whether an identity may have made trials for which none was noted."""
        return Identity(self.identities[identity]).allows_unmarked

    def encoded(self) -> bytes:
        """The record as JSON."""
        fields = {**self._asdict(), "conditions": [c._asdict() for c in self.conditions]}
        return (json.dumps(fields, indent=1) + "\n").encode()


def file_name(numbers: np.ndarray) -> str:
    """The name under which an output folder keeps the numbers of a file, float64 [N, K]."""
    content = str(numbers.shape).encode() + numbers.tobytes()
    return f"{FILES}/{hashlib.sha256(content).hexdigest()[:16]}.npy"


def is_kept_file(name: str) -> bool:
    """Whether a file in `FILES` is named as `file_name` does."""
    return re.fullmatch(r"[0-9a-f]{16}\.npy", name) is not None


def decoded_record(content: bytes | None) -> Record | None:
    """A record from what `encoded` gave; None if there is none, or it is damaged."""
    try:
        record = TypeAdapter(Record).validate_json(content or b"")
    except ValidationError:
        return None
    noted = [each.identity for each in record.conditions if each.identity]
    known = all(identity in record.identities for identity in noted)
    return record if known else None


def recorded(
    named: NamedCondition, content: str = "", identity: str = "", files: Mapping[str, str] = {}
) -> RecordedCondition:
    """A condition of an experiment as its output folder notes it."""
    assistant = named.assistant
    return RecordedCondition(
        named.condition,
        assistant.name,
        _alpha_of(assistant),
        named.learner_id,
        _as_cells(assistant),
        content,
        identity,
        files,
    )


def _as_cells(assistant: Assistant) -> dict[str, Any]:
    """Options as a table can hold them; None is left out."""
    plain = (bool, int, float, str)
    fields = assistant.options._asdict()
    return {
        f: v if isinstance(v, plain) else written(v) for f, v in fields.items() if v is not None
    }


def _alpha_of(assistant: Assistant | None) -> float | None:
    """The option alpha of an assistant or of one that it is over."""
    while assistant is not None:
        options = assistant.options._asdict()
        if "alpha" in options:
            return options["alpha"]
        assistant = assistant.of
    return None
