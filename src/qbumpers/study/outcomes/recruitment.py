"""What the recruitment says of participants against what is recorded, and what they are owed."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import sqlalchemy as sql

from qbumpers.errors import RequestError
from qbumpers.study.design.models import Bonus, Study
from qbumpers.study.flow.tables import IDENTITIES
from qbumpers.study.outcomes.reading import Participant

_ID, _STATUS, _CODE = "Participant id", "Status", "Completion code"
_DONE = ("APPROVED", "AWAITING REVIEW")


class Mismatch(NamedTuple):
    """Somebody of whom the recruitment says something else than the records.

    Attributes:
        identity: PROLIFIC_PID.
        there: what the recruitment says.
        here: what is recorded.
    """

    identity: str
    there: str
    here: str


def identities_in(engine: sql.Engine) -> dict[str, str]:
    """The participant of each identity."""
    with engine.connect() as connection:
        rows = connection.execute(sql.select(IDENTITIES))
        return {row.identity: row.participant for row in rows}


def reconcile(
    study: Study,
    participants: Sequence[Participant],
    identities: Mapping[str, str],
    table: Path,
) -> list[Mismatch]:
    """Who completed there and not here, the reverse, and whose code is another one.

    Args:
        study: that they took part in.
        participants: what is recorded of them.
        identities: the participant of each identity.
        table: CSV file that Prolific exported, with columns "Participant id", "Status" and
            "Completion code".

    Raises:
        RequestError: if it cannot be read, or lacks a column.
    """
    outcomes = {each.name: each.now.outcome or "not finished" for each in participants}
    here = {identity: outcomes.get(name, "deleted") for identity, name in identities.items()}
    codes: dict[str, str] = {**study.recruitment.codes}
    found: list[Mismatch] = []
    there = _table_of(table)
    for identity, row in there.items():
        outcome = here.get(identity, "unknown")
        done = row[_STATUS].upper() in _DONE
        expected = codes.get(outcome, "")
        said = f"{row[_STATUS]}, code {row[_CODE] or 'none'}"
        if done != bool(expected) or (done and row[_CODE] != expected):
            found.append(Mismatch(identity, said, outcome))
    for identity, outcome in here.items():
        if identity not in there and outcome != "not finished":
            found.append(Mismatch(identity, "not in the table", outcome))
    return found


def _table_of(path: Path) -> dict[str, dict[str, str]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            missing = {_ID, _STATUS, _CODE} - set(reader.fieldnames or ())
            if missing:
                raise RequestError(
                    f"table {path}: it has no column {min(missing)!r}; export the submissions' "
                    "demographic data from Prolific"
                )
            rows: list[dict[str, str]] = list(reader)
            return {row[_ID]: row for row in rows}
    except (OSError, UnicodeDecodeError) as error:
        raise RequestError(f"table {path}: {error}") from error


def bonus_of(bonus: Bonus, participant: Participant) -> float:
    """What a participant is owed, in the currency, to the hundredth; 0 if they did not finish.

    Args:
        bonus: the rule.
        participant: what is recorded of them.
    """
    scores = participant.returns(bonus.phase)
    if participant.now.outcome != "complete" or not scores:
        return 0.0
    earned = bonus.per_point * (float(np.mean(scores)) - bonus.above)
    return round(min(bonus.most, max(0.0, earned)), 2)


def bonus_table(
    study: Study, participants: Sequence[Participant], identities: Mapping[str, str]
) -> str:
    """The bonuses as Prolific takes them: a line "PROLIFIC_PID,amount" each, without a heading.

    Args:
        study: with a rule.
        participants: what is recorded of them.
        identities: the participant of each identity; others are named by their own identifier.

    Raises:
        RequestError: if the study has no rule.
    """
    if study.bonus is None:
        raise RequestError("bonus: the study has no rule; give it a table [bonus] before it begins")
    names = {participant: identity for identity, participant in identities.items()}
    owed = {names.get(p.name, p.name): bonus_of(study.bonus, p) for p in participants}
    return "".join(f"{name},{amount:.2f}\n" for name, amount in owed.items() if amount)
